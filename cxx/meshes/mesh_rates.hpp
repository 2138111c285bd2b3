// What opposes the velocities of a mesh at the start, and how explicit steps are bounded by it.
#pragma once
#include "mesh_body.hpp"

namespace cairn {

// Values of the lower triangle of the damping matrix and of what materials add that see a rate of strain [N s/m].
std::vector<double> rate_values(const MeshModel& model);

// What bounds a damped step of an explicit integrator, in terms of central differences of h' = h 2 / largest without
// damping, and of `frequency` h' where what opposes velocities counts `rate` times.
struct DragBound {
  double frequency = 1, rate = 1;
};
DragBound drag_bound(const cairn_scheme& scheme);

} // namespace cairn
