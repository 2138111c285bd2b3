// Cohesive laws that solvers may take as elements of a solid.
#pragma once
#include <cstdint>

#include "cairn/rows/law.h"

namespace cairn {

// The slot `zone` of row `law` of laws.def; null where the law does not offer it.
cairn_law_zone* zone_of(std::int32_t law);

} // namespace cairn
