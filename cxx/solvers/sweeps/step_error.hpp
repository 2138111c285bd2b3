// The error of a step's impulses, whichever solver found them, and the figures of its report.
#pragma once
#include "../refinement_memory.hpp"
#include "../solve_report.hpp"
#include "../solver_options.hpp"
#include "contact_system.hpp"

namespace cairn {

// Squares, relative to the sum of free energies.
struct StepError {
  double square = 0;
  bool finite = true;
  double growth = 0;      // sum |r|^2/rho / that of free energies
  bool unbounded = false; // see grows_without_end
  bool vague = false;     // velocities are not known to be as exact as was asked
  bool rounded = false;   // and will not be: only rounding is left
};

// The free velocity of contacts: scale of their error, and the part of it that the rounding of the bodies' velocities
// hides.
struct FreeScale {
  double energy = 0, rounding = 0;
  double least = 1; // of the scale, where velocities may make it smaller, over that by impulses
};

// FreeScale::least where a contact holds (ContactSystem::may_hold), and where bodies grow.
double least_of_scale(bool holds, bool grows, double tolerance);
// Records hold the free velocity.
FreeScale measure_free(ContactSystem&, const cairn_schedule&, double tolerance);
// Records hold the velocity that the impulses leave. last: the status of each contact too.
StepError measure(ContactSystem&, const cairn_schedule&, FreeScale, bool last, SolveReport&);
// True if impulses grow without end. The error is relative to impulses, so that ever larger ones seem to obey the law
// where no solution exists, as between two closing walls: they grow until the rest, the free velocity, is the tolerance
// beside them. Then their work over the remaining speeds exceeds the energy of all bodies' changes of velocity by
// 1/tolerance.
bool grows_without_end(ContactSystem&, const cairn_schedule&, const Velocities& velocity_free, const StepError&,
                       double tolerance);
// Power from which it is so, and root of the growth.
double endless_growth(double tolerance);
// Sum of values (n), stride apart, in the order of batches, on any number of threads.
double total(const Array<double>& values, std::size_t n, std::size_t stride, std::size_t offset);
// Sets the status by the last error, whatever the solver reported, and a hint; a divergence found before stays. hint:
// the solver's own, or none.
void conclude(SolveReport&, const StepError& last, const SolverOptions&, const std::string& hint = {});
// No impulses: bodies keep velocities that are numbers.
void give_none(ContactSystem&, const Velocities& velocity_free);

} // namespace cairn
