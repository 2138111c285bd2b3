#include "ranked_cell.hpp"

#include <algorithm>

#include "../contacts/assembly_input.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "ranked_sweeps.hpp"

namespace cairn {

void RankedCell::begin(const std::vector<Part>& parts, double h, Exchange& exchange) {
  const Cell& cell = parts[0].simulation->scene.cell;
  dim_ = parts[0].simulation->scene.dim;
  ExactSum mobile[1];
  for (const Part& part : parts) {
    const ContactSystem& system = part.simulation->interactions.system();
    auto& places = places_.emplace_back();
    for (std::size_t k = 0; k < system.batches.size(); ++k) {
      const cairn_batch& b = system.batches[k];
      for (std::int32_t lane = 0; lane < b.contacts; ++lane) {
        const std::int32_t candidate = system.candidate[std::size_t(b.first + lane)];
        const std::int32_t image = part.simulation->candidates.image[std::size_t(candidate)];
        if (image == own_image) continue;
        AcrossBoundary place{std::int32_t(k), lane, {}};
        image_shift(cell, image, place.shift);
        places.push_back(place);
        if (b.delassus[lane] > 0) mobile[0].add(1 / b.delassus[lane]);
      }
    }
  }
  add_over_ranks(mobile, exchange);
  const double mass = std::max(cell.mass, 2 * mobile[0].value()), volume = cell.volume(dim_);
  over_ = 1 / (h * volume);
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) {
      const int e = i + 3 * j;
      const double length = cell.vectors[4 * j];
      inverse_[e] = cell.follows[e] ? 1 / (mass * length * length) : 0;
      rate_[e] = cell.velocity_gradient[e];
      free_[e] = rate_[e] - (cell.follows[e] ? h * cell.pressure[e] * volume * inverse_[e] : 0);
    }
  driven_ = true;
  follows_ = cell.moves();
}

// Rates by the impulses at hand, into the biases of contacts across the boundary.
void RankedCell::follow(std::vector<Part>& parts, Exchange& exchange) {
  ExactSum sums[9];
  for (std::size_t l = 0; l < parts.size(); ++l) {
    const ContactSystem& system = parts[l].simulation->interactions.system();
    for (const AcrossBoundary& place : places_[l]) {
      double p[3], m[3];
      space_impulse(dim_, system.batches[std::size_t(place.batch)], place.lane, p, m);
      for (int j = 0; j < dim_; ++j)
        for (int i = 0; i < dim_; ++i) sums[i + 3 * j].add(-p[i] * place.shift[j]);
    }
  }
  add_over_ranks(sums, exchange);
  double change[9];
  for (int e = 0; e < 9; ++e) {
    sum_[e] = sums[e].value();
    const double now = inverse_[e] > 0 ? free_[e] + inverse_[e] * sum_[e] : rate_[e];
    change[e] = now - rate_[e];
    rate_[e] = now;
  }
  if (!follows_) return;
  for (std::size_t l = 0; l < parts.size(); ++l) {
    const ContactSystem& system = parts[l].simulation->interactions.system();
    for (const AcrossBoundary& place : places_[l]) shift_bias(system, place, dim_, change);
  }
}

void RankedCell::end(std::vector<Part>& parts) const {
  for (std::size_t l = 0; l < parts.size() && driven_; ++l) {
    Cell& cell = parts[l].simulation->scene.cell;
    std::copy(std::begin(rate_), std::end(rate_), cell.velocity_gradient);
    for (int e = 0; e < 9; ++e) cell.stress[e] = over_ * sum_[e];
  }
}

} // namespace cairn
