#include "scaled_problem.hpp"

#include <cmath>

namespace cairn {

ScaledProblem::ScaledProblem(const FrictionProblem& p, const ProblemOptions& options, double* r)
    : given_(p), options_(options), tolerance_(options.tolerance), r_(r), scaled_(p), scale_(p.contacts),
      best_(p.unknowns()) {
  options_.tolerance *= 1 - 1e-6; // the last rounding goes to the safe side
  const int d = p.dim;
  std::vector<int> exponent(p.contacts);
  for (std::int64_t a = 0; a < p.contacts; ++a)
    for (std::int64_t k = p.row_start[a]; k < p.row_start[a + 1]; ++k) {
      if (p.column[k] != a) continue;
      double mean = 0;
      for (int i = 0; i < d; ++i) mean += p.block[d * d * k + (d + 1) * i] / d;
      std::frexp(mean > 0 ? mean : p.block[d * d * k], &exponent[a]);
    }
  // relative to the first contact: a change of units by a power of two leaves every bit
  const int first = exponent.empty() ? 0 : exponent[0];
  const double all = std::ldexp(1.0, -first);
  for (std::int64_t a = 0; a < p.contacts; ++a) scale_[a] = std::ldexp(1.0, -((exponent[a] - first) >> 1));
  for (std::int64_t a = 0; a < p.contacts; ++a) {
    for (std::int64_t k = p.row_start[a]; k < p.row_start[a + 1]; ++k) {
      const double s = scale_[a] * scale_[p.column[k]] * all;
      for (int i = 0; i < d * d; ++i) scaled_.block[d * d * k + i] *= s;
    }
    for (int i = 0; i < d; ++i) scaled_.q[d * a + i] *= scale_[a];
  }
  if (p.bodies) {
    scaled_.bodies = std::make_shared<ContactBodies>(*p.bodies);
    ContactBodies& b = *scaled_.bodies;
    const std::size_t rows = std::size_t(2 * d * b.dofs);
    for (std::size_t k = 0; k < b.rows.size(); ++k) b.rows[k] *= scale_[k / rows];
    for (double& x : b.inverse) x *= all;
    for (double& x : b.mass) x /= all;
  }
  unit_ = scale_;
  for (std::int64_t a = 0; a < p.contacts; ++a) {
    scale_[a] *= all; // from here on that of impulses
    for (int i = 0; i < d; ++i) best_[d * a + i] = options.warm_start ? r[d * a + i] / scale_[a] : 0;
  }
  monitor_.emplace(scaled_, options_, best_.data());
}

void ScaledProblem::sweep(double* r, int sweeps) {
  if (!sweeper_) sweeper_.emplace(scaled_);
  for (int s = 0; s < sweeps; ++s) sweeper_->sweep(r);
}

ProblemReport ScaledProblem::finish(const std::string& solver, std::int64_t iterations) {
  const ProblemReport inner = monitor_->finish(solver, iterations);
  for (std::int64_t a = 0; a < given_.contacts; ++a)
    for (int i = 0; i < given_.dim; ++i) r_[given_.dim * a + i] = best_[given_.dim * a + i] * scale_[a];
  ProblemOptions options = options_; // those of the problem as it was given; the solve may go on with its own
  options.tolerance = tolerance_;
  options.warm_start = true;
  ProblemMonitor outer(given_, options, r_);
  outer.error_of(r_);
  ProblemReport report = outer.finish(solver, iterations);
  if (report.status != ProblemStatus::converged && inner.status != ProblemStatus::converged) {
    report.status = inner.status;
    report.hint = inner.hint;
  } else if (report.status != ProblemStatus::converged) {
    report.status = ProblemStatus::stalled;
    report.hint += "it was met by the scaled problem alone: what is left is rounding, allow a larger tol";
  }
  return report;
}

} // namespace cairn
