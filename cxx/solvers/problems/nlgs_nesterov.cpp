// Sweeps over the blocks of W, extrapolated.
#include "../sweeps/nesterov_sequence.hpp"
#include "cairn/core.h"
#include "nlgs_problem.hpp"

namespace cairn {

ProblemReport solve_nlgs_nesterov(const FrictionProblem& p, const ProblemOptions& options, double* best) {
  ProblemMonitor monitor(p, options, best);
  Sweeper sweeper(p);
  NesterovSequence sequence;
  Array<double> r(best, best + p.unknowns()), before(p.unknowns()), start(p.unknowns());
  std::int64_t iterations = 0, next_check = 1;
  double ratio = 0; // of the squared error to the change of a sweep: both fall together
  monitor.start_error();
  while (!monitor.ended(iterations)) {
    constexpr int plain_sweeps = 9; // few contacts are solved by as many
    cairn_nesterov_lean(p.unknowns(), iterations < plain_sweeps ? 0 : sequence.factor(), before.data(), r.data(),
                        start.data());
    const double change = sweeper.sweep(r.data(), options.relaxation);
    double along = 0;
    cairn_nesterov_along(p.dim, p.contacts, monitor.w_nn().data(), start.data(), before.data(), r.data(), &along);
    if (iterations >= plain_sweeps) sequence.follow(change, along);
    ++iterations;
    const double wanted = options.tolerance * options.tolerance * monitor.scale();
    const bool promising = ratio > 0 && change * ratio <= wanted;
    if (!promising && iterations < next_check && iterations < options.max_iterations && std::isfinite(change)) continue;
    const double error = monitor.error_of(r.data());
    ratio = change > 0 ? error * error * monitor.scale() / change : 0;
    next_check = iterations + std::max<std::int64_t>(2, iterations / 8);
    if (change == 0 && error > options.tolerance)
      monitor.give_up(ProblemStatus::stalled, "a sweep changes nothing any more: only rounding is left");
  }
  return monitor.finish("nlgs_nesterov", iterations);
}

} // namespace cairn
