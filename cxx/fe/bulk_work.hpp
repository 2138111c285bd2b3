// Work arrays of a thread at the Gauss points of some cells while their stresses are found.
#pragma once
#include <algorithm>

#include "bulk_model.hpp"

namespace cairn {

inline constexpr std::int64_t bulk_tile = 16; // cells whose points a material gets at once

// A cell of all products of parabolas bears a dilatation that is linear over it, any other a constant one: pressures
// would oscillate with more (Brezzi & Fortin 1991).
inline bool linear_dilatation(const BulkCells& c) {
  const int dim = c.element->dim;
  return c.mean_dilatation && c.element->order == 2 && c.element->nodes == (dim == 2 ? 9 : 27);
}
inline std::int32_t mean_of(const BulkCells& c) {
  if (!c.mean_dilatation) return 0;
  return (c.kinematics == Kinematics::small ? 1 : 2) + (linear_dilatation(c) ? 2 : 0);
}

// Strain across the thickness at points: of the pass before, and the bracket that Newton's method has found.
struct BulkAcross {
  Array<double> before, pressed, pulled;
};

struct BulkModel::Work {
  Array<double> x, u, d, hoop, h, h_bar, volume, piola, tangent, strain, stress, moduli, energy, dissipated, length,
      state, swelling;
  Array<double> share;                                // of a linear dilatation
  Array<double> begin, end, energy_begin, energy_end; // of stresses by energy: F - 1 at both ends of the step
  Array<double> place, before, rotation;              // of users' routines: points, F - 1 at the begin, of the step
  BulkAcross across;
  Array<double> drive, drive_piola, growth, pull; // of one damage a cell
  Array<double> apart;                            // F - 1 while the law sees that of its stretch at the start
  Array<std::int32_t> status;
  void resize(int dim, const ElementInfo& e, int states, bool linear) {
    const std::size_t n = bulk_tile, points = n * e.bulk_points, nodes = std::size_t(e.nodes);
    const auto most = [](Array<double>& a, std::size_t size) { a.resize(std::max(a.size(), size)); };
    most(x, dim * nodes * n);
    most(u, dim * nodes * n);
    most(d, dim * nodes * points);
    most(hoop, nodes * points);
    for (Array<double>* a : {&h, &h_bar, &piola}) most(*a, 9 * points);
    most(tangent, 81 * points);
    most(strain, 6 * points);
    most(stress, 6 * points);
    most(moduli, 36 * points);
    for (Array<double>* a :
         {&volume, &energy, &dissipated, &length, &swelling, &across.before, &across.pressed, &across.pulled})
      most(*a, points);
    most(state, std::max<std::size_t>(1, std::size_t(states)) * points);
    status.resize(std::max(status.size(), points));
    most(share, linear ? points * std::size_t(e.bulk_points) : 1);
  }
  void keep_drive(int dofs, std::size_t points) {
    const auto most = [](Array<double>& a, std::size_t size) { a.resize(std::max(a.size(), size)); };
    most(drive, 6 * points);
    most(drive_piola, 9 * points);
    most(growth, bulk_tile);
    most(pull, std::size_t(dofs) * bulk_tile);
  }
  void keep_begin(std::size_t points) {
    for (Array<double>* a : {&begin, &end}) a->resize(std::max(a->size(), 9 * points));
    for (Array<double>* a : {&energy_begin, &energy_end}) a->resize(std::max(a->size(), points));
  }
};

} // namespace cairn
