// The laws by their names, for those few that name one: a new row of laws.def compiles these again.
#pragma once
#include "../contacts/interaction.hpp"

namespace cairn {

enum class Law : std::int16_t {
#define CAIRN_LAW(name, ...) name,
#include "../../core_f90/contact_laws/laws.def"
#undef CAIRN_LAW
};

// Whether a law can hold two bodies at their contact along the tangents as well; it does where its first state variable
// is above 0.
inline bool can_bond(Law law) {
  const LawInfo& of = law_infos()[std::size_t(law)];
  return (of.anchored && !of.spans) || law == Law::sintering || law == Law::coupled_motion;
}

} // namespace cairn
