// Orders of sweeps beside the given one.
#include "cairn/core.h"
#include "nlgs_problem.hpp"

namespace cairn {

ProblemReport solve_nlgs_coloured(const FrictionProblem& p, const ProblemOptions& options, double* r) {
  Sweeper sweeper(p);
  std::vector<std::int32_t> colour(p.contacts);
  std::int64_t colours = 0;
  sweeper.colour_start.resize(p.contacts + 1);
  cairn_colour_blocks(p.contacts, p.row_start.data(), p.column.data(), colour.data(), sweeper.order.data(), &colours,
                      sweeper.colour_start.data());
  sweeper.colour_start.resize(colours + 1);
  sweeper.threads = options.threads;
  return sweep_problem(p, options, r, "nlgs_coloured", sweeper);
}

ProblemReport solve_nlgs_random(const FrictionProblem& p, const ProblemOptions& options, double* r) {
  Sweeper sweeper(p);
  std::int64_t state = 1 + std::int64_t(options.seed % 2147483646);
  return sweep_problem(p, options, r, "nlgs_random", sweeper,
                       [&](std::vector<std::int32_t>& order) { cairn_shuffle(p.contacts, &state, order.data()); });
}

} // namespace cairn
