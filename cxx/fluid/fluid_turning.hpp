// Viscosity at the side of a body that turns.
#pragma once

namespace cairn {

// to = from + factor times spin x side: what the spin of a body takes from the force of viscosity at a side of it.
// Morris' sum is viscosity times the slope of the velocity, which a liquid that turns with the body has too.
inline void add_turning(const double* spin, const double* side, double factor, const double* from, double* to) {
  for (int c = 0; c < 3; ++c) {
    const int a = (c + 1) % 3, b = (c + 2) % 3;
    to[c] = from[c] + factor * (spin[a] * side[b] - spin[b] * side[a]);
  }
}

} // namespace cairn
