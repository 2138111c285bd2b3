// Vectors between the axes of space and those that a body carries.
#pragma once
#include <cmath>
#include <cstdint>

#include "../base/turning.hpp"
#include "../bodies/body.hpp"

namespace cairn {

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
