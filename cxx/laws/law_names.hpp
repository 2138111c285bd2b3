// The laws by their names, for those few that name one: a new row of laws.def compiles these again.
#pragma once
#include "law_info.hpp"

namespace cairn {

enum class Law : std::int16_t {
#define CAIRN_LAW(name, ...) name,
#include "../../core_f90/contact_laws/laws.def"
#undef CAIRN_LAW
};

} // namespace cairn
