// Forces of plug-ins on bodies, during a step added to those that were given.
#pragma once
#include "step_scheme.hpp"

namespace cairn {

class PluggedBodyForces {
public:
  void add(Simulation& s, const StepScheme& step);
  // Gives back the forces that were given.
  void leave(Simulation& s);

private:
  Array<double> given_; // empty: nothing was added
};

} // namespace cairn
