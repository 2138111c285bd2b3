// Stability limit of central differences on a mesh, h = (2/omega) (sqrt(1 + xi^2) - xi) at the highest frequency omega
// with damping ratio xi. A bound of omega by elements gives a step that is certain to be stable. Beyond it Lanczos'
// method gives a lower bound of omega, and factors of M - h/2 C - h^2/4 K, positive definite for stable h, decide.
// Other explicit integrators are stable for h omega < L and h^2 omega^2/A + h c/d < 1, where c is the drag: see
// drag_bound.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "../base/call.hpp"
#include "../base/small_matrices.hpp"
#include "../base/vectors.hpp"
#include "../bodies/nodes.hpp"
#include "../soe/lapack.hpp"
#include "mesh_rates.hpp"
#include "mesh_stability.hpp"

namespace cairn {

namespace {

constexpr double boundless = std::numeric_limits<double>::infinity();

// Largest eigenvalue of a symmetric tridiagonal matrix; infinity: it was not found.
double largest_eigenvalue(std::vector<double> diagonal, std::vector<double> beside) {
  const int n = int(diagonal.size());
  int info = 0;
  if (n == 0) return 0;
  dsterf_(&n, diagonal.data(), beside.data(), &info);
  return info == 0 ? diagonal.back() : boundless;
}

double step_of(double omega, double xi) { return 2 / omega * (std::sqrt(1 + xi * xi) - xi); }

double step_of(const FrequencyBound& bound, double rate_share) {
  const double rate = rate_share * bound.rate;
  if (!(bound.omega > 0)) return rate > 0 ? 2 / rate : boundless;
  return step_of(bound.omega, rate / (2 * bound.omega));
}

double step_of(const FrequencyBound& bound, const DragBound& drag) {
  const double damped = step_of(bound, drag.rate) / drag.frequency;
  return drag.frequency < 1 ? std::min(damped, step_of(bound, 0.0)) : damped;
}

} // namespace

// By Lanczos' method on M^-1 K with all directions kept orthogonal in M.
double MeshStability::frequency_estimate(double* xi) const {
  constexpr int most = 60;
  const std::int64_t n = model_.dofs();
  const auto inner = [&](const std::vector<double>& x, const std::vector<double>& y) {
    return dot(x.data(), y.data(), n);
  };
  const std::unique_ptr<Soe> soe = Soe::make(model_.mass, model_.options);
  if (const SoeStatus status = soe->factor(model_.mass.value.data()); !status) equations_.refuse(status);
  std::vector<std::vector<double>> q, mq; // directions, and M times them
  std::vector<double> a, b, w(n), y(n);
  std::int64_t free = 0;
  for (std::int64_t i = 0; i < n; ++i) {
    w[i] = model_.held[i] ? 0 : std::cos(double(i));
    free += !model_.held[i];
  }
  while (std::int64_t(q.size()) < std::min<std::int64_t>(most, free)) {
    for (std::size_t k = 0; k < q.size(); ++k) {
      const double share = inner(w, mq[k]);
      for (std::int64_t i = 0; i < n; ++i) w[i] -= share * q[k][i];
    }
    matrices_.multiply(model_.mass, w.data(), y.data());
    const double size = std::sqrt(inner(w, y));
    if (!q.empty()) {
      // the remainder is rounding once the Krylov space is complete
      if (!(size > 64 * std::numeric_limits<double>::epsilon() * *std::max_element(a.begin(), a.end()))) break;
      b.push_back(size);
    } else if (!(size > 0)) {
      break;
    }
    for (std::int64_t i = 0; i < n; ++i) w[i] /= size, y[i] = model_.held[i] ? 0 : y[i] / size;
    q.push_back(w);
    mq.push_back(y);
    matrices_.stiffness_times(q.back().data(), w.data());
    a.push_back(inner(w, q.back()));
    for (std::int64_t i = 0; i < n; ++i)
      if (model_.held[i]) w[i] = 0;
    soe->solve(w.data());
  }
  const double square = largest_eigenvalue(a, b);
  *xi = 0;
  if (!(square > 0)) return 0;
  // The mode itself is not made: the stiffest direction, brought to its frequency, gives a rate that is no less.
  const auto stiffest = std::max_element(a.begin(), a.end()) - a.begin();
  matrices_.damping_times(q[stiffest].data(), y.data());
  if (model_.bulk) {
    SparseMatrix rates = model_.mass;
    rates.value = rate_values(model_);
    for (std::size_t e = 0; e < rates.value.size(); ++e) rates.value[e] -= model_.damping.value[e];
    matrices_.multiply(rates, q[stiffest].data(), w.data());
    for (std::int64_t i = 0; i < n; ++i) y[i] += w[i];
  }
  const double omega = std::sqrt(square);
  *xi = inner(q[stiffest], y) * (square / a[stiffest]) / (2 * omega);
  return omega;
}

bool MeshStability::steady(double h, double rate_share) {
  const std::vector<double> rate = rate_values(model_);
  std::vector<double> value(model_.mass.value.size());
  for (std::size_t e = 0; e < value.size(); ++e)
    value[e] = model_.mass.value[e] - h / 2 * rate_share * rate[e] - h * h / 4 * model_.stiffness.value[e];
  const std::unique_ptr<Soe> soe = equations_.make_soe();
  if (!equations_.factor(*soe, value.data())) return false;
  return model_.mode_rates.empty() || steady_with_modes(*soe, rate_share * h);
}

// Calls `use` with the stiffness at displacements u in the place of that at rest, of a body whose forces are not
// linear.
template <class Use>
auto MeshStability::with_stiffness_at(const std::vector<double>& u, Use&& use) {
  const bool moved = std::any_of(u.begin(), u.end(), [](double x) { return x < 0 || x > 0; });
  if (model_.linear() || !moved || !model_.bulk->known_anywhere()) return use();
  std::vector<double> value(model_.stiffness.value.size(), 0.0), still(u.size(), 0.0), force(u.size());
  const MeshMotion there{u.data(), still.data(), loads_.time, boundless, 1, 0, nullptr, loads_.time};
  const std::shared_ptr<InternalForces> apart = model_.bulk->another(); // views show stresses of the model at hand
  apart->fit(model_.mass);
  apart->take_history(model_.bulk->history());
  apart->swelling = model_.bulk->swelling;
  if (!apart->evaluate(there, force.data(), value.data()).ok()) return use();
  struct Back {
    MeshStability& of;
    std::vector<double>& rest;
    ~Back() {
      of.model_.stiffness.value.swap(rest);
      of.seen_at_ = nullptr;
    }
  } back{*this, value};
  model_.stiffness.value.swap(value);
  seen_at_ = u.data();
  return use();
}

double MeshStability::stable_step(double rate_share, const Field<double>& position) {
  std::vector<double> u(std::size_t(model_.dofs()));
  step_.gather(position, u.data());
  for (std::size_t i = 0; i < u.size(); ++i) u[i] -= model_.reference[i];
  return with_stiffness_at(u, [&] { return stable_step_there(rate_share); });
}

void MeshStability::check_if_asked(const cairn_scheme& scheme) {
  const double asked = scheme.h / scheme.largest;
  if (!std::isfinite(scheme.largest) || !(checked_ < asked || checked_ > asked)) return;
  check_step(scheme);
  checked_ = asked;
}

void MeshStability::check_step(const cairn_scheme& scheme) {
  with_stiffness_at(step_.q, [&] { check_step_there(scheme); });
}

// Checks the stable step anew where a body stiffens or its cells grow thin. With dF the change of internal forces along
// the displacement dq of a step, dF.M^-1 dF/(dq.dF) is at most the square of the highest frequency of the mean tangent,
// and near it once that mode moves nodes by a hundredth of the other motion. Above the limit the step is always
// checked, at the present stiffness; below, where the quotient grew or the last check is long ago.
void MeshStability::watch(const std::vector<double>& force_begin, const std::vector<double>& force_end,
                          const std::vector<double>& way) {
  if (!step_.is_explicit() || !std::isfinite(step_.scheme.largest) || !model_.bulk->known_anywhere()) return;
  constexpr std::int64_t seldom = 256;
  constexpr double grown = 1.05, rounding = 256 * std::numeric_limits<double>::epsilon();
  double square = 0, work_of_change = 0, greatest = 0;
  for (const double force : force_end) greatest = std::max(greatest, std::abs(force));
  for (std::size_t i = 0; i < matrices_.lumped.size(); ++i) {
    const double change = force_end[i] - force_begin[i];
    if (!(std::abs(change) > rounding * greatest)) continue;
    if (!model_.held[i] && matrices_.lumped[i] > 0) square += change * change / matrices_.lumped[i];
    work_of_change += change * way[i];
  }
  ++since_judged_;
  const double limit = step_.scheme.largest / step_.h(),
               share = (work_of_change > 0 ? square / work_of_change : 0) / limit / limit;
  const double worth = matrices_.lumped_mass ? 0.1 : 0.03; // a mass that is shared makes the highest frequencies higher
  if (!(share > worth) || (share <= 1 && share <= grown * judged_ && since_judged_ < seldom)) return;
  judged_ = share;
  since_judged_ = 0;
  checked_ = 0;
}

double MeshStability::stable_step_there(double rate_share) {
  if (const FrequencyBound bound = frequency_bound(true); bound.known()) return step_of(bound, rate_share);
  double xi = 0;
  const double omega = frequency_estimate(&xi);
  if (!(omega > 0)) return boundless;
  double h = step_of(omega, rate_share * xi);
  constexpr int passes = 20;
  double share = 1e-3; // by which the estimate may be too long
  for (int pass = 0; pass < passes && !model_.make_solver; ++pass, share = std::min(2 * share, 0.5)) {
    h *= 1 - share;
    if (steady(h, rate_share)) break;
  }
  return h;
}

void MeshStability::check_step_there(const cairn_scheme& scheme) {
  constexpr double rounding = 1 + 0x1p-40;
  const double h = scheme.h * 2 / scheme.largest; // of central differences
  const DragBound drag = drag_bound(scheme);
  const auto allows = [&](const FrequencyBound& bound, double more) {
    return bound.known() && h <= step_of(bound, drag) * more;
  };
  if (allows(frequency_bound(false), 1)) return; // elements cost more
  const FrequencyBound bound = frequency_bound(true);
  if (allows(bound, 1) || (allows(bound, quick) && allows(frequency_bound(true, 1), rounding))) return;
  double xi = 0;
  const double omega = frequency_estimate(&xi), limit = step_of(FrequencyBound{omega, 2 * omega * xi}, drag);
  constexpr double known = 1 + 1e-3; // as well as the frequency is
  // operators have no factors; a step too long without damping is too long with it
  if (model_.make_solver ? h <= limit * known
                         : !(omega * h > 2 * known) && steady(drag.frequency * h, drag.rate) &&
                               (!(drag.frequency < 1) || steady(h, 0)))
    return;
  char text[400];
  std::snprintf(
      text, sizeof text,
      "dt is %g s, beyond the stable step %.3g s of the mesh '%s'%s under this explicit integrator: give a smaller "
      "dt, larger or softer cells, or an implicit integrator, which has no such limit (Carpenter takes "
      "unstable='ignore')",
      scheme.h, scheme.largest / 2 * std::min(limit, h), model_.name.c_str(), seen_at_ ? " as it is strained now" : "");
  throw StepTooLong(text);
}

// True if A less h/2 U D U' is positive definite, given that A is.
bool MeshStability::steady_with_modes(const Soe& soe, double h) const {
  const auto n = std::size_t(model_.dofs());
  const std::size_t modes = model_.mode_rates.size();
  std::vector<double> small(modes * modes, 0.0), z(n);
  for (std::size_t k = 0; k < modes; ++k) {
    std::copy_n(&matrices_.modal_momentum[n * k], n, z.begin());
    model_.ties.empty() ? soe.solve(z.data()) : model_.ties.solve(soe, z.data());
    for (std::size_t l = 0; l < modes; ++l)
      small[k * modes + l] = -h / 2 * std::sqrt(model_.mode_rates[k] * model_.mode_rates[l]) *
                             dot(&matrices_.modal_momentum[n * l], z.data(), std::int64_t(n));
    small[k * modes + k] += 1;
  }
  return factor_symmetric(modes, small.data(), 0);
}

} // namespace cairn
