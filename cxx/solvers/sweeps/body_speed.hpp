// Energy of the velocity of a body in its record.
#pragma once
#include "contact_system.hpp"

namespace cairn {

// f(term) for the terms of |v|_M^2 of a body; turns: those of its rotation too [J]
template <class F>
void each_speed(const ContactSystem& system, std::int64_t body, bool turns, F&& f) {
  const double* x = system.record[std::size_t(body)].x;
  for (int k = 0; k < (turns ? system.velocities() : system.dim); ++k) {
    const double inverse = system.dim == 2 ? x[3 + k] : x[k < 3 ? 6 : 7];
    if (inverse > 0) f(x[k] * x[k] / inverse);
  }
}

} // namespace cairn
