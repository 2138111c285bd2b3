// How far the rounding of velocities of bodies reaches into the relative velocities of contacts, as an energy.
#pragma once
#include <algorithm>
#include <limits>

#include "batch.hpp"
#include "contact_system.hpp"

namespace cairn {

// Part of the error of a contact that hides in the rounding of its bodies' velocities, over their sum of
// rho |v|^2, v the velocity at the contact: they are known to some epsilons.
inline constexpr double rounding_square =
    (16 * std::numeric_limits<double>::epsilon()) * (16 * std::numeric_limits<double>::epsilon());

// f(of A, of B): rho |v|^2 of both sides of each contact of a batch of round bodies [J].
template <int d, class F>
void each_rounding_of_pack(const ContactSystem& system, const cairn_batch& b, F&& f) {
  const auto of = [&](std::int32_t body, double arm, double rho) {
    const double* v = system.record[std::size_t(body)].x;
    double speed = 0, spin = 0;
    for (int k = 0; k < d; ++k) speed += v[k] * v[k];
    for (int k = d; k < 3 * d - 3; ++k) spin += v[k] * v[k];
    return rho * (speed + spin * (arm * arm));
  };
  for (int lane = 0; lane < b.contacts; ++lane)
    f(of(b.body_a[lane], at(b, b.lever_a, lane, 0), b.rho[lane]),
      of(b.body_b[lane], at(b, b.lever_b, lane, 0), b.rho[lane]));
}

// Square of the speed of the side of a contact [m2/s2]; of the fastest node that a mapped side rests on.
inline double square_of_side(const ContactSystem& system, const cairn_batch& b, int lane, bool a) {
  const int dim = system.dim, n = system.velocities();
  double* lever = a ? b.lever_a : b.lever_b;
  const std::int32_t body = (a ? b.body_a : b.body_b)[lane];
  if (a ? b.mapped_a : b.mapped_b) {
    const std::int32_t* node = a ? b.node_a : b.node_b;
    double fastest = 0;
    for (int j = 0; j < 4; ++j) {
      const int at_lane = j * b.count + lane;
      if (!(lever[at_lane] > 0 || lever[at_lane] < 0)) continue;
      double v[3], square = 0;
      system.read_condensed(body, node[at_lane], v);
      for (int k = 0; k < dim; ++k) square += v[k] * v[k];
      fastest = std::max(fastest, square);
    }
    return fastest;
  }
  const double* v = system.record[std::size_t(body)].x;
  double speed = 0, spin = 0, arm = 0;
  for (int k = 0; k < dim; ++k) speed += v[k] * v[k];
  for (int k = dim; k < n; ++k) spin += v[k] * v[k];
  for (int k = 0; k < sides()[a ? b.side_a : b.side_b].lever; ++k) arm += at(b, lever, lane, k) * at(b, lever, lane, k);
  return speed + spin * arm;
}

// The same of every contact. Records hold the velocity.
template <class F>
void each_rounding(const ContactSystem& system, F&& f) {
  for (const cairn_batch& b : system.batches)
    if (b.pack)
      system.dim == 2 ? each_rounding_of_pack<2>(system, b, f) : each_rounding_of_pack<3>(system, b, f);
    else
      for (int lane = 0; lane < b.contacts; ++lane)
        f(b.rho[lane] * square_of_side(system, b, lane, true), b.rho[lane] * square_of_side(system, b, lane, false));
}

} // namespace cairn
