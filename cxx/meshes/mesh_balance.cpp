#include "mesh_balance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cairn {

namespace {

// |a| |x| times a factor, to out; a by the values of its lower triangle.
void add_sizes(const SparseMatrix& pattern, const std::vector<double>& value, double factor, const double* x,
               double* out) {
  for (std::int64_t column = 0; column < pattern.n; ++column)
    for (std::int64_t e = pattern.start[column]; e < pattern.start[column + 1]; ++e) {
      const std::int32_t row = pattern.row[e];
      const double size = factor * std::abs(value[std::size_t(e)]);
      out[row] += size * std::abs(x[column]);
      if (row != column) out[column] += size * std::abs(x[row]);
    }
}

} // namespace

void MeshBalance::start() {
  const auto n = std::size_t(model_.dofs());
  damping.resize(n);
  residual.resize(n);
  norms.resize(8 * n);
}

// Velocities that damping takes its forces of, at velocities v at the end of the step, into step.a.
void MeshBalance::damped_velocity(const std::vector<double>& v) {
  const double late = step_.scheme.implicit;
  for (std::size_t i = 0; i < v.size(); ++i) step_.a[i] = late * v[i] + (1 - late) * step_.v[i];
  for (std::size_t i = 0; i < history_.damped_past.size(); ++i)
    step_.a[i] += history_.damped_past[i] - jumps_.undamped(i);
}

// Residual of the balance at velocities v without contact impulses [N s], from the stresses at hand.
void MeshBalance::find_residual(const std::vector<double>& v) {
  const std::int64_t n = model_.dofs();
  for (std::int64_t i = 0; i < n; ++i) step_.a[i] = v[i] - step_.v[i];
  const bool turns = model_.ties.rigid_parts_turn();
  for (std::size_t i = 0; i < history_.kicked_past.size() && !turns; ++i) step_.a[i] -= history_.kicked_past[i];
  matrices_.multiply_mass(step_.a.data(), step_.b.data());
  for (std::size_t i = 0; i < history_.kicked_past.size() && turns; ++i)
    step_.b[i] -= matrices_.force_weight(std::int64_t(i)) * history_.kicked_past[i];
  damped_velocity(v);
  if (matrices_.damps) matrices_.damping_times(step_.a.data(), damping.data());
  for (std::int64_t i = 0; i < n; ++i) {
    const double load = loads_.pressed.empty() ? step_.f[i] : step_.f[i] + stresses_.press[i];
    residual[i] = model_.held[i]
                      ? 0
                      : step_.scheme.impulse * (load - damping[i] - stresses_.force_of(std::size_t(i))) - step_.b[i];
  }
}

// Square of the forces at held dofs, by the inverse of the diagonal of A: scale of the balance where a body is
// stretched between supports, so that forces of its cells cancel at every free node to rounding. The diagonal is finite
// at held dofs too, and its norm is at most a few times that by the inverse of A.
double MeshBalance::borne_by_held() const {
  double out = 0;
  for (std::size_t i = 0; i < model_.held.size(); ++i) {
    if (!model_.held[i]) continue;
    const double force = step_.scheme.impulse * (damping[i] + stresses_.force_of(i)),
                 weight = matrices_.on_diagonal(factors_.now->value, std::int64_t(i));
    if (weight > 0) out += force * force / weight; // softening may leave none there
  }
  return out;
}

// Rounding error of the residual at the iterate, by the inverse of A: rounding of velocities and of displacements,
// which for a body moving as a whole is all of its internal forces.
double MeshBalance::rounding() {
  const auto n = std::size_t(model_.dofs());
  double *x = norms.data(), *size = x + n, *right = size + n;
  std::fill_n(size, n, 0.0);
  for (std::size_t i = 0; i < n; ++i) x[i] = std::abs(step_.iterate[i]) + std::abs(step_.v[i]);
  add_sizes(model_.mass, factors_.now->value, 1, x, size);
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = step_.q[i] + step_.h() * (step_.share() * step_.iterate[i] + (1 - step_.share()) * step_.v[i]);
    if (!history_.past.empty()) x[i] += history_.past[i];
  }
  const std::vector<double>& stiffness = stresses_.tangent.empty() ? model_.stiffness.value : stresses_.tangent;
  add_sizes(model_.mass, stiffness, step_.scheme.impulse, x, size);
  for (std::size_t i = 0; i < n; ++i) right[i] = size[i] = model_.held[i] ? 0 : size[i];
  factors_.solve(size);
  double square = 0;
  for (std::size_t i = 0; i < n; ++i) square += size[i] * right[i];
  return std::numeric_limits<double>::epsilon() * std::sqrt(std::max(square, 0.0));
}

// Residual of the balance at the iterate by the inverse of A, the scale of its terms, to which errors are relative, and
// `node` with the largest residual.
double MeshBalance::measure(double& scale, std::int64_t& node) {
  const auto n = std::size_t(model_.dofs());
  const bool swells = !stresses_.swelling_force.empty();
  const std::size_t terms = swells ? 4 : 3;
  for (std::size_t i = 0; i < n; ++i) {
    const bool held = model_.held[i];
    norms[i] = held ? 0 : residual[i] + impulse_[i];
    norms[n + i] = held ? 0 : step_.b[i];
    norms[2 * n + i] = held ? 0 : step_.scheme.impulse * (damping[i] + stresses_.force_of(i));
    if (swells) norms[3 * n + i] = held ? 0 : step_.scheme.impulse * stresses_.swelling_force[i];
  }
  std::copy_n(norms.begin(), terms * n, norms.begin() + std::ptrdiff_t(terms * n));
  factors_.solve(norms.data(), std::int64_t(terms));
  double size[4] = {0, 0, 0, 0}, worst = 0;
  for (std::size_t k = 0; k < terms; ++k) {
    for (std::size_t i = 0; i < n; ++i) size[k] += norms[k * n + i] * norms[(terms + k) * n + i];
    size[k] = std::sqrt(std::max(size[k], 0.0));
  }
  for (std::size_t i = 0; i < n; ++i)
    if (const double w = norms[i] * norms[terms * n + i]; w > worst) worst = w, node = std::int64_t(i) / model_.dim;
  scale = std::max(size[1] + size[2] + size[3], std::sqrt(borne_by_held()));
  return size[0];
}

} // namespace cairn
