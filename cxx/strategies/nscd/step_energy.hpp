// Terms of the balance of energy of a step.
#pragma once
#include "histories.hpp"
#include "step_scheme.hpp"

namespace cairn {

// Work that no kernel of bodies and contacts measures [J].
struct WorkBeside {
  double seated = 0;    // of weight, where bodies were moved to seat joints
  double stiffened = 0; // taken by the implicit stiffness of loaded joints
};

// Adds the terms of a step to the energy of the run; theta: its integrator is the theta-method.
void account_for_energy(Simulation& s, const StepScheme& step, bool theta, const Histories& histories,
                        const ContactEnergy& contacts, const WorkBeside& beside);

// The same from the terms of all bodies and nodes: see cairn_energy_terms.
void balance_energy(Simulation& s, const MeshList& meshes, const double (&terms)[8], const ContactEnergy& contacts,
                    const WorkBeside& beside);

// Energy that contacts made from nothing in a step [J], over the energy of that step, which is none in a scene at rest,
// and a thousandth of all that has been in play: below that share of it, errors within the tolerance change no motion.
double created_share(double created, double of_step, double in_play, std::int64_t steps);

} // namespace cairn
