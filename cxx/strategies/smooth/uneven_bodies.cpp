// Bodies of unequal moments of inertia in 3D: their angular momentum is kicked, and they turn freely in between. The
// kernels of velocity Verlet see no inertia of their spins.
#include <cmath>

#include "../../base/call.hpp"
#include "cairn/smooth_bodies.h"
#include "smooth_dem.hpp"

namespace cairn {

bool SmoothDem::is_uneven(const Bodies& b, std::int64_t i) {
  const double* m = b.inertia[i];
  return std::isfinite(*b.mass[i]) && (m[0] < m[1] || m[1] < m[0] || m[1] < m[2] || m[2] < m[1]);
}

void SmoothDem::list_uneven(Simulation& s) {
  Bodies& b = s.scene.bodies;
  uneven_.clear();
  const BodyTiles all = tiles(s);
  uneven_start_.assign(all.count() + 1, 0);
  for (std::int64_t i = 0; i < b.count && b.angular_momentum.active; ++i) {
    if (is_uneven(b, i)) {
      uneven_.push_back(i);
      for (int k = 3; k < 6; ++k) b.inverse_mass[i][k] = 0;
    }
    uneven_start_[all.of(i) + 1] = std::int64_t(uneven_.size());
  }
  turned_.resize(7 * std::int64_t(uneven_.size()));
}

void SmoothDem::check_uneven(const Simulation& s) const {
  const Bodies& b = s.scene.bodies;
  for (std::int64_t i = 0; i < b.count; ++i) {
    if (!is_uneven(b, i)) continue;
    if (settings.integrator.name == "gear")
      throw Error(
          "inertia of body " + std::to_string(*b.id[i]) +
          " differs from axis to axis, which Gear's integrators do not turn; give integrator='velocity_verlet'");
    const int spins = b.driven.active ? *b.driven[i] & 56 : 0;
    if (spins != 0 && spins != 56)
      throw Error("body " + std::to_string(*b.id[i]) +
                  " is driven about some axes and free about others, which SmoothDEM does for bodies of equal moments "
                  "of inertia alone; drive all three spins or none, or use NSCD");
  }
}

std::span<const std::int64_t> SmoothDem::uneven_of(std::int64_t tile) const {
  return {uneven_.data() + uneven_start_[tile], std::size_t(uneven_start_[tile + 1] - uneven_start_[tile])};
}

// To the middle of the step, and where they will be at its end; fastest: square of the greatest spin.
void SmoothDem::begin_uneven(Simulation& s, std::int64_t tile, double* fastest, std::int64_t& unsolved) {
  Bodies& b = s.scene.bodies;
  const auto own = uneven_of(tile);
  if (own.empty()) return;
  cairn_uneven_begin(std::int64_t(own.size()), own.data(), h_, b.inertia.values.data(), b.contact_force.values.data(),
                     b.rotation.values.data(), b.velocity.values.data(), b.angular_momentum.values.data(),
                     &turned_[7 * uneven_start_[tile]], fastest, &unsolved, pointer(b.force), pointer(b.damping),
                     bits(b.driven));
}

void SmoothDem::turn_uneven(Simulation& s, std::int64_t tile) {
  Bodies& b = s.scene.bodies;
  const auto own = uneven_of(tile);
  if (own.empty()) return;
  const double* turned = &turned_[7 * uneven_start_[tile]];
  for (const std::int64_t i : own) {
    if (!(b.driven.active && (*b.driven[i] & 56))) std::copy_n(turned, 4, b.rotation[i]);
    turned += 7;
  }
}

void SmoothDem::end_uneven(Simulation& s, std::int64_t tile, std::int64_t& wrong, double* terms) {
  Bodies& b = s.scene.bodies;
  const auto own = uneven_of(tile);
  if (own.empty()) return;
  const double kinetic = terms ? terms[0] : 0, external = terms ? terms[2] - terms[4] : 0,
               driven = terms ? terms[3] : 0;
  cairn_uneven_end(std::int64_t(own.size()), own.data(), h_, b.inertia.values.data(), b.contact_force.values.data(),
                   b.rotation.values.data(), &turned_[7 * uneven_start_[tile]], b.velocity.values.data(),
                   b.angular_momentum.values.data(), &wrong, pointer(b.force), pointer(b.damping), bits(b.driven),
                   pointer(b.reaction), terms);
  if (terms && !predicts()) // what the other forces have not done, contacts did
    works_[4 * tile] += terms[0] - kinetic - (terms[2] - terms[4] - external) - (terms[3] - driven);
}

double SmoothDem::inverse_inertia(const Simulation& s, std::int64_t body) const {
  const Bodies& b = s.scene.bodies;
  if (dim_ == 2 || !b.angular_momentum.active || !is_uneven(b, body)) return b.inverse_mass[body][dim_];
  return 1 / std::min({b.inertia[body][0], b.inertia[body][1], b.inertia[body][2]});
}

} // namespace cairn
