// Damping and rate terms of a mesh at the start, and the bound that they set to explicit steps.
#pragma once
#include "mesh_body.hpp"

namespace cairn {

// Values of the lower triangle of the damping matrix plus the tangent of rate-dependent materials [N s/m].
std::vector<double> rate_values(const MeshModel& model);

// Stability of a damped explicit step in terms of central differences of h' = h 2 / largest: stable for h' without
// damping, and for `frequency` h' with damping multiplied by `rate`.
struct DragBound {
  double frequency = 1, rate = 1;
};
DragBound drag_bound(const cairn_scheme& scheme);

} // namespace cairn
