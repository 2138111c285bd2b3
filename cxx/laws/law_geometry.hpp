// Geometry of a contact for laws: area, radii, mass.
#pragma once
#include <algorithm>

#include "law_info.hpp"

namespace cairn {

// Friction against rolling, by a parameter of this name.
inline bool rolls(const LawInfo& law) {
  return std::any_of(law.parameters.begin(), law.parameters.end(), [](const auto& p) { return p.name == "rolling"; });
}
// Area, effective radius and effective mass of a contact; where the law rolls, then the radii of rolling about t t, t s
// and s s, which in 2D are not read.
inline int geometry_columns(const LawInfo& law) { return rolls(law) ? 6 : 3; }

} // namespace cairn
