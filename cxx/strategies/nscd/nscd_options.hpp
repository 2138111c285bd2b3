// Settings of NSCD, with their rows in options.def.
#pragma once
#include <limits>

#include "../../contacts/interaction.hpp"
#include "../../simulation/integrators.hpp"

namespace cairn {

struct NscdOptions {
  Integrator integrator{}; // the theta-method, if none is chosen
  SolverOptions solver{};
  double margin = std::numeric_limits<double>::quiet_NaN(); // [m] of a pair; NaN: from sizes and speeds
  bool project_positions = false;
  double overlap = std::numeric_limits<double>::infinity(); // share of a body's size that contacts leave as it is
  bool warm_start = true;
  bool act_on_surfaces = false;   // see Interactions
  int renumber_every = 200;       // steps between renumberings along the space-filling curve
  ContactPose pose{};             // Carpenter's scheme and the granular element method pose conditions of their own
  double newton_tolerance = 1e-8; // on the balance of bodies whose stresses are not linear, in an energy norm
  int newton_passes = 30;         // of a step at most
  int cut_back = 0;               // times that a step which Newton's method does not make is halved
  bool refuse_unstable = true;    // steps beyond the limit of an explicit integrator
};

} // namespace cairn
