// The error of a step's impulses, whichever solver found them, and the figures of its report.
#pragma once
#include "../../contacts/interaction.hpp"
#include "contact_system.hpp"

namespace cairn {

// Squares, relative to the sum of free energies.
struct StepError {
  double square = 0;
  bool finite = true;
};

// The free velocity of contacts: scale of their error, and the part of it that the rounding of the bodies' velocities
// hides.
struct FreeScale {
  double energy = 0, rounding = 0;
  double least = 1; // of the scale, where velocities may make it smaller, over that by impulses
};

// Records hold the free velocity.
FreeScale measure_free(ContactSystem&, const cairn_schedule&, double tolerance);
// Records hold the velocity that the impulses leave. last: the status of each contact too.
StepError measure(ContactSystem&, const cairn_schedule&, FreeScale, bool last, SolveReport&);
// Of values (n), stride apart, in the order of batches, whatever thread did them.
double total(const Array<double>& values, std::size_t n, std::size_t stride, std::size_t offset);
// The status that the last error gives, whatever the solver thought, and a hint; what was found to diverge stays so.
// hint: the solver's own, or none.
void conclude(SolveReport&, const StepError& last, const SolverOptions&, const std::string& hint = {});
// No impulses: bodies keep velocities that are numbers.
void give_none(ContactSystem&, const Velocities& velocity_free);

} // namespace cairn
