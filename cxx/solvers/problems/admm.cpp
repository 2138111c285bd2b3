// Alternating direction method of multipliers: one factorisation of W + rho serves many iterations; rho follows the
// balance of the two residuals, and each change of it costs a factorisation.
#include <algorithm>
#include <cmath>

#include "block_factors.hpp"
#include "cairn/core.h"
#include "scaled_problem.hpp"

namespace cairn {

namespace {

// Zero where both are zero, infinite where only the divisor is.
double quotient(double a, double b) { return a > 0 ? a / b : 0; }

struct Multipliers {
  static constexpr double relaxation = 1.6;
  const FrictionProblem& p;
  BlockFactors factors;
  Array<double> matrix, r, u, z, v, s, mu;
  std::vector<std::int32_t> active;
  double rho = 0;
  double sums[4] = {};

  Multipliers(const FrictionProblem& problem, double max_bytes)
      : p(problem), factors(p.dim, p.row_start, p.column, max_bytes), matrix(p.block.size()), r(p.unknowns()),
        u(p.unknowns()), z(p.unknowns()), v(p.unknowns()), s(p.contacts), mu(p.mu), active(p.contacts, 1) {
    for (double& m : mu)
      m = std::min(m, 1e3); // an angle of friction of 89.94 degrees: beyond it the cone has no width to project on
  }

  // Multipliers of impulses that nearly solve.
  void begin(const Array<double>& start, const std::vector<std::int64_t>& diagonal) {
    z = start;
    product(p, z.data(), u.data(), 1);
    for (std::int64_t a = 0; a < p.contacts; ++a) {
      double square = 0;
      for (int i = 1; i < p.dim; ++i) square += u[p.dim * a + i] * u[p.dim * a + i];
      s[a] = mu[a] * std::sqrt(square);
      for (int i = 0; i < p.dim; ++i) v[p.dim * a + i] = -(u[p.dim * a + i] + (i == 0 ? s[a] : 0));
    }
    rho = 1;
    set_rho(0.07, diagonal);
  }

  bool set_rho(double next, const std::vector<std::int64_t>& diagonal) {
    for (double& x : v) x *= rho / next;
    rho = next;
    matrix = p.block;
    for (const std::int64_t k : diagonal)
      for (int i = 0; i < p.dim; ++i) matrix[p.dim * p.dim * k + (p.dim + 1) * i] += rho;
    return factors.factor(matrix.data(), active.data());
  }

  void iterate() {
    cairn_admm_load(p.dim, p.contacts, rho, p.q.data(), z.data(), v.data(), s.data(), r.data());
    factors.solve(r.data());
    cairn_admm_update(p.dim, p.contacts, rho, relaxation, mu.data(), r.data(), z.data(), v.data(), s.data(), sums);
  }
};

} // namespace

ProblemReport solve_admm(const FrictionProblem& given, const ProblemOptions& options, double* best) {
  need_factorisations("admm");
  ScaledProblem scaled(given, options, best);
  ProblemMonitor& monitor = scaled.monitor();
  Multipliers m(scaled.problem(), options.max_bytes);
  Array<double> start(scaled.best(), scaled.best() + given.unknowns());
  monitor.error_of(start.data());
  std::int64_t iterations = 0, changed = 0, wait = 10, next_check = 1;
  if (!monitor.ended(0)) {
    scaled.sweep(start.data(), 5);
    monitor.error_of(start.data());
    m.begin(start, monitor.diagonal());
  }
  double speed = 0;
  for (const double x : given.q) speed = std::max(speed, std::abs(x));
  double ratio = 0; // of the true error to the cheap one
  while (!monitor.ended(iterations)) {
    m.iterate();
    ++iterations;
    const double primal = std::sqrt(m.sums[0]), dual = std::sqrt(m.sums[1]);
    const double cheap = quotient(primal + dual, std::sqrt(m.sums[2]));
    const bool promising = ratio > 0 && cheap * ratio <= options.tolerance;
    if (promising || iterations >= next_check || !std::isfinite(cheap)) {
      const double error = monitor.error_of(m.z.data());
      ratio = cheap > 0 ? error / cheap : 0;
      next_check = iterations + std::max<std::int64_t>(4, iterations / 5);
    }
    if (iterations - changed < wait) continue;
    const double r_relative = quotient(primal, std::sqrt(m.sums[2]));
    const double u_relative = quotient(dual, std::sqrt(m.sums[3]));
    const double factor = std::clamp(std::sqrt(quotient(r_relative, u_relative)), 0.1, 10.0);
    if (!(factor >= 2 || factor <= 0.5)) continue; // not a number where both are infinite
    if (!m.set_rho(m.rho * factor, monitor.diagonal()))
      monitor.give_up(ProblemStatus::stalled, "W + rho has no factors");
    changed = iterations;
    wait = std::min<std::int64_t>(200, wait + wait / 2);
  }
  return scaled.finish("admm", iterations);
}

} // namespace cairn
