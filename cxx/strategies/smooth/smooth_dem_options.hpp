// Settings of smooth DEM, with their rows in options.def.
#pragma once
#include <limits>

#include "../../simulation/integrators.hpp"

namespace cairn {

struct SmoothDemOptions {
  double skin = std::numeric_limits<double>::quiet_NaN(); // [m] of a pair, beyond the reach of its law; NaN: from sizes
  double overlap = 0.01; // of an effective radius, at which the stiffness is taken for the stable step
  bool refuse_unstable = true;
  double local_damping = 0;   // share of the force on a body that is set against its motion
  double cell_damping = 0.25; // the same of the rates of a cell that follows a stress
  double mass_scale = 1;      // inertia of bodies over their mass, which their weight keeps
  bool energy = true;         // keep the balance of energy
  int threads = 0;
  int renumber_every = 1000;
  Integrator integrator{"velocity_verlet"}; // that, or gear
};

} // namespace cairn
