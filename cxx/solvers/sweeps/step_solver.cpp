#include "step_solver.hpp"

#include <cmath>

#include "../../base/call.hpp"
#include "../nlgs/nlgs.hpp"
#include "solid_correction.hpp"
#include "step_by_problem.hpp"

namespace cairn {

SolveReport solve_step(ContactSystem& system, const Velocities& velocity_free, const SolverOptions& options,
                       std::string* hint_of_solver) {
  if (std::isfinite(options.accuracy) && options.solver != "nlgs" && options.solver != "auto")
    throw Error("accuracy is estimated between sweeps: take cairn.NLGS or cairn.Auto instead of " + options.solver +
                ", or leave accuracy out");
  if (system.cell && options.solver != "nlgs" && options.solver != "auto")
    throw Error("the cell follows the stress between sweeps: take cairn.NLGS or cairn.Auto instead of " +
                options.solver + ", or drive it by rates alone");
  if (options.solver == "nlgs" || system.cell) return solve_nlgs(system, velocity_free, options);
  if (options.solver == "auto" && SolidCorrection::obstacle(system).empty())
    return solve_nlgs_and_bodies(system, velocity_free, options);
  if (options.solver == "auto") return solve_nlgs_and_newton(system, velocity_free, options);
  for (const ProblemSolverInfo& row : problem_solvers())
    if (row.name == options.solver) return solve_by_problem(system, velocity_free, options, row, hint_of_solver);
  throw Error("there is no contact solver '" + options.solver + "'");
}

} // namespace cairn
