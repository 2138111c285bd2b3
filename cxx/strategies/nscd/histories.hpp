// Integrators that keep derivatives of the displacement beyond the velocity: their initial values and their update.
#pragma once
#include "step_scheme.hpp"

namespace cairn {

class Histories {
public:
  // Initial histories, from the present forces, of bodies that came in or were set from outside. True: there were some.
  bool start(Simulation& s, const StepScheme& step);
  // Change of the smooth dynamics over the step, contacts excluded, and the displacement beyond that of the velocities
  // at both ends.
  void measure(Simulation& s, const StepScheme& step);
  // Advances positions by that displacement, and the histories to the end of the step.
  void update(Simulation& s, const StepScheme& step);
  // Displacements of bodies and of nodes beyond those of the velocities [m, rad].
  const double* way() const { return way_.data(); }
  const double* node_way() const { return node_way_.data(); }
  std::int64_t bytes() const {
    return std::int64_t((change_.capacity() + way_.capacity() + node_change_.capacity() + node_way_.capacity()) *
                        sizeof(double));
  }

private:
  Array<double> change_, way_, node_change_, node_way_;
};

// Drops histories that belong to former positions, velocities or another integrator.
void forget_histories(Simulation& s);

} // namespace cairn
