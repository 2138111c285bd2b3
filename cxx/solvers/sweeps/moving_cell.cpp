#include "moving_cell.hpp"

#include <algorithm>

#include "batch.hpp"

namespace cairn {

void shift_bias(const ContactSystem& system, const AcrossBoundary& place, int dim, const double* change) {
  const cairn_batch& b = system.batches[std::size_t(place.batch)];
  double v[3] = {0, 0, 0}, axes[3][3] = {};
  for (int j = 0; j < dim; ++j)
    for (int i = 0; i < dim; ++i) v[i] += change[i + 3 * j] * place.shift[j];
  axes_of(b, dim, place.lane, axes);
  for (int c = 0; c < dim; ++c) {
    double along = 0;
    for (int i = 0; i < dim; ++i) along += axes[c][i] * v[i];
    at(b, b.bias, place.lane, c) -= along;
  }
}

void MovingCell::begin(const Cell& cell, int dim, double h, const ContactSystem& system, const std::int32_t* image) {
  dim_ = dim;
  places_.clear();
  double mobile = 0;
  for (std::size_t k = 0; k < system.batches.size(); ++k) {
    const cairn_batch& b = system.batches[k];
    for (std::int32_t lane = 0; lane < b.contacts; ++lane) {
      const std::int32_t of = image[system.candidate[b.first + lane]];
      if (of == own_image) continue;
      AcrossBoundary place{std::int32_t(k), lane, {}};
      image_shift(cell, of, place.shift);
      places_.push_back(place);
      if (b.delassus[lane] > 0) mobile += 1 / b.delassus[lane];
    }
  }
  const double mass = std::max(cell.mass, 2 * mobile), volume = cell.volume(dim);
  over_ = 1 / (h * volume);
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) {
      const int e = i + 3 * j;
      const double length = cell.vectors[4 * j];
      inverse_[e] = cell.follows[e] ? 1 / (mass * length * length) : 0;
      rate_[e] = cell.velocity_gradient[e];
      free_[e] = rate_[e] - (cell.follows[e] ? h * cell.pressure[e] * volume * inverse_[e] : 0);
      sum_[e] = 0;
    }
}

void MovingCell::follow(ContactSystem& system) {
  double change[9], axes[3][3] = {};
  std::fill(std::begin(sum_), std::end(sum_), 0.0);
  for (const AcrossBoundary& place : places_) {
    const cairn_batch& b = system.batches[std::size_t(place.batch)];
    axes_of(b, dim_, place.lane, axes);
    for (int i = 0; i < dim_; ++i) {
      double p = 0;
      for (int c = 0; c < dim_; ++c) p += axes[c][i] * at(b, b.r, place.lane, c);
      for (int j = 0; j < dim_; ++j) sum_[i + 3 * j] -= p * place.shift[j];
    }
  }
  bool moved = false;
  for (int e = 0; e < 9; ++e) {
    const double now = inverse_[e] > 0 ? free_[e] + inverse_[e] * sum_[e] : rate_[e];
    change[e] = now - rate_[e];
    moved = moved || change[e] < 0 || change[e] > 0;
    rate_[e] = now;
  }
  if (!moved) return;
  for (const AcrossBoundary& place : places_) shift_bias(system, place, dim_, change);
}

void MovingCell::end(Cell& cell) const {
  std::copy(std::begin(rate_), std::end(rate_), cell.velocity_gradient);
  for (int e = 0; e < 9; ++e) cell.stress[e] = over_ * sum_[e];
}

} // namespace cairn
