// The step at hand: its length, where contacts are detected in it, and what its integrator makes of it.
#pragma once
#include "../../simulation/simulation.hpp"

namespace cairn {

struct StepScheme {
  double h = 0;     // [s]
  double ahead = 0; // from the start of the step to the detection of contacts [s]
  cairn_scheme scheme{};
  // Share of the step by which laws see its end velocity; 1 for the velocity of the next step.
  double law_share() const { return scheme.share > 0 ? scheme.share : 1; }
};

} // namespace cairn
