#include "plugged_body_forces.hpp"

#include <cmath>
#include <string>

#include "../../base/call.hpp"

namespace cairn {

void PluggedBodyForces::add(Simulation& s, const StepScheme& step) {
  Bodies& b = s.scene.bodies;
  if (!b.force.active) b.force.activate(b.count);
  given_ = b.force.values;
  const std::int64_t n = s.scene.bodies.count;
  for (const PluggedForce& f : s.forces) {
    f.routine(s.scene.dim, b.dofs(), n, s.time + step.scheme.end_share * step.h, f.params.data(), b.id.values.data(),
              b.mass.values.data(), b.position.values.data(), b.velocity.values.data(), b.force.values.data());
    for (std::int64_t i = 0; i < n * b.dofs(); ++i)
      if (!std::isfinite(b.force.values[i]))
        throw Error("the plugged body force " + f.name + " gave " + std::to_string(b.force.values[i]) + " to body " +
                    std::to_string(*b.id[i / b.dofs()]) + ": give finite numbers");
  }
}

void PluggedBodyForces::leave(Simulation& s) {
  if (!given_.empty()) s.scene.bodies.force.values.swap(given_);
  given_.clear();
}

} // namespace cairn
