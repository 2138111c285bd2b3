// A deformable body as contacts see it.
#pragma once
#include <cstdint>
#include <vector>

#include "../base/field.hpp"
#include "cairn/core.h"

namespace cairn {

// Dofs up to which a body is condensed whole, and contacts store its response.
inline constexpr std::int64_t small_condensed = 24;
// Numbers from the velocities of one body to those of the next: whole cache lines.
inline std::size_t condensed_rows(std::int64_t dofs) { return std::size_t(dofs + 7) / 8 * 8; }

struct CondensedBody {
  cairn_condensed dofs{};
  cairn_reach reach{};       // where dofs.reach is not null
  double mass = 0;           // of the whole body, held or not [kg]
  std::int64_t touching = 1; // its nodes that may ever touch
  double inverse_mass = 0;   // of the whole body, 0 where dofs along each axis are given [1/kg]
  // Numbers from dofs.velocity on that impulses change, whatever their kind, and those between.
  std::size_t moving() const {
    return dofs.reach ? condensed_rows(dofs.dofs) + std::size_t(reach.numbers) : std::size_t(dofs.dofs);
  }
  std::vector<std::int32_t> node; // of each contact node its place among the nodes of the scene
  // After them, means over more nodes than a contact rests on: places in the scene and weights, and the compliance with
  // them. `row` then is that of each node of the mesh, -1: none; empty where there are no means.
  std::vector<std::int32_t> mean_start, mean_node, row;
  std::vector<double> mean_weight;
  Array<double> compliance;
  std::size_t means() const { return mean_start.empty() ? 0 : mean_start.size() - 1; }
  // Calls use(place in the scene, weight) for the nodes of a row.
  template <class Use>
  void each_node(std::size_t of_row, Use&& use) const {
    if (of_row < node.size()) return use(node[of_row], 1.0);
    const std::size_t k = of_row - node.size();
    for (auto e = std::size_t(mean_start[k]); e < std::size_t(mean_start[k + 1]); ++e)
      use(mean_node[e], mean_weight[e]);
  }
};

} // namespace cairn
