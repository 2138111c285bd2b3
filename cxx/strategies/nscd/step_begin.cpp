#include "step_begin.hpp"

namespace cairn {

void StepBegin::save(Simulation& s) {
  Bodies& b = s.scene.bodies;
  b.position_begin.values = b.position.values;
  b.velocity_begin.values = b.velocity.values;
  if (b.rotation.active) b.rotation_begin.values = b.rotation.values;
  if (b.angular_momentum.active) b.momentum_begin.values = b.angular_momentum.values;
  Nodes& nodes = s.scene.nodes;
  nodes.position_begin.values = nodes.position.values;
  nodes.velocity_begin.values = nodes.velocity.values;
  cell_ = s.scene.cell;
}

void StepBegin::restore(Simulation& s) const {
  Bodies& b = s.scene.bodies;
  b.position.values = b.position_begin.values;
  b.velocity.values = b.velocity_begin.values;
  if (b.rotation.active) b.rotation.values = b.rotation_begin.values;
  if (b.angular_momentum.active) {
    b.angular_momentum.values = b.momentum_begin.values;
    // of bodies whose spin is driven it followed their orientation
    cairn_momentum_update(b.count, 1, b.inertia.values.data(), b.rotation.values.data(), b.velocity.values.data(),
                          b.velocity.values.data(), b.angular_momentum.values.data(), bits(b.driven));
  }
  Nodes& nodes = s.scene.nodes;
  nodes.position.values = nodes.position_begin.values;
  nodes.velocity.values = nodes.velocity_begin.values;
  s.scene.cell = cell_;
}

} // namespace cairn
