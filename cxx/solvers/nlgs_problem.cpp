// Block nonlinear Gauss-Seidel over the blocks of W.
#include <algorithm>
#include <numeric>

#include "cairn/core.h"
#include "nlgs_problem.hpp"

namespace cairn {

ProblemReport sweep_problem(const FrictionProblem& p, const ProblemOptions& options, double* best,
                            const std::string& name, SweepOrder order, const NextOrder& next) {
  ProblemMonitor monitor(p, options, best);
  Array<double> r(best, best + p.unknowns()), change(p.contacts);
  std::int64_t iterations = 0, next_check = 1;
  double ratio = 0; // of the squared error to the change of a sweep: both fall together
  monitor.error_of(r.data());
  while (!monitor.ended(iterations)) {
    if (next && iterations > 0) next(order.contact);
    for (std::size_t c = 0; c + 1 < order.colour_start.size(); ++c)
      cairn_nlgs_blocks(p.dim, p.contacts, p.row_start.data(), p.column.data(), p.block.data(),
                        monitor.diagonal().data(), p.q.data(), p.mu.data(), order.colour_start[c],
                        order.colour_start[c + 1], order.contact.data(), options.relaxation, r.data(), change.data(),
                        order.threads);
    ++iterations;
    const double sum = std::accumulate(change.begin(), change.end(), 0.0);
    const double wanted = options.tolerance * options.tolerance * monitor.scale();
    const bool promising = ratio > 0 && sum * ratio <= wanted;
    if (!promising && iterations < next_check && iterations < options.max_iterations && sum < 1e300) continue;
    const double error = monitor.error_of(r.data());
    ratio = sum > 0 ? error * error * monitor.scale() / sum : 0;
    next_check = iterations + std::max<std::int64_t>(2, iterations / 4);
    if (sum == 0 && error > options.tolerance)
      monitor.give_up(ProblemStatus::stalled, "a sweep changes nothing any more: only rounding is left");
  }
  return monitor.finish(name, iterations);
}

ProblemReport solve_nlgs(const FrictionProblem& p, const ProblemOptions& options, double* r) {
  SweepOrder order;
  order.contact.resize(p.contacts);
  std::iota(order.contact.begin(), order.contact.end(), 0);
  order.colour_start = {0, p.contacts};
  return sweep_problem(p, options, r, "nlgs", std::move(order), {});
}

} // namespace cairn
