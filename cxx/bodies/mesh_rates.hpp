// What opposes the velocities of a mesh at the start, and how explicit steps are bounded by it.
#pragma once
#include "mesh_body.hpp"

namespace cairn {

// Values of the lower triangle of the damping matrix and of what materials add that see a rate of strain [N s/m].
std::vector<double> rate_values(const MeshModel& model);

// How many times the rate c of a drag counts for the step of an explicit integrator, beside a frequency, of what it
// does for that of central differences.
double rate_share(const cairn_scheme& scheme);

} // namespace cairn
