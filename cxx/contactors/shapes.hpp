// The shapes by their names, for those that name one: a new row of shapes.def compiles these again.
#pragma once
#include "contactor.hpp"

namespace cairn {

enum class Shape : std::int16_t {
#define CAIRN_SHAPE(name, ...) name,
#include "../../core_f90/detection/shapes.def"
#undef CAIRN_SHAPE
};
inline constexpr int shapes = 0
#define CAIRN_SHAPE(...) +1
#include "../../core_f90/detection/shapes.def"
#undef CAIRN_SHAPE
    ;

} // namespace cairn
