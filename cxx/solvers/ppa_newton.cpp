// Proximal point around Newton's method: W + alpha is regular however many contacts share a body, and alpha falls as
// the solution comes near. The steps of Newton's method are whole: a search along them, on |f|, crawls around the turns
// of the slip directions, where whole steps take a few iterations (measured on the problems of docs/solvers.md: 30 to
// 200 against 10 to 40).
#include <algorithm>
#include <cmath>

#include "cairn/core.h"
#include "newton_step.hpp"
#include "scaled_problem.hpp"

namespace cairn {

namespace {

struct Proximal {
  static constexpr double largest = 10, smallest = 1e-11; // alpha, relative to the mean diagonal of W
  static constexpr int most_steps = 12;
  ScaledProblem& scaled;
  NewtonStep& newton;
  std::int64_t iterations = 0;
  double alpha = 1e-2;
  Array<double> centre, r, u, shifted;

  Proximal(ScaledProblem& s, NewtonStep& step)
      : scaled(s), newton(step), centre(s.problem().unknowns()), r(centre.size()), u(centre.size()),
        shifted(centre.size()) {}

  double error_of(const Array<double>& x) {
    product(scaled.problem(), x.data(), u.data(), 1);
    return scaled.monitor().error_of(x.data(), u.data());
  }

  // Newton's method around the centre. True: |f| fell tenfold. r is what it reached, error its true error.
  bool solve_around(double& error, int& steps) {
    ProblemMonitor& monitor = scaled.monitor();
    r = centre;
    error = error_of(r);
    double first = 0, last[3] = {};
    for (steps = 0;; ++steps) {
      cairn_proximal_velocity(std::int64_t(r.size()), alpha, r.data(), centre.data(), u.data(), shifted.data());
      double merit = 0;
      if (steps == most_steps) {
        merit = newton.merit(r.data(), shifted.data());
        return merit <= 0.01 * first;
      }
      if (!newton.find(r.data(), shifted.data(), alpha, merit)) return false;
      if (steps == 0) first = merit;
      if (steps > 0 && merit <= 0.01 * first) return true;
      if (steps > 6 && merit > first && merit > 0.5 * *std::min_element(last, last + 3)) return false;
      last[steps % 3] = merit;
      const Array<double>& step = newton.step();
      for (std::size_t i = 0; i < r.size(); ++i) r[i] += step[i];
      ++iterations;
      error = error_of(r);
      if (!std::isfinite(error) || monitor.ended(iterations)) return false;
    }
  }

  void run(double error) {
    ProblemMonitor& monitor = scaled.monitor();
    int failures = 0;
    while (!monitor.ended(iterations)) {
      double next = 0;
      int steps = 0;
      const bool solved = solve_around(next, steps);
      if (std::isfinite(next) && (solved || next < error)) centre = r;
      if (solved || next < 0.3 * error) {
        alpha = std::max(smallest, alpha * (steps <= 4 ? 0.1 : steps < 9 ? 0.3 : 1.0));
        failures = 0;
      } else {
        alpha = std::min(largest, 5 * alpha);
        if (++failures > 12) monitor.give_up(ProblemStatus::stalled, "Newton's method does not converge");
      }
      if (std::isfinite(next) && (solved || next < error)) error = next;
    }
  }
};

} // namespace

ProblemReport solve_ppa_newton(const FrictionProblem& p, const ProblemOptions& options, double* r) {
  need_factorisations("ppa_newton");
  ScaledProblem scaled(p, options, r);
  ProblemMonitor& monitor = scaled.monitor();
  NewtonStep newton(scaled.problem(), cairn_newton_alart_curnier, monitor.diagonal());
  Proximal proximal(scaled, newton);
  std::copy_n(scaled.best(), p.unknowns(), proximal.centre.begin());
  double error = monitor.error_of(proximal.centre.data());
  if (!monitor.ended(0)) {
    scaled.sweep(proximal.centre.data(), 20);
    error = monitor.error_of(proximal.centre.data());
  }
  proximal.run(error);
  return scaled.finish("ppa_newton", proximal.iterations);
}

} // namespace cairn
