// How far velocities are from what the law asks, on the scale of the lighter body of each contact. The true error sums
// energies: under a heavy body the impulses that pass through light ones are so large beside their own momentum that
// it does not see how those fall, bounce or slip.
#pragma once
#include <algorithm>
#include <cstdint>

#include "../../base/field.hpp"
#include "../problems/friction_problem.hpp"
#include "contact_system.hpp"

namespace cairn {

struct SolveReport;

struct LightError {
  // Largest speed by which a contact breaks the law / the change of velocity |v - v_free| of its lighter body, which
  // counts as at least the mean one (weighed by mass) of the bodies that impulses move.
  double largest = 0;
  // Power of the impulses over these speeds / energy of the bodies' changes of velocity: small speeds of the contacts
  // of a column, each above the other, add up to the fall of what stands on it.
  double power = 0;
  std::int64_t worst_contact = -1; // place in the candidates, or in the problem
  double value() const { return largest > power ? largest : power; }
};

// Heaviest / lightest of the bodies that move. By masses alone: what touches what is not asked.
double mass_ratio(const ContactSystem&);
double mass_ratio(const ContactBodies&);
// Where light errors count. Sweeps alone cannot do much about them: there, not before a ratio at which others are
// chosen.
inline bool masses_differ(double ratio, bool has_newton) { return ratio > (has_newton ? 100 : 900); }
// Light errors below it change nothing that shows in a thousand steps: what a body carries turns with it and pushes it
// on by as much as it weighs.
inline double light_enough(double tolerance, double ratio) { return 0.1 * tolerance * std::min(1.0, 10 / ratio); }

// Records hold the velocity that the impulses leave. Laws with a local solution of their own have no power.
LightError measure_light(ContactSystem&, const cairn_schedule&, const Velocities& velocity_free);

// Of a problem over bodies: r and u as the problem has them, bodies.velocity the change of velocity that r makes; unit
// (contacts): by which u is multiplied there; broken (dim, contacts): out, by how much each velocity breaks the law.
LightError measure_light(const FrictionProblem&, const Array<double>& w_nn, const double* r, const double* u,
                         const double* unit, Array<double>& broken);

void note(const LightError&, SolveReport&);

} // namespace cairn
