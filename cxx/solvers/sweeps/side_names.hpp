// Kinds of sides by their names, for those that choose one: a new row of sides.def compiles these again.
#pragma once
#include <cstdint>

namespace cairn {

enum Side : std::int32_t {
#define CAIRN_SIDE(name, dimension, lever, width) name,
#define CAIRN_MAPPED_SIDE(name, dimension, lever, width) name,
#include "../../../core_f90/sides/sides.def"
#undef CAIRN_SIDE
#undef CAIRN_MAPPED_SIDE
};

} // namespace cairn
