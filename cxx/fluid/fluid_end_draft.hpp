// Open ends of a liquid before the start: boxes out of which it comes and into which it flows.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "fluid.hpp"

namespace cairn {

struct FluidInflow {
  std::array<double, 3> low{}, high{}; // corners of the box, absolute [m]
  int axis = 0;                        // along which the liquid comes
  std::vector<double> speed;           // of each row of particles, or of all; < 0: down the axis [m/s]
};

// Open ends as they are given.
struct FluidEndDraft {
  std::vector<FluidInflow> inflows;
  std::vector<FluidOutflow> outflows; // corners absolute [m]
  bool empty() const { return inflows.empty() && outflows.empty(); }
};

// Arguments of Fluid::set_ends, and the particles that stand in inflows: absolute places (dim, n) [m], velocities
// [m/s].
struct FluidRows {
  FluidLanes lanes; // faces absolute [m]
  std::vector<double> position, velocity;
  std::vector<std::int32_t> lane;
};

// Fills inflows with rows of particles. position (dim, n): the liquid [m], absolute. Throws Error for boxes that are
// too short or narrow or hold liquid, for ends that lead the wrong way, and along periodic axes.
FluidRows rows_of_ends(int dim, const FluidEndDraft& ends, const FluidSettings& settings,
                       const std::array<bool, 3>& periodic, std::span<const double> position);

} // namespace cairn
