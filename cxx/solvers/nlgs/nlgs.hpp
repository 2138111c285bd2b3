// Block nonlinear Gauss-Seidel on the contacts of a step.
#pragma once
#include "../solve_report.hpp"
#include "../solver_options.hpp"
#include "sweep_help.hpp"

namespace cairn {

SolveReport solve_nlgs(ContactSystem&, const Velocities& velocity_free, const SolverOptions&,
                       SweepHelp* help = nullptr);

} // namespace cairn
