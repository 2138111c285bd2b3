#include "nlgs_problem.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "cairn/core.h"

namespace cairn {

Sweeper::Sweeper(const FrictionProblem& p)
    : order(p.contacts), colour_start{0, p.contacts}, problem_(p), column_(p.column.size() - p.contacts),
      beside_((2 * p.dim - 2) * p.dim * column_.size()), local_(cairn_contact_block_size * p.contacts),
      slip_(p.contacts), change_(p.contacts) {
  std::iota(order.begin(), order.end(), 0);
  cairn_nlgs_prepare(p.dim, p.contacts, p.row_start.data(), p.column.data(), p.block.data(), column_.data(),
                     beside_.data(), local_.data());
}

double Sweeper::sweep(double* r, double relaxation) {
  const FrictionProblem& p = problem_;
  for (std::size_t c = 0; c + 1 < colour_start.size(); ++c)
    cairn_nlgs_blocks(p.dim, p.contacts, p.row_start.data(), column_.data(), beside_.data(), local_.data(), p.q.data(),
                      p.mu.data(), colour_start[c], colour_start[c + 1], order.data(), relaxation, slip_.data(), r,
                      change_.data(), threads);
  return std::accumulate(change_.begin(), change_.end(), 0.0);
}

ProblemReport sweep_problem(const FrictionProblem& p, const ProblemOptions& options, double* best,
                            const std::string& name, Sweeper& sweeper, const NextOrder& next) {
  ProblemMonitor monitor(p, options, best);
  Array<double> r(best, best + p.unknowns());
  std::int64_t iterations = 0, next_check = 1;
  double ratio = 0; // of the squared error to the change of a sweep: both fall together
  monitor.start_error();
  while (!monitor.ended(iterations)) {
    if (next) next(sweeper.order);
    const double change = sweeper.sweep(r.data(), options.relaxation);
    ++iterations;
    const double wanted = options.tolerance * options.tolerance * monitor.scale();
    const bool promising = ratio > 0 && change * ratio <= wanted;
    if (!promising && iterations < next_check && iterations < options.max_iterations && std::isfinite(change)) continue;
    const double error = monitor.error_of(r.data());
    ratio = change > 0 ? error * error * monitor.scale() / change : 0;
    next_check = iterations + std::max<std::int64_t>(2, iterations / 4);
    if (change == 0 && error > options.tolerance)
      monitor.give_up(ProblemStatus::stalled, "a sweep changes nothing any more: only rounding is left");
  }
  return monitor.finish(name, iterations);
}

ProblemReport solve_nlgs(const FrictionProblem& p, const ProblemOptions& options, double* r) {
  Sweeper sweeper(p);
  return sweep_problem(p, options, r, "nlgs", sweeper);
}

} // namespace cairn
