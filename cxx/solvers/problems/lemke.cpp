// Lemke's pivots on friction as a linear complementarity problem. In space a facet of each cone is turned against the
// slip that the last solution had, until slip and facet agree: the end is the round cone.
#include <cmath>

#include "cairn/core.h"
#include "scaled_problem.hpp"

namespace cairn {

ProblemReport solve_lemke(const FrictionProblem& given, const ProblemOptions& options, double* best) {
  constexpr std::int64_t most_rows = 1600;
  ScaledProblem scaled(given, options, best);
  ProblemMonitor& monitor = scaled.monitor();
  const FrictionProblem& p = scaled.problem();
  const std::int32_t facets = p.dim == 2 ? 2 : 8;
  const std::int64_t m = p.contacts * (2 + facets);
  Array<double> r(scaled.best(), scaled.best() + p.unknowns()), angle(p.contacts), tableau;
  std::vector<std::int64_t> basis(m), other(m + 1);
  std::int64_t iterations = 0;
  monitor.error_of(r.data());
  if (m > most_rows) monitor.give_up(ProblemStatus::stalled, "too many contacts for a dense tableau; take auto");
  while (!monitor.ended(iterations)) {
    tableau.resize(m * (m + 2));
    cairn_lemke_tableau(p.dim, p.contacts, facets, p.row_start.data(), p.column.data(), p.block.data(), p.q.data(),
                        p.mu.data(), angle.data(), m, tableau.data());
    std::int64_t pivots = 0;
    const std::int64_t most = std::min<std::int64_t>(20 * m, options.max_iterations - iterations);
    const std::int32_t status = cairn_lemke_pivots(m, most, tableau.data(), basis.data(), other.data(), &pivots);
    iterations += std::max<std::int64_t>(pivots, 1);
    cairn_lemke_impulses(p.dim, p.contacts, facets, angle.data(), m, tableau.data(), basis.data(), r.data());
    const double before = monitor.best_error();
    monitor.error_of(r.data());
    if (status == 1)
      monitor.give_up(ProblemStatus::stalled,
                      "Lemke's pivots end on a ray: there is no solution, or rounding hides it");
    if (p.dim == 2 && status == 0)
      monitor.give_up(ProblemStatus::stalled, "a vertex was found, as exact as pivots are");
    if (p.dim == 3 && iterations > 200 * m && !(monitor.best_error() < before))
      monitor.give_up(ProblemStatus::stalled, "facets and slip do not come to agree");
    const Array<double>& u = monitor.velocity();
    for (std::int64_t a = 0; a < p.contacts && p.dim == 3; ++a) {
      const double w = p.block[9 * monitor.diagonal()[a] + 4]; // as the natural map turns it
      const double t = r[3 * a + 1] - u[3 * a + 1] / w, s = r[3 * a + 2] - u[3 * a + 2] / w;
      if (t != 0 || s != 0) angle[a] = std::atan2(s, t);
    }
  }
  return scaled.finish("lemke", iterations);
}

} // namespace cairn
