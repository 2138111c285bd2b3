// Enumeration: tries all states of all contacts until a solution is found; for a few contacts.
#include "cairn/core.h"
#include "scaled_problem.hpp"

namespace cairn {

ProblemReport solve_enumeration(const FrictionProblem& given, const ProblemOptions& options, double* best) {
  constexpr std::int64_t most_contacts = 8;
  ScaledProblem scaled(given, options, best);
  ProblemMonitor& monitor = scaled.monitor();
  const FrictionProblem& p = scaled.problem();
  const std::int64_t n = p.contacts, size = p.unknowns();
  const int states = p.dim == 2 ? 4 : 3;
  Array<double> r(scaled.best(), scaled.best() + size);
  monitor.error_of(r.data());
  if (n > most_contacts) {
    monitor.give_up(ProblemStatus::stalled, "more than 8 contacts have too many states; take auto");
    return scaled.finish("enumeration", 0);
  }
  Array<double> w(size * size), matrix(size * size), right(size), direction((p.dim - 1) * n);
  for (std::int64_t a = 0; a < n; ++a)
    for (std::int64_t k = p.row_start[a]; k < p.row_start[a + 1]; ++k)
      for (int i = 0; i < p.dim; ++i)
        for (int j = 0; j < p.dim; ++j)
          w[size * (p.dim * p.column[k] + j) + p.dim * a + i] = p.block[p.dim * p.dim * k + p.dim * j + i];
  std::vector<std::int32_t> state(n, 1); // all stick first
  std::int64_t tried = 0, all = 1;
  for (std::int64_t a = 0; a < n; ++a) all *= states;
  while (!monitor.ended(tried)) {
    cairn_enumeration_impulses(p.dim, n, w.data(), p.q.data(), p.mu.data(), state.data(), 200, matrix.data(),
                               right.data(), direction.data(), r.data());
    monitor.error_of(r.data());
    if (!(monitor.last_error() < 1e300)) monitor.error_of(scaled.best()); // of a state that has no impulses
    ++tried;
    std::size_t a = 0;
    while (a < state.size() && (state[a] = (state[a] + 1) % states) == 1) ++a;
    if (tried >= all)
      monitor.give_up(ProblemStatus::stalled,
                      "no state of the contacts holds: there is no solution, or rounding hides it");
  }
  return scaled.finish("enumeration", tried);
}

} // namespace cairn
