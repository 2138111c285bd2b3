// Speeds of bodies to which velocity errors are relative.
#pragma once
#include <cmath>
#include <cstdint>

#include "../bodies/body.hpp"

namespace cairn {

// f(by_loads, at_begin) for each axis of a body that contacts move: mass times the square of the change of its velocity
// by loads, and of its velocity at the begin of the step [J].
template <class F>
void each_speed(const Bodies& bodies, std::int64_t body, int dim, F&& f) {
  const double mass = *bodies.mass[body];
  if (!(mass > 0) || !std::isfinite(mass) || !(bodies.inverse_mass[body][0] > 0)) return;
  for (int k = 0; k < dim; ++k) {
    const double begin = bodies.velocity_begin[body][k], change = bodies.velocity_free[body][k] - begin;
    f(mass * change * change, mass * begin * begin);
  }
}

} // namespace cairn
