// Energy that passes through contacts in a step.
#pragma once

namespace cairn {

// Energy that the contacts took out of the bodies in one step [J], D = -sum r.(u+ + u-)/2.
struct ContactEnergy {
  double normal = 0, tangential = 0; // rotation components of bonds count as tangential
  double jump_work = 0;   // that moving surfaces, and a periodic cell through its boundary, gave, -sum r.jump
  double created = 0;     // by contacts whose impulses gave energy, as restitution with friction can
  double turned_over = 0; // sum of the energies that each contact took or gave
  double grown = 0;       // that bodies gave which grew
  double driven = 0;      // that motors of joints gave
  // Energies told by laws; normal and tangential are without these.
  double stored = 0, stored_change = 0, released = 0; // in their springs now, gained in the step, spent for good
};

} // namespace cairn
