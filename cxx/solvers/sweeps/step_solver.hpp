// The solver of a step's contacts by its name.
#pragma once
#include "../refinement_memory.hpp"
#include "../solve_report.hpp"
#include "../solver_options.hpp"
#include "contact_system.hpp"

namespace cairn {

// Solves the contacts of a step. Failure to converge is a status; throws Error where the solver cannot take these
// contacts. hint_of_solver: what a solver of problems told when it gave up; empty: it did not.
SolveReport solve_step(ContactSystem&, const Velocities& velocity_free, const SolverOptions&,
                       std::string* hint_of_solver = nullptr);

} // namespace cairn
