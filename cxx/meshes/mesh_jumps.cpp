// Displacement jumps by contact impulses and prescribed velocities, where an integrator moves bodies by part of a jump
// beside its velocities (linear_scheme.f90): by p1/h M^-1 H p, with p1 = position_1. Elastic forces at the end of the
// step include that displacement; otherwise contacts would be pushed on by K p1/h M^-1 H p, more in each step once h^2
// |p1| times a squared frequency is above 1/(1 - gamma) h^2.
// With A = M + damping C + stiffness K and theta = -p1/(h^2 share), zero where Newmark's beta is gamma/2, velocities
// answer to impulses by
//   A^-1 (I + theta stiffness K M^-1) = mass M^-1 + rest A^-1.
// It is symmetric, with C = a M + b K, mass = theta stiffness/(stiffness + b damping) and rest = 1 - mass (1 + a
// damping). Other damping takes its velocities in the same way, as if it were a part of K: mass is then theta.
#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "mesh_body.hpp"

namespace cairn {

double MeshBody::jump_share(const cairn_scheme& scheme) const {
  if (scheme.histories == 0 || !(scheme.stiffness > 0) || (!linear() && model.ties.rigid_parts_turn())) return 0;
  return -scheme.position[0] / (scheme.h * scheme.h * scheme.share);
}

// a and b of Rayleigh's damping, by least squares over the entries of M and K; whether C is that to rounding.
void MeshBody::find_rayleigh() {
  constexpr double rounding = 1e-12;
  rayleigh_[0] = rayleigh_[1] = 0;
  by_rayleigh_ = !damps_;
  if (!damps_ || !model.mode_rates.empty() || model.times_damping ||
      model.damping.value.size() != model.mass.value.size())
    return;
  double mm = 0, mk = 0, kk = 0, cm = 0, ck = 0, largest = 0, worst = 0;
  for (std::size_t e = 0; e < model.mass.value.size(); ++e) {
    const double m = model.mass.value[e], k = model.stiffness.value[e], c = model.damping.value[e];
    mm += m * m, mk += m * k, kk += k * k, cm += c * m, ck += c * k;
    largest = std::max(largest, std::abs(c));
  }
  const double det = mm * kk - mk * mk;
  if (!(mm > 0)) return;
  if (det > 1e-14 * mm * kk)
    rayleigh_[0] = (cm * kk - ck * mk) / det, rayleigh_[1] = (ck * mm - cm * mk) / det;
  else
    rayleigh_[0] = cm / mm;
  for (std::size_t e = 0; e < model.mass.value.size(); ++e)
    worst = std::max(worst, std::abs(model.damping.value[e] - rayleigh_[0] * model.mass.value[e] -
                                     rayleigh_[1] * model.stiffness.value[e]));
  by_rayleigh_ = worst <= rounding * largest;
}

// Weights of the inverse of M and of the inverse of A in the answer of velocities to impulses.
MeshBody::Answer MeshBody::answer() const {
  const double share = jump_share(scheme_);
  if (!has_part(share)) return {0, 1};
  if (!by_rayleigh_) return {share, 1 - share};
  const double mass = share * scheme_.stiffness / (scheme_.stiffness + rayleigh_[1] * scheme_.damping);
  return {mass, 1 - mass * (1 + rayleigh_[0] * scheme_.damping)};
}

// Changes of velocities by impulses b, zero at held dofs.
void MeshBody::respond(double* b, std::int64_t columns) {
  const Answer by = answer();
  if (!has_part(by.mass)) return solve(b, columns);
  const std::int64_t n = model.dofs();
  responding_.assign(b, b + n * columns);
  for (std::int64_t c = 0; c < columns; ++c) solve_mass(&responding_[std::size_t(n * c)]);
  solve(b, columns);
  for (std::int64_t i = 0; i < n * columns; ++i) b[i] = by.mass * responding_[std::size_t(i)] + by.rest * b[i];
}

// Jumps of prescribed velocities from v_ on, into given_jump_, and of zero impulse into impulse_jump_ [m/s]; both empty
// where the integrator has no displacement jumps.
void MeshBody::start_jumps() {
  given_jump_.clear();
  impulse_jump_.clear();
  if (!has_part(jump_share(scheme_))) return;
  const auto n = std::size_t(model.dofs());
  impulse_jump_.assign(n, 0.0);
  given_jump_.assign(n, 0.0);
  bool some = false;
  for (std::size_t i = 0; i < n; ++i) {
    if (!model.held[i]) continue;
    given_jump_[i] = (held_velocity.empty() ? 0 : held_velocity[i]) - v_[i];
    some = some || has_part(given_jump_[i]);
  }
  if (some) solve_bound_mass(given_jump_.data());
}

// Adds elastic and damping forces of `jump` over the step to those of the history; x (dofs) is scratch.
void MeshBody::forces_of_jumps(const std::vector<double>& jump, double* x) {
  const std::size_t n = jump.size();
  const double far = scheme_.end_share * scheme_.position[0] / scheme_.h, slow = undamped_share();
  responding_.resize(n);
  for (std::size_t i = 0; i < n; ++i) responding_[i] = far * jump[i];
  stiffness_times(responding_.data(), x);
  for (std::size_t i = 0; i < n; ++i) stiff_known_[i] += x[i];
  if (!has_part(slow)) return;
  for (std::size_t i = 0; i < n; ++i) responding_[i] = -slow * jump[i];
  damping_times(responding_.data(), x);
  for (std::size_t i = 0; i < n; ++i) damped_known_[i] += x[i];
}

// At the end of a step of a linear body, whose impulses are known.
void MeshBody::take_jumps(double* x) {
  for (std::size_t i = 0; i < jump_.size(); ++i) impulse_jump_[i] = jump_[i] - given_jump_[i];
  forces_of_jumps(impulse_jump_, x);
}

// How far jumps move a dof beside the velocities at both ends [m].
double MeshBody::way_of_jumps(std::size_t i) const {
  return given_jump_.empty() ? 0 : scheme_.position[0] / scheme_.h * (given_jump_[i] + impulse_jump_[i]);
}

// Part of the jumps that damping does not see [m/s].
double MeshBody::undamped_jump(std::size_t i) const {
  return given_jump_.empty() ? 0 : undamped_share() * (given_jump_[i] + impulse_jump_[i]);
}

double MeshBody::undamped_share() const { return by_rayleigh_ ? 0 : jump_share(scheme_) * scheme_.implicit; }

// Into free_: the answer to jumps that the pass before knew, less what `respond` says of the same.
void MeshBody::add_known_jumps() {
  if (given_jump_.empty()) return;
  const Answer by = answer();
  std::vector<double>& momentum = responding_;
  momentum.resize(impulse_jump_.size());
  multiply_mass(impulse_jump_.data(), momentum.data());
  for (std::size_t i = 0; i < momentum.size(); ++i)
    if (model.held[i]) momentum[i] = 0;
  solve(momentum.data());
  for (std::size_t i = 0; i < momentum.size(); ++i)
    free_[i] += (1 - by.rest) * momentum[i] - by.mass * impulse_jump_[i];
}

// The way of the step of node dofs that end with velocities v.
double MeshBody::way_of(std::size_t i, double v) const {
  const double way = h_ * (share_ * v + (1 - share_) * v_[i]);
  if (!way_beside_.empty()) return way + way_beside_[i];
  return past_.empty() ? way : way + past_[i] + scheme_.position[0] / h_ * jump_[i];
}

// Stresses where the step ends, if that is not where its balance has them.
void MeshBody::find_stresses_at_end(const std::vector<double>& end) {
  for (std::size_t i = 0; i < end.size(); ++i) force_step_[i] = force_of(i);
  bool elsewhere = explicit_;
  for (std::size_t i = 0; i < past_.size() && !elsewhere && given_jump_.empty(); ++i) {
    const double moved = scheme_.position[0] * jump_[i];
    elsewhere = moved < 0 || moved > 0;
  }
  if (!elsewhere) return;
  iterate_ = end;
  for (std::size_t i = 0; i < end.size(); ++i) b_[i] = q_[i] + way_of(i, end[i]);
  found_ = stresses_there(end.data(), 0, false);
  if (!found_.ok()) fail(found_, " at the end of the step", advice());
}

} // namespace cairn
