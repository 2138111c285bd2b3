// Joints that came in, and those of steps of another length, hold where contacts are detected before they are solved.
#include "joints.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

// Closes the initial gaps of joints by displacements in the metric of mass, as overlaps are projected; Newton's method,
// since frames turn with bodies. A joint that this does not bring nearer keeps its position, for the solver.
void JointSeats::seat(Simulation& s, double h, const std::function<void()>& detect) {
  constexpr int most = 6;
  constexpr double fall = 0.25;
  if (seated_) return;
  seated_ = true;
  if (!s.interactions.joints().must_project()) return;
  s.interactions.joints().projected();
  Bodies& b = s.scene.bodies;
  s.interactions.joints().choose_to_project(b);
  const double begun = s.interactions.joints().violation();
  if (!(begun > 0)) return;
  const Array<double> position = b.position.values, rotation = b.rotation.values;
  double off = begun, potential = 0;
  for (int pass = 0; pass < most && off > 0; ++pass) {
    if (!s.interactions.joints().project(b, velocity_)) break;
    move_bodies(s, velocity_, h);
    detect();
    const double now = s.interactions.joints().violation();
    const bool nearer = now <= fall * off;
    off = now;
    if (!nearer) break;
  }
  if (!(off <= fall * begun)) {
    b.position.values = position;
    b.rotation.values = rotation;
    detect();
    return;
  }
  for (std::int64_t i = 0; i < b.count; ++i)
    for (int k = 0; k < s.scene.dim && std::isfinite(*b.mass[i]); ++k)
      potential -= *b.mass[i] * s.scene.gravity[std::size_t(k)] *
                   (b.position[i][k] - position[std::size_t(i) * std::size_t(s.scene.dim) + std::size_t(k)]);
  work_ = potential;
}

void move_bodies(Simulation& s, const Array<double>& velocity, double h) {
  Bodies& b = s.scene.bodies;
  const int d = s.scene.dim;
  cairn_theta_advance(d, b.dofs(), b.count, h, velocity.data(), b.position.values.data(),
                      d == 2 && b.rotation.active ? b.rotation.values.data() : nullptr);
  if (d == 2 || !b.rotation.active) return;
  std::int64_t unsolved = 0;
  cairn_rotate(b.count, h, b.inertia.values.data(), velocity.data(), b.rotation.values.data(), nullptr, nullptr,
               &unsolved);
}

} // namespace cairn
