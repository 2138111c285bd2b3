// Damage common to all points of a cell with quadratic shape functions. Strains vary over such a cell: with damage of
// their own, points would soften one after the other, some of them never, and the fracture energy of a crack would be
// wrong.
#include <algorithm>

#include "bulk_model.hpp"
#include "bulk_work.hpp"
#include "shared_damage.hpp"

namespace cairn {

bool BulkModel::one_damage(std::size_t block) const {
  return cells_[block].element->order > 1 && cells_[block].material->name == "isotropic_damage";
}

// Stress of the damaged material from the measured strains; arguments as in the kernel of the material.
void BulkModel::damage_cells(std::size_t block, std::int64_t first, std::int64_t n, Work& w) {
  const BulkCells& c = cells_[block];
  const Block& b = blocks_[block];
  const std::int64_t at = b.first_state + first * c.element->bulk_points * b.states;
  w.keep_drive(dim_ * c.element->nodes, std::size_t(bulk_tile * c.element->bulk_points));
  damage_of_cells()(c.element->bulk_points, n, c.params.data(), w.length.data(), w.volume.data(), w.strain.data(),
                    state_begin_.data() + at, state_.data() + at, w.stress.data(), w.moduli.data(), w.drive.data(),
                    w.growth.data(), w.energy.data(), w.dissipated.data(), w.status.data());
}

// Adds the derivative of damage to the stiffness of cells whose forces are known: damage depends on the strains of all
// points of the cell.
void BulkModel::add_growth_of_damage(std::size_t block, std::int64_t n, Work& w, const double* force,
                                     double* stiffness) const {
  const BulkCells& c = cells_[block];
  const ElementInfo& e = *c.element;
  const std::int64_t points = n * e.bulk_points;
  if (std::none_of(w.growth.data(), w.growth.data() + n, [](double growth) { return growth > 0; })) return;
  const bool flat = dim_ == 2 && c.plane == Plane::stress;
  const double across = c.params[1] / (1 - c.params[1]); // of the strain there, by those in the plane
  for (std::int64_t p = 0; p < points && flat; ++p) {
    double* drive = &w.drive[std::size_t(6 * p)];
    for (int k = 0; k < 2; ++k) drive[k] -= across * drive[2];
    drive[2] = 0;
  }
  cairn_stress_of_measure(std::int32_t(c.kinematics), points, w.h_bar.data(), w.drive.data(), w.moduli.data(), 0,
                          w.drive_piola.data(), w.tangent.data());
  cairn_solid_forces(dim_, dim_ == 2 ? std::int32_t(c.plane) : 0, mean_of(c), e.nodes, e.bulk_points, n, w.d.data(),
                     w.hoop.data(), w.h.data(), w.volume.data(), w.share.data(), w.drive_piola.data(), w.tangent.data(),
                     0, w.pull.data(), stiffness);
  const std::int64_t dofs = dim_ * e.nodes;
  for (std::int64_t cell = 0; cell < n; ++cell) {
    const double growth = w.growth[std::size_t(cell)];
    if (!(growth > 0)) continue;
    for (std::int64_t j = 0; j < dofs; ++j) {
      const double by = growth * w.pull[std::size_t(cell * dofs + j)];
      for (std::int64_t i = 0; i < dofs; ++i) stiffness[(cell * dofs + j) * dofs + i] -= force[cell * dofs + i] * by;
    }
  }
}

} // namespace cairn
