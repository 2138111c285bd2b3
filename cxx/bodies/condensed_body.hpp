// A deformable body as contacts see it.
#pragma once
#include <cstdint>
#include <vector>

#include "cairn/core.h"

namespace cairn {

// Dofs up to which a body is condensed whole, and contacts keep what they do to it.
inline constexpr std::int64_t small_condensed = 24;
// Numbers from the velocities of one body to those of the next: whole cache lines.
inline std::size_t condensed_rows(std::int64_t dofs) { return std::size_t(dofs + 7) / 8 * 8; }

struct CondensedBody {
  cairn_condensed dofs{};
  std::vector<std::int32_t> node; // of each contact node its place among the nodes of the scene
};

} // namespace cairn
