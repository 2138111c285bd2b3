// The limit of central differences on a mesh.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "../base/call.hpp"
#include "mesh_body.hpp"

namespace cairn {

namespace {

// Largest eigenvalue of a symmetric tridiagonal matrix without negative ones, by bisection on Sturm's counts.
double largest_eigenvalue(const std::vector<double>& a, const std::vector<double>& b) {
  double high = 0, low = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    high = std::max(high, a[i] + (i > 0 ? std::abs(b[i - 1]) : 0) + (i + 1 < a.size() ? std::abs(b[i]) : 0));
  constexpr int halvings = 60;
  for (int pass = 0; pass < halvings; ++pass) {
    const double middle = 0.5 * (low + high);
    bool above = false; // one of them is
    double pivot = 1;
    for (std::size_t i = 0; i < a.size(); ++i) {
      pivot = a[i] - middle - (i > 0 ? b[i - 1] * b[i - 1] / pivot : 0);
      above = above || pivot > 0;
      if (!(std::abs(pivot) > 0)) pivot = -std::numeric_limits<double>::min();
    }
    (above ? low : high) = middle;
  }
  return high;
}

} // namespace

// h = (2/omega) (sqrt(1 + xi^2) - xi) at the highest frequency omega, damped by xi, found by Lanczos' method on M^-1 K
// with all directions kept orthogonal in M.
double MeshBody::stable_step() const {
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
  const double square = largest_eigenvalue(a, b), infinity = std::numeric_limits<double>::infinity();
  if (!(square > 0)) return infinity;
  // The mode itself is not made: the stiffest direction, brought to its frequency, gives a rate that is no less.
  const auto stiffest = std::max_element(a.begin(), a.end()) - a.begin();
  damping_times(q[stiffest].data(), y.data());
  const double omega = std::sqrt(square);
  const double xi = inner(q[stiffest].data(), y.data()) * (square / a[stiffest]) / (2 * omega);
  return 2 / omega * (std::sqrt(1 + xi * xi) - xi);
}

void MeshBody::check_step(const cairn_scheme& scheme) const {
  const double limit = scheme.largest / 2 * stable_step();
  if (scheme.h <= limit * (1 + 1e-3)) return; // as well as the frequency is known
  char text[400];
  std::snprintf(
      text, sizeof text,
      "dt is %g s, beyond the stable step %.3g s of the mesh '%s' under this explicit integrator: give a smaller "
      "dt, larger or softer cells, Carpenter(unstable='ignore'), or an implicit integrator, which has no such limit",
      scheme.h, limit, model.name.c_str());
  throw StepTooLong(text);
}

} // namespace cairn
