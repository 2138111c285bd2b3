// A deformable body as contacts see it.
#pragma once
#include <cstdint>
#include <vector>

#include "cairn/core.h"

namespace cairn {

struct CondensedBody {
  cairn_condensed dofs{};
  std::vector<std::int32_t> node; // of each contact node the internal number of the body that shows it
};

} // namespace cairn
