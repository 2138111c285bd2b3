// Workspace of one thread: a batch of pairs on its way from places to forces.
#pragma once
#include "smooth_dem.hpp"

namespace cairn {

struct SmoothDem::Lanes {
  static constexpr int n = NeighbourList::lanes;
  static constexpr int most_state = 20;
  alignas(64) double between[3 * n], radius_a[n], radius_b[n], direction_b[4 * n], gap[n], normal[3 * n], point[3 * n];
  alignas(64) double lever_a[3 * n], lever_b[3 * n], grain_a[2 * n], grain_b[2 * n], jump[3 * n];
  alignas(64) double frame[6 * n], u[6 * n], lane_gap[n], geometry[3 * n], state[most_state * n], f[6 * n],
      energy[4 * n];
  alignas(64) double push[12 * n]; // of all A, then of all B
  alignas(64) double arm[2 * n], rows[most_state * n];
  alignas(64) std::int32_t status[n], lane[n + 8];
};

struct SmoothPairKind {
  Shape a, b;
  cairn_pair_contact* contact;
};
std::span<const SmoothPairKind> smooth_pair_kinds();

} // namespace cairn
