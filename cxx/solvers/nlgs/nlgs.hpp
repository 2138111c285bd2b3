// Block nonlinear Gauss-Seidel on the contacts of a step.
#pragma once
#include <memory>

#include "../solve_report.hpp"
#include "../solver_options.hpp"
#include "sweep_help.hpp"

namespace cairn {

SolveReport solve_nlgs(ContactSystem&, const Velocities& velocity_free, const SolverOptions&,
                       SweepHelp* help = nullptr);
// With other solvers for where sweeps take too long: proximal points around Newton's method; Newton's method over
// bodies, where laws have a local solution of their own.
SolveReport solve_nlgs_and_newton(ContactSystem&, const Velocities& velocity_free, const SolverOptions&);
SolveReport solve_nlgs_and_bodies(ContactSystem&, const Velocities& velocity_free, const SolverOptions&);
// The same solvers beside sweeps that are made elsewhere.
std::unique_ptr<SweepHelp> newton_help(ContactSystem&, const Velocities& velocity_free, const SolverOptions&);
// zones: passes over bodies that zones join are still to be tried in this step.
std::unique_ptr<SweepHelp> solid_help(ContactSystem&, const Velocities& velocity_free, const SolverOptions&,
                                      bool zones = true);

} // namespace cairn
