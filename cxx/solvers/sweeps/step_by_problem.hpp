// The contacts of a step by a solver of problems.
#pragma once
#include "../problems/friction_problem.hpp"
#include "../solve_report.hpp"
#include "../solver_options.hpp"
#include "contact_system.hpp"

namespace cairn {

// Options of a solver of problems: it goes a little further than the step asks, as the two errors differ by rounding.
ProblemOptions problem_options(const SolverOptions&);
// Failure to converge is a status; throws Error where the solver cannot take these contacts. hint_of_solver: see
// step_solver.hpp.
SolveReport solve_by_problem(ContactSystem&, const Velocities& velocity_free, const SolverOptions&,
                             const ProblemSolverInfo&, std::string* hint_of_solver = nullptr);

} // namespace cairn
