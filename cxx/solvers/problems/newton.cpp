// Generalised Newton methods on one function each, with a line search on its norm. The least step of a proximal point
// (alpha as small as the residual) keeps singular W solvable.
#include <algorithm>
#include <cmath>

#include "cairn/core.h"
#include "newton_step.hpp"
#include "scaled_problem.hpp"

namespace cairn {

namespace {

ProblemReport solve_newton(const char* name, NewtonFunction* function, const FrictionProblem& p,
                           const ProblemOptions& options, double* given) {
  need_factorisations(name);
  ScaledProblem scaled(p, options, given);
  ProblemMonitor& monitor = scaled.monitor();
  NewtonStep newton(scaled.problem(), function, monitor.diagonal(), options.max_bytes);
  Array<double> r(scaled.best(), scaled.best() + p.unknowns()), u(r.size()), trial(r.size()), trial_u(r.size());
  double error = monitor.error_of(r.data());
  if (!monitor.ended(0)) {
    scaled.sweep(r.data(), 20);
    error = monitor.error_of(r.data());
  }
  std::int64_t iterations = 0;
  int failures = 0;
  while (!monitor.ended(iterations)) {
    product(scaled.problem(), r.data(), u.data(), 1);
    double merit = 0, least = std::numeric_limits<double>::infinity(), best_t = 1;
    const double alpha = std::clamp(1e-3 * error, 1e-12, 1e-2);
    if (!newton.find(r.data(), u.data(), alpha, merit)) {
      monitor.give_up(ProblemStatus::stalled, "the matrix of Newton's method is singular; ppa_newton stands that");
      continue;
    }
    const Array<double> step = newton.step();
    bool accepted = false;
    for (double t = 1; t > 1e-3 && !accepted; t /= 2) {
      for (std::size_t i = 0; i < r.size(); ++i) trial[i] = r[i] + t * step[i];
      product(scaled.problem(), trial.data(), trial_u.data(), 1);
      const double value = newton.merit(trial.data(), trial_u.data());
      if (value < least) {
        least = value;
        best_t = t;
      }
      accepted = value <= (1 - 2e-4 * t) * merit;
    }
    for (std::size_t i = 0; i < r.size(); ++i) r[i] += best_t * step[i];
    failures = accepted ? 0 : failures + 1;
    if (!accepted) scaled.sweep(r.data(), 10);
    if (failures > 20) monitor.give_up(ProblemStatus::stalled, "no step lessens the residual; try ppa_newton");
    error = monitor.error_of(r.data());
    ++iterations;
  }
  return scaled.finish(name, iterations);
}

} // namespace

#define CAIRN_NEWTON(function)                                                                                         \
  ProblemReport solve_newton_##function(const FrictionProblem& p, const ProblemOptions& options, double* r) {          \
    return solve_newton("newton_" #function, cairn_newton_##function, p, options, r);                                  \
  }
CAIRN_NEWTON(alart_curnier)
CAIRN_NEWTON(jean_moreau)
CAIRN_NEWTON(fischer_burmeister)
#undef CAIRN_NEWTON

} // namespace cairn
