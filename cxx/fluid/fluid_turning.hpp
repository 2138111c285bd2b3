// Viscosity at the side of a body that turns.
#pragma once
#include "../base/vectors.hpp"

namespace cairn {

// to = from + factor times spin x side: what the spin of a body takes from the force of viscosity at a side of it.
// Morris' sum is viscosity times the slope of the velocity, which a liquid that turns with the body has too.
inline void add_turning(const double* spin, const double* side, double factor, const double* from, double* to) {
  double turned[3];
  cross(spin, side, turned);
  for (int c = 0; c < 3; ++c) to[c] = from[c] + factor * turned[c];
}

} // namespace cairn
