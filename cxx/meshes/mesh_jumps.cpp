// Displacement jumps by contact impulses and prescribed velocities, where an integrator moves bodies by part of a jump
// beside its velocities (linear_scheme.f90): by p1/h M^-1 H p, with p1 = position_1. Elastic forces at the end of the
// step include that displacement; otherwise contacts would be pushed on by K p1/h M^-1 H p, more in each step once h^2
// |p1| times a squared frequency is above 1/(1 - gamma) h^2.
// With A = M + damping C + stiffness K and theta = -p1/(h^2 share), zero where Newmark's beta is gamma/2, velocities
// answer to impulses by
//   A^-1 (I + theta stiffness K M^-1) = mass M^-1 + rest A^-1.
// It is symmetric, with C = a M + b K, mass = theta stiffness/(stiffness + b damping) and rest = 1 - mass (1 + a
// damping). Other damping takes its velocities in the same way, as if it were a part of K: mass is then theta.
#include "mesh_jumps.hpp"

#include <algorithm>

namespace cairn {

// Jumps of prescribed velocities from v_ on, into given, and of zero impulse into by_impulses [m/s]; both empty
// where the integrator has no displacement jumps.
void MeshJumps::start() {
  given.clear();
  by_impulses.clear();
  if (!MeshFactors::has_part(factors_.jump_share(step_.scheme))) return;
  const auto n = std::size_t(model_.dofs());
  by_impulses.assign(n, 0.0);
  given.assign(n, 0.0);
  bool some = false;
  for (std::size_t i = 0; i < n; ++i) {
    if (!model_.held[i]) continue;
    given[i] = (loads_.held_velocity.empty() ? 0 : loads_.held_velocity[i]) - step_.v[i];
    some = some || MeshFactors::has_part(given[i]);
  }
  if (some) equations_.solve_bound_mass(given.data());
}

// Adds elastic and damping forces of `jump` over the step to those of the history; x (dofs) is scratch.
void MeshJumps::add_forces(const std::vector<double>& jump, double* x) {
  const std::size_t n = jump.size();
  const double far = step_.scheme.end_share * step_.scheme.position[0] / step_.scheme.h, slow = undamped_share();
  scratch_.resize(n);
  for (std::size_t i = 0; i < n; ++i) scratch_[i] = far * jump[i];
  matrices_.stiffness_times(scratch_.data(), x);
  for (std::size_t i = 0; i < n; ++i) history_.stiff[i] += x[i];
  if (!MeshFactors::has_part(slow)) return;
  for (std::size_t i = 0; i < n; ++i) scratch_[i] = -slow * jump[i];
  matrices_.damping_times(scratch_.data(), x);
  for (std::size_t i = 0; i < n; ++i) history_.damped[i] += x[i];
}

// At the end of a step of a linear body, whose impulses are known.
void MeshJumps::take(double* x) {
  for (std::size_t i = 0; i < all.size(); ++i) by_impulses[i] = all[i] - given[i];
  add_forces(by_impulses, x);
}

// How far jumps move a dof beside the velocities at both ends [m].
double MeshJumps::way_of(std::size_t i) const {
  return given.empty() ? 0 : step_.scheme.position[0] / step_.scheme.h * (given[i] + by_impulses[i]);
}

// Part of the jumps that damping does not see [m/s].
double MeshJumps::undamped(std::size_t i) const {
  return given.empty() ? 0 : undamped_share() * (given[i] + by_impulses[i]);
}

double MeshJumps::undamped_share() const {
  return matrices_.by_rayleigh ? 0 : factors_.jump_share(step_.scheme) * step_.scheme.implicit;
}

// Into free_: the answer to jumps that the pass before knew, less what `respond` says of the same.
void MeshJumps::add_known() {
  if (given.empty()) return;
  const ImpulseAnswer by = factors_.answer();
  std::vector<double>& momentum = scratch_;
  momentum.resize(by_impulses.size());
  matrices_.multiply_mass(by_impulses.data(), momentum.data());
  for (std::size_t i = 0; i < momentum.size(); ++i)
    if (model_.held[i]) momentum[i] = 0;
  factors_.solve(momentum.data());
  for (std::size_t i = 0; i < momentum.size(); ++i)
    step_.free[i] += (1 - by.rest) * momentum[i] - by.mass * by_impulses[i];
}

// Velocity jumps [m/s] by contact impulses and prescribed velocities, through the mass alone. Supports carry these
// impulses over the whole step h, not over the scheme's impulse of a force of 1 N.
void MeshJumps::find(const std::vector<double>& end) {
  const std::int64_t n = model_.dofs();
  std::copy(impulse_.begin(), impulse_.end(), all.begin());
  for (std::int64_t i = 0; i < n; ++i)
    if (model_.held[i]) all[i] = end[i] - step_.v[i];
  beyond_scheme.assign(std::size_t(n), 0.0);
  const auto any = [](const auto& of) {
    return std::any_of(of.begin(), of.end(), [](double x) { return x < 0 || x > 0; });
  };
  if (any(all)) equations_.solve_bound_mass(all.data());
  const bool turns = !model_.linear() && model_.ties.rigid_parts_turn();
  if (!turns && !any(all) && !any(impulse_)) return;
  step_.a = all;
  for (std::int64_t i = 0; i < n && turns; ++i)
    step_.a[i] = end[i] - step_.v[i]; // forces alone are kept, no motion of the mass
  matrices_.multiply_mass(step_.a.data(), beyond_scheme.data());
  const double beyond = 1 / step_.scheme.impulse - 1 / step_.scheme.h;
  for (std::int64_t i = 0; i < n; ++i) {
    const bool given = model_.held[i] || (model_.ties.bound(i) && !turns);
    beyond_scheme[i] = given ? beyond * (beyond_scheme[i] - impulse_[i]) : 0;
  }
}

} // namespace cairn
