// Inputs of users' routines at the Gauss points of some cells, and the stress at large strains from their results.
#include <cmath>

#include "bulk_work.hpp"
#include "umat.hpp"

namespace cairn {

// Places of the points [m]: as Abaqus, where the body lies now if strains are large, else where it lay at the start.
void BulkModel::find_places(std::size_t block, std::int64_t n, Work& w) const {
  const BulkCells& c = cells_[block];
  const Block& b = blocks_[block];
  const int nodes = c.element->nodes, points = c.element->bulk_points;
  const double moved = c.kinematics == Kinematics::small ? 0 : 1;
  w.place.resize(std::max(w.place.size(), std::size_t(3 * points * bulk_tile)));
  std::fill_n(w.place.data(), 3 * points * n, 0.0);
  for (std::int64_t cell = 0; cell < n; ++cell)
    for (int p = 0; p < points; ++p)
      for (int a = 0; a < nodes; ++a)
        for (int k = 0; k < dim_; ++k) {
          const auto at = std::size_t((cell * nodes + a) * dim_ + k);
          w.place[std::size_t(3 * (cell * points + p) + k)] +=
              b.value[std::size_t(p * nodes + a)] * (w.x[at] + moved * w.u[at]);
        }
}

void BulkModel::call_umat(std::size_t block, std::int64_t first, std::int64_t n, double h, Work& w) {
  const BulkCells& c = cells_[block];
  const Block& b = blocks_[block];
  const int points = c.element->bulk_points;
  const std::int64_t start = b.first_state + first * points * b.states;
  find_places(block, n, w);
  const bool large = c.kinematics != Kinematics::small;
  const int direct = c.material->plane_stress ? 2 : 3, shear = dim_ == 2 ? 1 : 3;
  const double step = std::isfinite(h) ? h : 1; // at rest no time passes, and routines divide by theirs
  const UmatCall call{*c.material, c.params, large, direct, shear, first, points, step, begin_time_};
  const UmatArrays arrays{state_begin_.data() + start,
                          w.strain.data(),
                          w.h_bar.data(),
                          w.rotation.data(),
                          w.length.data(),
                          w.place.data(),
                          state_.data() + start,
                          w.stress.data(),
                          w.moduli.data(),
                          w.energy.data(),
                          w.dissipated.data(),
                          w.status.data()};
  // what a user wrote need not bear two threads at once
#pragma omp critical(cairn_umat)
  {
    if (c.material->time_limit > 0)
      call_umat_apart(call, n * points, arrays);
    else
      call_umat_points(call, n * points, arrays);
    for (std::int64_t p = 0; p < n * points && blocks_[block].silent; ++p)
      for (int k = 0; k < 3; ++k) {
        const double told = arrays.state[p * b.states + umat_energy + k];
        blocks_[block].silent = blocks_[block].silent && !(told < 0 || told > 0);
      }
  }
}

// Stress from the gradients in h_bar, by the strain increment and the rotation of the step.
void BulkModel::rates_at_points(std::size_t block, std::int64_t first, std::int64_t n, double h, bool want, Work& w) {
  const Block& b = blocks_[block];
  const int each = cells_[block].element->bulk_points;
  const std::int64_t points = n * each;
  const double* state = state_begin_.data() + b.first_state + first * each * b.states + umat_gradient;
  for (Array<double>* a : {&w.before, &w.rotation}) a->resize(std::max(a->size(), std::size_t(9 * each * bulk_tile)));
  for (std::int64_t p = 0; p < points; ++p) std::copy_n(state + p * b.states, 9, &w.before[std::size_t(9 * p)]);
  cairn_step_strain(points, w.before.data(), w.h_bar.data(), w.strain.data(), w.rotation.data(), w.status.data());
  call_umat(block, first, n, h, w);
  cairn_stress_of_rate(points, w.h_bar.data(), w.stress.data(), w.moduli.data(), want, w.piola.data(),
                       w.tangent.data());
}

// Stretch across the thickness at large strains for routines for plane stress, which find that strain themselves:
// isochoric as in Abaqus, so that their Cauchy stress equals that per initial volume.
void BulkModel::keep_volume(std::int64_t points, Work& w) {
  for (std::int64_t p = 0; p < points; ++p) {
    double* h = &w.h_bar[std::size_t(9 * p)];
    const double growth = h[0] + h[4] + h[0] * h[4] - h[1] * h[3];
    h[8] = -growth / (1 + growth);
  }
}

// In plane stress the strain across is sought from where the step begins: a law of rates is asked for no more than the
// step changes.
void BulkModel::start_from_thickness(std::size_t block, std::int64_t first, std::int64_t n, Work& w) const {
  if (cells_[block].kinematics == Kinematics::small) return;
  const Block& b = blocks_[block];
  const int each = cells_[block].element->bulk_points;
  const double* state = state_begin_.data() + b.first_state + first * each * b.states + umat_gradient;
  for (std::int64_t p = 0; p < n * each; ++p) w.h_bar[std::size_t(9 * p + 8)] = state[p * b.states + 8];
}

} // namespace cairn
