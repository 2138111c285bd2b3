// Block nonlinear Gauss-Seidel.
#pragma once
#include "../interaction.hpp"
#include "contact_system.hpp"

namespace cairn {

SolveReport solve_nlgs(ContactSystem&, const Field<double>& velocity_free, const SolverOptions&);

} // namespace cairn
