// How far velocities are from what the law asks, on the scale of the lighter body of each contact. The true error sums
// energies: under a heavy body the impulses that pass through light ones are so large beside their own momentum that
// it does not see how those fall, bounce or slip.
#pragma once
#include <algorithm>
#include <cstdint>

#include "../../base/field.hpp"
#include "../policy.hpp"
#include "../problems/friction_problem.hpp"
#include "contact_system.hpp"

namespace cairn {

struct SolveReport;

struct LightError {
  // Light error: speed by which a contact breaks the law / the change of velocity |v - v_free| of its lighter body. The
  // change is at least the mean (weighed by mass) of the bodies that impulses move. Here: root mean square over the
  // contacts that press or break the law, and the largest.
  double mean = 0, largest = 0;
  // Power of the impulses over these speeds / energy of the bodies' changes of velocity: small speeds of stacked
  // contacts add up to the fall of the top of their column.
  double power = 0;
  // Impulse of a contact / momentum of the change of its lighter body: root mean square over the same contacts. Zero
  // where it is not known: of bonds, and where bodies bend.
  double load = 0;
  std::int64_t worst_contact = -1; // place in the candidates, or in the problem
  std::int64_t contacts = 0;       // that press, or break the law
  // Grains of deep piles bear a hundred times their weight, and velocities there are 40 to 300 times less exact than
  // the true error: of many contacts that bear no more, light bodies are not held to more either.
  double leave() const {
    const double of_piles = policy().light_piles, lightly_loaded = policy().light_load, few = policy().light_few;
    if (!(load > 0)) return 1;
    const double share = lightly_loaded / load, loaded = of_piles * share * share;
    const double many = double(contacts) / few;
    return std::clamp(std::min(loaded, many * many), 1.0, of_piles);
  }
  // Light error as a single number. Among ten thousand contacts the worst is always far above the mean, and a bound on
  // it alone would ask for a hundredth of the tolerance of all others: below 1 its square counts, a share of energy.
  double value() const { return std::max({mean, power, largest * std::clamp(largest, 1 / leave(), 1.0)}) / leave(); }
};

// Ratio of the heaviest to the lightest moving body, whether they touch or not.
double mass_ratio(const ContactSystem&);
double mass_ratio(const ContactBodies&);
// Where light errors count. Sweeps alone cannot do much about them: there, not before a ratio at which others are
// chosen.
inline bool masses_differ(double ratio, bool has_newton) {
  return ratio > (has_newton ? policy().light_mass_ratio : policy().light_mass_ratio_sweeps);
}
// Light errors below it change nothing that shows in a thousand steps: what a body carries turns with it and pushes it
// on by as much as it weighs.
inline double light_enough(double tolerance, double ratio) {
  return policy().light_enough * tolerance * std::min(1.0, 10 / ratio);
}
// The same where contacts rest on bodies that bend: what these carry leans on nodes that the body holds.
inline double light_enough(double tolerance, double ratio, bool bends) {
  return bends ? policy().light_on_nodes * tolerance : light_enough(tolerance, ratio);
}

struct LightSide {
  double inverse = 0, change = 0; // inverse mass [1/kg], 0 where it does not move; |v - v_free| [m/s]
};
// Takes the terms of a light error, of all bodies and then of contacts.
class LightTerms {
public:
  virtual void add_body(std::int64_t body, double inverse, double change_square) = 0; // -1: one that deforms
  // speed: by which it breaks the law [m/s]; impulse: its size [N s], 0 where it is not known; place: in the candidates
  virtual void add_contact(double speed, double impulse, const LightSide& lighter, std::int64_t place) = 0;

protected:
  ~LightTerms() = default;
};
// Both before contacts: changes of velocity of bodies that deform stay with the system.
void give_light_bodies(ContactSystem&, const Velocities& velocity_free, LightTerms&);
void give_light_contacts(const ContactSystem&, const cairn_schedule&, const Velocities& velocity_free, LightTerms&);

// Records hold the velocity that the impulses leave. Laws with a local solution of their own have no power.
LightError measure_light(ContactSystem&, const cairn_schedule&, const Velocities& velocity_free);

// Light error of a problem over bodies: r and u of the problem, bodies.velocity the change of velocity by r; unit
// (contacts): factor of u in the problem; broken (dim, contacts): out, violation of the law by each velocity.
LightError measure_light(const FrictionProblem&, const Array<double>& w_nn, const double* r, const double* u,
                         const double* unit, Array<double>& broken);

void note(const LightError&, SolveReport&);

} // namespace cairn
