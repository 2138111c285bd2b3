// The error of a step over ranks, from exact sums over the contacts of all: solvers/sweeps/step_error.hpp.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../solvers/sweeps/contact_rounding.hpp"
#include "cairn/rows/contact_terms.h"
#include "ranked_sweeps.hpp"

namespace cairn {

// Scale of the error, from records that hold the free velocity.
void RankedSweeps::measure_free() {
  ExactSum sums[2];
  for (Share& share : shares_) {
    ContactSystem& system = *share.system;
    system.load(share.free());
    cairn_contact_scale(&share.schedule, system.sums.data());
    for (const cairn_batch& b : system.batches)
      for (int lane = 0; lane < b.contacts; ++lane) sums[0].add(b.scale[lane]);
    each_rounding(system, [&](double of_a, double of_b) { sums[1].add(of_a + of_b); });
  }
  add_over_ranks(sums, exchange_);
  free_energy_ = sums[0].value();
  rounding_ = rounding_square * sums[1].value();
  change_ = free_energy_;
  scale_.begin(parts_, mesh_rank_, options_.tolerance, exchange_);
}

// last: the status and the scale of each contact, and the largest of all for the report.
RankedSweeps::Error RankedSweeps::measure(SolveReport* last) {
  const double least_scale = 0x1p-40 * free_energy_ / double(contacts_);
  ExactSum sums[2];             // of errors, of sizes
  double largest[] = {0, 0, 0}; // whether a velocity is no number; error of a contact, distance outside the cone
  for (Share& share : shares_) {
    const ContactSystem& system = *share.system;
    for (std::size_t k = 0; k < system.batches.size(); ++k) {
      const cairn_batch& b = system.batches[k];
      double terms[2 * 128], of_batch[6];
      cairn_contact_terms(&share.schedule, std::int32_t(k), 0, last != nullptr, least_scale, of_batch, terms);
      for (int lane = 0; lane < b.contacts; ++lane) {
        sums[0].add(terms[lane]);
        sums[1].add(terms[b.count + lane]);
      }
      largest[1] = std::max(largest[1], of_batch[2]);
      largest[2] = std::max(largest[2], of_batch[4]);
    }
    for (const cairn_record& r : system.record)
      if (!std::isfinite(r.x[0] + r.x[1] + r.x[2] + r.x[3] + r.x[5])) largest[0] = 1;
  }
  add_over_ranks(sums, exchange_);
  exchange_.largest(largest);
  ++checks_;
  const double residual = sums[0].value(), size = sums[1].value();
  const double scale = scale_.measure(std::max(size, free_energy_), parts_, exchange_);
  Error error;
  error.finite = std::isfinite(residual) && std::isfinite(size) && std::isfinite(scale) &&
                 std::isfinite(free_energy_) && !(largest[0] > 0);
  error.growth = free_energy_ > 0 ? size / free_energy_ : 0;
  error.of_velocities = scale_.of_velocities(residual, size);
  error.square = residual > rounding_ && scale > 0 ? residual / scale : 0;
  if (!error.finite) error.square = std::numeric_limits<double>::infinity();
  if (last) {
    last->worst_error = std::sqrt(largest[1]);
    last->cone_distance = std::sqrt(largest[2]);
  }
  return error;
}

} // namespace cairn
