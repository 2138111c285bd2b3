// Vectors between the axes of space and those that a body carries.
#pragma once
#include <cmath>
#include <cstdint>

#include "../base/vectors.hpp"
#include "../bodies/body.hpp"

namespace cairn {

inline void turn_about(const double* q, double sign, const double* from,
                       double* to) { // v + 2 w (u x v) + 2 u x (u x v)
  const double u[3] = {sign * q[1], sign * q[2], sign * q[3]}, v[3] = {from[0], from[1], from[2]};
  double once[3];
  cross(u, v, once);
  for (int k = 0; k < 3; ++k)
    to[k] = v[k] + 2 * (q[0] * once[k] + u[(k + 1) % 3] * once[(k + 2) % 3] - u[(k + 2) % 3] * once[(k + 1) % 3]);
}

// `from` may be `to`; in 2D the first two of three numbers, the third is kept.
inline void turn_axes(const Bodies& bodies, int dim, std::int32_t body, double sign, const double* from, double* to) {
  if (!bodies.rotation.active) {
    for (int k = 0; k < dim; ++k) to[k] = from[k];
    return;
  }
  if (dim == 3) return turn_about(bodies.rotation[body], sign, from, to);
  const double angle = sign * *bodies.rotation[body], c = std::cos(angle), s = std::sin(angle);
  const double x = c * from[0] - s * from[1];
  to[1] = s * from[0] + c * from[1];
  to[0] = x;
}
inline void to_space_axes(const Bodies& bodies, int dim, std::int32_t body, const double* from, double* to) {
  turn_axes(bodies, dim, body, 1, from, to);
}
inline void to_body_axes(const Bodies& bodies, int dim, std::int32_t body, const double* from, double* to) {
  turn_axes(bodies, dim, body, -1, from, to);
}

} // namespace cairn
