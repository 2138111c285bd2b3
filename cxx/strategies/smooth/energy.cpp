// The balance of energy of smooth scenes. Bodies are counted by the rule of the integrator, so that their side closes
// to rounding; laws tell what contacts store and lose; what the work of contacts leaves beside that is the error of
// finite steps, dissipated_integrator.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../../base/call.hpp"
#include "cairn/smooth_bodies.h"
#include "smooth_dem.hpp"

namespace cairn {

// Initial energy balance: kinetic energy, and that of the springs under the first forces.
void SmoothDem::begin_balance(Simulation& s) {
  if (!settings.energy) return;
  driven_before_ = s.energy.work_driven; // work of wrapping before is in the kinetic energy
  s.energy.kinetic = kinetic_of(s);
  s.energy.stored = 0;
  for (std::int64_t t = 0; t < tiles(s).count(); ++t) s.energy.stored += sums_[std::size_t(sums_of_tile * t + 16)];
}

// What bodies gained with their masses, at the same velocity, is work of growth.
void SmoothDem::count_growth(Simulation& s) const {
  if (!settings.energy || !s.scene.bodies.stretch.active) return;
  const double wrapped = s.energy.work_driven - driven_before_, gained = kinetic_of(s) - wrapped - s.energy.kinetic;
  s.energy.kinetic += gained;
  s.energy.work_growth += gained;
}

double SmoothDem::kinetic_of(const Simulation& s) const {
  const Bodies& b = s.scene.bodies;
  double sum = 0;
  const BodyTiles all = tiles(s);
  for (std::int64_t t = 0; t < all.count(); ++t) {
    const std::int64_t first = all.first(t), last = all.last(t);
    sum += cairn_verlet_kinetic(b.dofs(), first, last, b.inverse_mass.values.data(), b.velocity.values.data());
    const auto uneven = uneven_of(t);
    if (!uneven.empty())
      sum += cairn_uneven_kinetic(std::int64_t(uneven.size()), uneven.data(), b.velocity.values.data(),
                                  b.angular_momentum.values.data());
  }
  return sum;
}

// Masses and curvatures of bodies that grew after the last step; their pairs came closer by as much.
void SmoothDem::follow_growth(Simulation& s) {
  Bodies& b = s.scene.bodies;
  const Contactors& c = s.scene.contactors;
  if (!b.stretch.active || !list_.valid || list_is_old(s)) return;
  double most = 0, largest = 0;
  smallest_ = std::numeric_limits<double>::infinity();
  for (std::int64_t k = 0; k < c.count; ++k) {
    smallest_ = std::min(smallest_, bounded_size(s, k));
    const double share = *b.stretch[*c.body[k]];
    if (!(share < 0 || share > 0)) continue;
    grain_[2 * k] = curvature(c, std::int32_t(k)); // as a new list has it, to the last digit
    const double arm = arm_of(s, k);
    most = std::max(most, std::abs(share) * arm);
    largest = std::max(largest, share);
    if (has_shaped_) body_arm_[*c.body[k]] = std::max(body_arm_[*c.body[k]], arm);
  }
  if (!(most > 0)) return;
  cairn_inverse_masses(dim_, b.dofs(), b.count, b.mass.values.data(), b.inertia.values.data(),
                       b.inverse_mass.values.data());
  for (double& one : b.inverse_mass.values) one /= settings.mass_scale;
  weigh_grains(s);
  moved_ += most;
  arm_ *= 1 + largest;
}

// Works of the first half of the step, before it, or of the second, before its end.
void SmoothDem::half_step_works(Simulation& s, std::int64_t tile, bool second) {
  if (!settings.energy || predicts()) return;
  Bodies& b = s.scene.bodies;
  const std::int64_t first = tiles(s).first(tile), last = tiles(s).last(tile);
  double* works = &works_[4 * tile];
  each_run(s, first, last, [&](std::int64_t from, std::int64_t to, bool plain) {
    if (plain)
      cairn_verlet_works_spheres(from, to, second, h_, weight_.data(), b.inverse_mass.values.data(),
                                 b.contact_force.values.data(), b.velocity.values.data(), works);
    else
      cairn_verlet_works(dim_, b.dofs(), from, to, second, h_, weight_.data(), b.inverse_mass.values.data(),
                         b.contact_force.values.data(), b.velocity.values.data(), works, pointer(b.force),
                         pointer(b.damping), bits(b.driven), pointer(b.driven_velocity));
  });
  const auto uneven = uneven_of(tile); // their spins turn freely between the kicks, which keeps their energy
  if (!second && !uneven.empty())
    works[0] -= cairn_uneven_kinetic(std::int64_t(uneven.size()), uneven.data(), b.velocity.values.data(),
                                     b.angular_momentum.values.data());
}

// Sums of the tiles in their order. d(T + U + stored) = W - D + closure, to rounding.
void SmoothDem::account(Simulation& s, std::int64_t n) {
  double sum[sums_of_tile] = {}, works[4] = {};
  for (std::int64_t t = 0; t < n; ++t) {
    const double* of = &sums_[sums_of_tile * t];
    sum[2] = std::max(sum[2], of[2]);
    for (int k = 3; k < sums_of_tile; ++k) sum[k] += of[k];
    for (int k = 0; k < 4; ++k) works[k] += works_[4 * t + k];
  }
  s.report.solve = {};
  s.report.solve.penetration = sum[2];
  s.report.contacts = s.report.solve.contacts = std::int64_t(sum[3]);
  if (!settings.energy) return;
  Energy& e = s.energy;
  const double wrapped = e.work_driven - driven_before_; // by the cell, as bodies passed through its sides
  const double kinetic = sum[4], potential = sum[5], external = sum[6], moved = sum[13], local = sum[9],
               driven = sum[7] + works[3], bulk = sum[8] + works[2], stored = sum[16], normal = sum[17],
               friction = sum[18], released = sum[19], grown = sum[14];
  const double bodies = kinetic - e.kinetic - wrapped + potential - external - driven + bulk; // 0 without contacts
  const double contacts = predicts() ? bodies : works[0] + works[1]; // works on bodies, and what telescopes
  const double before = e.kinetic,
               integrator = moved + grown - contacts - local - (stored - e.stored) - normal - friction - released;
  e.closure += bodies - contacts;
  e.kinetic = kinetic;
  e.stored = stored;
  e.potential += potential;
  e.work_external += external;
  e.work_driven += driven + moved;
  e.work_growth += grown;
  e.dissipated_bulk += bulk + local;
  e.dissipated_normal += normal;
  e.dissipated_friction += friction;
  e.dissipated_integrator += integrator;
  e.released += released;
  e.turned_over += std::abs(potential) + std::abs(external) + std::abs(driven) + std::abs(moved) + std::abs(normal) +
                   std::abs(friction) + std::abs(bulk) + std::abs(local) + std::abs(released) + std::abs(grown);
  e.largest_kinetic = std::max({e.largest_kinetic, kinetic, before});
  e.in_play = e.largest_kinetic + e.turned_over;
}

} // namespace cairn
