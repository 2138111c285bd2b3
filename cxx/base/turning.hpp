// Turns of vectors by unit quaternions.
#pragma once
#include "vectors.hpp"

namespace cairn {

// Turns a vector from the axes of a body to those of space; q: unit quaternion (w, x, y, z), sign -1: back. By
// v + 2 w (u x v) + 2 u x (u x v), u the vector of q; `from` may be `to`.
inline void turn_about(const double* q, double sign, const double* from, double* to) {
  const double u[3] = {sign * q[1], sign * q[2], sign * q[3]}, v[3] = {from[0], from[1], from[2]};
  double once[3];
  cross(u, v, once);
  for (int k = 0; k < 3; ++k)
    to[k] = v[k] + 2 * (q[0] * once[k] + u[(k + 1) % 3] * once[(k + 2) % 3] - u[(k + 2) % 3] * once[(k + 1) % 3]);
}

} // namespace cairn
