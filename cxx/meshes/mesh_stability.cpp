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
#include "../bodies/nodes.hpp"
#include "../soe/lapack.hpp"
#include "mesh_body.hpp"
#include "mesh_rates.hpp"

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
double MeshBody::frequency_estimate(double* xi) const {
  constexpr int most = 60;
  const std::int64_t n = model.dofs();
  const auto inner = [&](const double* x, const double* y) {
    double sum = 0;
    for (std::int64_t i = 0; i < n; ++i) sum += x[i] * y[i];
    return sum;
  };
  const std::unique_ptr<Soe> soe = Soe::make(model.mass, model.options);
  if (const SoeStatus status = soe->factor(model.mass.value.data()); !status) refuse(status);
  std::vector<std::vector<double>> q, mq; // directions, and M times them
  std::vector<double> a, b, w(n), y(n);
  std::int64_t free = 0;
  for (std::int64_t i = 0; i < n; ++i) {
    w[i] = model.held[i] ? 0 : std::cos(double(i));
    free += !model.held[i];
  }
  while (std::int64_t(q.size()) < std::min<std::int64_t>(most, free)) {
    for (std::size_t k = 0; k < q.size(); ++k) {
      const double share = inner(w.data(), mq[k].data());
      for (std::int64_t i = 0; i < n; ++i) w[i] -= share * q[k][i];
    }
    multiply(model.mass, w.data(), y.data());
    const double size = std::sqrt(inner(w.data(), y.data()));
    if (!q.empty()) {
      // the remainder is rounding once the Krylov space is complete
      if (!(size > 64 * std::numeric_limits<double>::epsilon() * *std::max_element(a.begin(), a.end()))) break;
      b.push_back(size);
    } else if (!(size > 0)) {
      break;
    }
    for (std::int64_t i = 0; i < n; ++i) w[i] /= size, y[i] = model.held[i] ? 0 : y[i] / size;
    q.push_back(w);
    mq.push_back(y);
    stiffness_times(q.back().data(), w.data());
    a.push_back(inner(w.data(), q.back().data()));
    for (std::int64_t i = 0; i < n; ++i)
      if (model.held[i]) w[i] = 0;
    soe->solve(w.data());
  }
  const double square = largest_eigenvalue(a, b);
  *xi = 0;
  if (!(square > 0)) return 0;
  // The mode itself is not made: the stiffest direction, brought to its frequency, gives a rate that is no less.
  const auto stiffest = std::max_element(a.begin(), a.end()) - a.begin();
  damping_times(q[stiffest].data(), y.data());
  if (model.bulk) {
    SparseMatrix rates = model.mass;
    rates.value = rate_values(model);
    for (std::size_t e = 0; e < rates.value.size(); ++e) rates.value[e] -= model.damping.value[e];
    multiply(rates, q[stiffest].data(), w.data());
    for (std::int64_t i = 0; i < n; ++i) y[i] += w[i];
  }
  const double omega = std::sqrt(square);
  *xi = inner(q[stiffest].data(), y.data()) * (square / a[stiffest]) / (2 * omega);
  return omega;
}

bool MeshBody::steady(double h, double rate_share) {
  const std::vector<double> rate = rate_values(model);
  std::vector<double> value(model.mass.value.size());
  for (std::size_t e = 0; e < value.size(); ++e)
    value[e] = model.mass.value[e] - h / 2 * rate_share * rate[e] - h * h / 4 * model.stiffness.value[e];
  const std::unique_ptr<Soe> soe = make_soe();
  if (!factor(*soe, value.data())) return false;
  return model.mode_rates.empty() || steady_with_modes(*soe, rate_share * h);
}

// Calls `use` with the stiffness at displacements u in the place of that at rest, of a body whose forces are not
// linear.
template <class Use>
auto MeshBody::with_stiffness_at(const std::vector<double>& u, Use&& use) {
  const bool moved = std::any_of(u.begin(), u.end(), [](double x) { return x < 0 || x > 0; });
  if (linear() || !moved || !model.bulk->known_anywhere()) return use();
  std::vector<double> value(model.stiffness.value.size(), 0.0), still(u.size(), 0.0), force(u.size());
  const MeshMotion there{u.data(), still.data(), time, boundless, 1, 0, nullptr, time};
  const std::shared_ptr<InternalForces> apart = model.bulk->another(); // views show stresses of the model at hand
  apart->fit(model.mass);
  apart->take_history(model.bulk->history());
  apart->swelling = model.bulk->swelling;
  if (!apart->evaluate(there, force.data(), value.data()).ok()) return use();
  struct Back {
    MeshBody& of;
    std::vector<double>& rest;
    ~Back() {
      of.model.stiffness.value.swap(rest);
      of.seen_at_ = nullptr;
    }
  } back{*this, value};
  model.stiffness.value.swap(value);
  seen_at_ = u.data();
  return use();
}

double MeshBody::stable_step(double rate_share, const Nodes& nodes) {
  std::vector<double> u(std::size_t(model.dofs()));
  gather(nodes.position, u.data());
  for (std::size_t i = 0; i < u.size(); ++i) u[i] -= model.reference[i];
  return with_stiffness_at(u, [&] { return stable_step_there(rate_share); });
}

void MeshBody::check_step(const cairn_scheme& scheme) {
  with_stiffness_at(q_, [&] { check_step_there(scheme); });
}

// Checks the stable step anew where a body stiffens or its cells grow thin. With dF the change of internal forces along
// the displacement dq of a step, dF.M^-1 dF/(dq.dF) is at most the square of the highest frequency of the mean tangent,
// and near it once that mode moves nodes by a hundredth of the other motion. Above the limit the step is always
// checked, at the present stiffness; below, where the quotient grew or the last check is long ago.
void MeshBody::watch_stability() {
  if (!explicit_ || !std::isfinite(scheme_.largest) || !model.bulk->known_anywhere()) return;
  constexpr std::int64_t seldom = 256;
  constexpr double grown = 1.05, rounding = 256 * std::numeric_limits<double>::epsilon();
  double square = 0, work_of_change = 0, greatest = 0;
  for (const double force : force_end_) greatest = std::max(greatest, std::abs(force));
  for (std::size_t i = 0; i < lumped_.size(); ++i) {
    const double change = force_end_[i] - force_begin_[i];
    if (!(std::abs(change) > rounding * greatest)) continue;
    if (!model.held[i] && lumped_[i] > 0) square += change * change / lumped_[i];
    work_of_change += change * way_of(i, trial_[i]);
  }
  ++since_judged_;
  const double limit = scheme_.largest / h_, share = (work_of_change > 0 ? square / work_of_change : 0) / limit / limit;
  const double worth = lumped_mass_ ? 0.1 : 0.03; // a mass that is shared makes the highest frequencies higher
  if (!(share > worth) || (share <= 1 && share <= grown * judged_ && since_judged_ < seldom)) return;
  judged_ = share;
  since_judged_ = 0;
  checked_ = 0;
}

double MeshBody::stable_step_there(double rate_share) {
  if (const FrequencyBound bound = frequency_bound(true); bound.known()) return step_of(bound, rate_share);
  double xi = 0;
  const double omega = frequency_estimate(&xi);
  if (!(omega > 0)) return boundless;
  double h = step_of(omega, rate_share * xi);
  constexpr int passes = 20;
  double share = 1e-3; // by which the estimate may be too long
  for (int pass = 0; pass < passes && !model.make_solver; ++pass, share = std::min(2 * share, 0.5)) {
    h *= 1 - share;
    if (steady(h, rate_share)) break;
  }
  return h;
}

void MeshBody::check_step_there(const cairn_scheme& scheme) {
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
  if (model.make_solver ? h <= limit * known
                        : !(omega * h > 2 * known) && steady(drag.frequency * h, drag.rate) &&
                              (!(drag.frequency < 1) || steady(h, 0)))
    return;
  char text[400];
  std::snprintf(
      text, sizeof text,
      "dt is %g s, beyond the stable step %.3g s of the mesh '%s'%s under this explicit integrator: give a smaller "
      "dt, larger or softer cells, or an implicit integrator, which has no such limit (Carpenter takes "
      "unstable='ignore')",
      scheme.h, scheme.largest / 2 * std::min(limit, h), model.name.c_str(), seen_at_ ? " as it is strained now" : "");
  throw StepTooLong(text);
}

} // namespace cairn
