// Chooses by what it measures: sweeps with memory first, which solve most problems in some tens of sweeps and give
// every other method its start; proximal point around Newton's method where the errors foretell a long way; back to
// sweeps where Newton's method fails. Each begins from the best impulses seen.
#include <algorithm>
#include <cmath>

#include "../sweeps/error_forecast.hpp"
#include "block_factors.hpp"
#include "nlgs_anderson.hpp"

namespace cairn {

ProblemSolver solve_ppa_newton;

namespace {

// False: its factors have no room.
bool solve_by_newton(const FrictionProblem& p, const ProblemOptions& options, double* r, ProblemReport& report) {
  try {
    report = solve_ppa_newton(p, options, r);
    return true;
  } catch (const FactorsTooLarge&) { return false; }
}

} // namespace

ProblemReport solve_auto(const FrictionProblem& p, const ProblemOptions& options, double* r) {
  // Newton's method takes as long as so many sweeps for each neighbour of a contact (measured)
  constexpr std::int64_t least_sweeps = 16;
  constexpr int first_turn = 200; // iterations: with fewer piles of cubes were begun twice
  const double far = (p.dim == 2 ? 40 : 10) * double(p.column.size()) / double(p.contacts);
  ProblemOptions inner = options;
  bool stopped = false;
  if (options.interrupted) inner.interrupted = [&] { return stopped = stopped || options.interrupted(); };
  ProblemMonitor monitor(p, inner, r);
  monitor.start_error();
  std::string last = "nlgs_anderson";
  std::int64_t iterations = 0, patience = least_sweeps;
  int newton_iterations = first_turn;
  bool has_newton = has_factorisations();
  Array<double> start(p.unknowns());
  while (!monitor.ended(iterations)) {
    last = "nlgs_anderson";
    start.assign(r, r + p.unknowns());
    ErrorForecast forecast(options.tolerance);
    const std::int64_t begin = iterations;
    iterations = sweep_with_memory(p, inner, monitor, start.data(), iterations, [&](std::int64_t i, double error) {
      const double to_come = forecast.sweeps_to_come(i - begin, error);
      return has_newton && i - begin >= patience && to_come > far;
    });
    if (monitor.ended(iterations) || !has_newton) break;
    patience *= 8;
    ProblemOptions newton = inner;
    newton.max_iterations = int(std::min<std::int64_t>(newton_iterations, options.max_iterations - iterations));
    newton.max_seconds = options.max_seconds - monitor.seconds();
    // what sweeps found is worth a start from it where they came half the way, in digits
    newton.warm_start =
        options.warm_start || newton_iterations > first_turn || monitor.best_error() < std::sqrt(options.tolerance);
    newton_iterations *= 4;
    start.assign(r, r + p.unknowns());
    ProblemReport report;
    has_newton = solve_by_newton(p, newton, start.data(), report);
    if (!has_newton) continue;
    last = report.solver;
    iterations += report.iterations;
    monitor.error_of(start.data());
  }
  if (has_newton && monitor.best_error() <= options.tolerance &&
      monitor.best_power_error() > std::sqrt(options.tolerance)) {
    ProblemOptions newton = inner;
    newton.warm_start = true;
    newton.max_seconds = options.max_seconds - monitor.seconds();
    start.assign(r, r + p.unknowns());
    ProblemReport report;
    if (solve_by_newton(p, newton, start.data(), report)) {
      iterations += report.iterations;
      monitor.hold(true);
      monitor.error_of(start.data());
      monitor.hold(false);
      last = report.solver;
    }
  }
  return monitor.finish(last, iterations);
}

} // namespace cairn
