// The limit of central differences on a mesh, h = (2/omega) (sqrt(1 + xi^2) - xi) at the highest frequency omega,
// damped by xi. A bound of omega by elements gives a step that is certain to be stable. Beyond that Lanczos' method
// tells from below what omega is, and factors of M - h/2 C - h^2/4 K, positive definite where h is stable, have the
// last word. Explicit integrators beside central differences are stable for h omega < L and h^2 omega^2/A + h c/d < 1,
// c what opposes velocities: see drag_bound.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "../base/call.hpp"
#include "../soe/lapack.hpp"
#include "mesh_body.hpp"
#include "mesh_rates.hpp"

namespace cairn {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Largest eigenvalue of a symmetric tridiagonal matrix; infinity: it was not found.
double largest_eigenvalue(std::vector<double> diagonal, std::vector<double> beside) {
  const int n = int(diagonal.size());
  int info = 0;
  if (n == 0) return 0;
  dsterf_(&n, diagonal.data(), beside.data(), &info);
  return info == 0 ? diagonal.back() : infinity;
}

double step_of(double omega, double xi) { return 2 / omega * (std::sqrt(1 + xi * xi) - xi); }

double step_of(const FrequencyBound& bound, double rate_share) {
  const double rate = rate_share * bound.rate;
  if (!(bound.omega > 0)) return rate > 0 ? 2 / rate : infinity;
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
      // what is left is rounding when the directions that the first one holds are all there
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

double MeshBody::stable_step(double rate_share) {
  if (const FrequencyBound bound = frequency_bound(true); bound.known()) return step_of(bound, rate_share);
  double xi = 0;
  const double omega = frequency_estimate(&xi);
  if (!(omega > 0)) return infinity;
  double h = step_of(omega, rate_share * xi);
  constexpr int passes = 20;
  double share = 1e-3; // by which the estimate may be too long
  for (int pass = 0; pass < passes && !model.make_solver; ++pass, share = std::min(2 * share, 0.5)) {
    h *= 1 - share;
    if (steady(h, rate_share)) break;
  }
  return h;
}

void MeshBody::check_step(const cairn_scheme& scheme) {
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
  // of operators there are no factors; what is too long without damping is too long with it
  if (model.make_solver ? h <= limit * known
                        : !(omega * h > 2 * known) && steady(drag.frequency * h, drag.rate) &&
                              (!(drag.frequency < 1) || steady(h, 0)))
    return;
  char text[400];
  std::snprintf(
      text, sizeof text,
      "dt is %g s, beyond the stable step %.3g s of the mesh '%s' under this explicit integrator: give a smaller "
      "dt, larger or softer cells, Carpenter(unstable='ignore'), or an implicit integrator, which has no such limit",
      scheme.h, scheme.largest / 2 * std::min(limit, h), model.name.c_str());
  throw StepTooLong(text);
}

} // namespace cairn
