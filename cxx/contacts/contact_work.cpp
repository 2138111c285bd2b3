#include "contact_work.hpp"

#include <algorithm>
#include <cmath>

#include "../base/held_bytes.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "surface_motion.hpp"

namespace cairn {

// Surfaces that move along bodies and the image of B add to the relative velocities of contacts, and bodies do not see
// it.
void ContactWork::measure(const cairn_schedule& schedule) {
  fit(sums_, 4 * system_.batches.size());
  cairn_contact_work(&schedule, sums_.data());
}

void ContactWork::book() {
  if (in_.has_jumps()) count_jump_work();
  for (std::size_t b = 0; b < system_.batches.size(); ++b) {
    const double* sums = &sums_[4 * b];
    energy_.normal -= 0.5 * sums[0];
    energy_.tangential -= 0.5 * sums[1];
    energy_.created += 0.5 * sums[2];
    energy_.turned_over += 0.5 * sums[3];
  }
}

std::int64_t ContactWork::bytes() const { return held_bytes(sums_); }

void ContactWork::count_jump_work() {
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    if (!has_jumps(in_, &system_.candidate[b.first], b.contacts)) continue;
    double* sums = &sums_[4 * k];
    sums[2] = sums[3] = 0;
    for (int lane = 0; lane < b.contacts; ++lane) {
      double jump[6 * 128];
      const int n = b.count;
      for (int c = 0; c < b.components; ++c) jump[c * n + lane] = 0;
      add_jump(in_, system_, b, lane, jump);
      double normal = b.r[lane] * jump[lane], tangential = 0;
      for (int c = 1; c < b.components; ++c) tangential += b.r[c * n + lane] * jump[c * n + lane];
      energy_.jump_work -= normal + tangential;
      sums[0] += 2 * normal;
      sums[1] += 2 * tangential;
      b.scale[lane] += 2 * (normal + tangential);
      sums[2] += std::max(0.0, b.scale[lane]);
      sums[3] += std::abs(b.scale[lane]);
    }
  }
}

} // namespace cairn
