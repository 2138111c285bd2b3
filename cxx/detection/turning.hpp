#pragma once

namespace cairn::detection {

// Turns x from the axes of a body to those of space; q: unit quaternion (w, x, y, z).
inline void turn(const double* q, const double* x, double* out) {
  double t[3];
  for (int k = 0; k < 3; ++k) t[k] = 2 * (q[1 + (k + 1) % 3] * x[(k + 2) % 3] - q[1 + (k + 2) % 3] * x[(k + 1) % 3]);
  for (int k = 0; k < 3; ++k)
    out[k] = x[k] + q[0] * t[k] + q[1 + (k + 1) % 3] * t[(k + 2) % 3] - q[1 + (k + 2) % 3] * t[(k + 1) % 3];
}

} // namespace cairn::detection
