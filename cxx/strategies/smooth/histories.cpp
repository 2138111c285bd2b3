// Integrators of smooth DEM that keep more of the displacement than its first derivative: prediction, forces,
// correction.
#include <algorithm>

#include "../../base/call.hpp"
#include "smooth_dem.hpp"

namespace cairn {
std::vector<std::string> SmoothDem::texts_of(std::string_view option) const {
  if (option == "integrator") return {"velocity_verlet", "gear"};
  return {};
}

void SmoothDem::check_options() const {
  const std::vector<std::string> known = texts_of("integrator");
  if (std::find(known.begin(), known.end(), settings.integrator.name) == known.end())
    throw Error("integrator is " + settings.integrator.name + ", which SmoothDEM does not take: give " + known[0] +
                " or " + known[1]);
}

void SmoothDem::take_scheme(Simulation& s, double h) {
  check_options();
  scheme_ = {};
  if (settings.integrator.name == "velocity_verlet") return;
  scheme_ = settings.integrator.scheme(h);
  start_histories(s);
}

// Initial histories of bodies that came in or were set from outside, from the present forces.
void SmoothDem::start_histories(Simulation& s) {
  Bodies& b = s.scene.bodies;
  const Need needs[] = {Need::acceleration, Need::jerk, Need::snap, Need::crackle};
  for (int k = 0; k < scheme_.histories; ++k) s.scene.activate(needs[k]);
  auto& known = b.history_known.values;
  if (std::find(known.begin(), known.end(), 0) == known.end()) return;
  push_ = b.contact_force.values;
  if (b.force.active)
    for (std::size_t i = 0; i < push_.size(); ++i) push_[i] += b.force.values[i];
  cairn_history_start(dim_, b.dofs(), b.count, bits(b.history_known), s.scene.gravity.data(), b.mass.values.data(),
                      b.inertia.values.data(), b.velocity.values.data(), b.history(0), b.history(1), b.history(2),
                      b.history(3), push_.data(), pointer(b.damping), bits(b.driven));
  std::fill(known.begin(), known.end(), std::uint8_t(1));
}

void SmoothDem::forget_histories(Simulation& s) {
  std::fill(s.scene.bodies.history_known.values.begin(), s.scene.bodies.history_known.values.end(), 0);
}

void SmoothDem::predict(Simulation& s, std::int64_t first, std::int64_t last, double* sums) {
  Bodies& b = s.scene.bodies;
  cairn_gear_predict(dim_, b.dofs(), first, last, &scheme_, b.velocity.values.data(), b.position.values.data(), sums,
                     b.history(0), b.history(1), b.history(2), b.history(3), dim_ == 2 ? pointer(b.rotation) : nullptr,
                     bits(b.driven), pointer(b.driven_velocity));
}

void SmoothDem::correct(Simulation& s, std::int64_t first, std::int64_t last, std::int64_t& wrong, double* sums) {
  Bodies& b = s.scene.bodies;
  cairn_gear_correct(dim_, b.dofs(), first, last, &scheme_, s.scene.gravity.data(), b.inverse_mass.values.data(),
                     b.contact_force.values.data(), b.velocity.values.data(), b.position.values.data(), &wrong,
                     &sums[12], b.history(0), b.history(1), b.history(2), b.history(3),
                     dim_ == 2 ? pointer(b.rotation) : nullptr, pointer(b.force), pointer(b.damping), bits(b.driven),
                     pointer(b.driven_velocity), pointer(b.reaction), settings.energy ? &sums[4] : nullptr);
}

} // namespace cairn
