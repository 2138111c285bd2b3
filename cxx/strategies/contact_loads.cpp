#include "contact_loads.hpp"

#include <algorithm>
#include <cmath>

#include "../base/small_matrices.hpp"
#include "../simulation/contact_fields.hpp"
#include "reshaping.hpp"

namespace cairn {

double ContactLoad::stress(int dim, double volume) const {
  double mean[3][3] = {}, axes[3][3];
  for (int i = 0; i < dim; ++i)
    for (int j = 0; j < dim; ++j) mean[i][j] = (moment[3 * i + j] + moment[3 * j + i]) / (2 * volume);
  diagonalise(mean, axes);
  return std::max({std::abs(mean[0][0]), std::abs(mean[1][1]), std::abs(mean[2][2])});
}

void ContactLoads::read(Simulation& s, std::span<const std::int64_t> bodies, std::span<const std::size_t> meshes) {
  of_bodies.assign(bodies.size(), {});
  of_meshes.assign(meshes.size(), {});
  const double h = s.report.h;
  if (!(h > 0) || (bodies.empty() && meshes.empty())) return;
  const std::int64_t contacts = contacts_to_read(s);
  if (contacts == 0) return;
  std::int32_t most = 0;
  for (const std::size_t m : meshes) most = std::max(most, s.meshes.meshes.at(m).model.number);
  slot_of_body_.assign(std::size_t(s.scene.bodies.count), -1);
  slot_of_mesh_.assign(std::size_t(most) + 1, -1);
  centre_.resize(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    slot_of_body_[std::size_t(s.scene.internal(bodies[i]))] = std::int32_t(i);
    centre_[i] = motion_of(s.scene, bodies[i]).position;
  }
  for (std::size_t i = 0; i < meshes.size(); ++i)
    slot_of_mesh_[std::size_t(s.meshes.meshes[meshes[i]].model.number)] = std::int32_t(i);
  impulse_.resize(std::size_t(contacts * s.scene.dim));
  read_contact_field(s, contact_field_info("impulse"), impulse_.data());
  for (double& p : impulse_) p /= h; // mean forces
  for (std::int64_t c = 0; c < contacts; ++c) {
    add(s, c, s.candidates.contactor_a[c], false);
    add(s, c, s.candidates.contactor_b[c], true);
  }
  // Bodies and meshes listed twice share one slot.
  for (std::size_t i = 0; i < bodies.size(); ++i)
    of_bodies[i] = of_bodies[std::size_t(slot_of_body_[std::size_t(s.scene.internal(bodies[i]))])];
  for (std::size_t i = 0; i < meshes.size(); ++i)
    of_meshes[i] = of_meshes[std::size_t(slot_of_mesh_[std::size_t(s.meshes.meshes[meshes[i]].model.number)])];
}

void ContactLoads::add(const Simulation& s, std::int64_t contact, std::int32_t contactor, bool other) {
  const std::int32_t carrier = *s.scene.contactors.body[contactor];
  const bool mapped = carrier < 0;
  const auto place = std::size_t(mapped ? -carrier : carrier);
  const auto& slots = mapped ? slot_of_mesh_ : slot_of_body_;
  if (place >= slots.size() || slots[place] < 0) return;
  const auto slot = std::size_t(slots[place]), dim = std::size_t(s.scene.dim), at = dim * std::size_t(contact);
  ContactLoad& load = (mapped ? of_meshes : of_bodies)[slot];
  double square = 0;
  for (std::size_t k = 0; k < dim; ++k) square += impulse_[at + k] * impulse_[at + k];
  load.force = std::max(load.force, std::sqrt(square));
  if (mapped) return;
  std::array<double, 3> arm{};
  for (std::size_t i = 0; i < dim; ++i) arm[i] = s.candidates.point[at + i] + s.scene.origin[i] - centre_[slot][i];
  // The contact may be one with an image, and the body may have left through the end of the cell since it was found.
  const Cell& cell = s.scene.cell;
  for (std::size_t axis = dim; axis-- > 0;) {
    if (!cell.periodic[axis]) continue;
    const double turns = std::rint(arm[axis] / cell.vectors[4 * axis]);
    for (std::size_t i = 0; i < dim; ++i) arm[i] -= turns * cell.vectors[i + 3 * axis];
  }
  const double sign = other ? -1 : 1; // impulses are those on the candidate
  for (std::size_t i = 0; i < dim; ++i)
    for (std::size_t k = 0; k < dim; ++k) load.moment[3 * k + i] += sign * impulse_[at + k] * arm[i];
}

} // namespace cairn
