// Work of the impulses that a step begins from over its free velocities, which tells a stale start from a good one.
#pragma once
#include <algorithm>

#include "batch.hpp"

namespace cairn {

// add(work) of each contact: of its impulses over the free velocities, which the records hold, bias included [J]. It is
// the slope of 1/2 a^2 r.W r + a r.(u_free + bias) at a share a = 0 of the impulses r; contacts without friction take
// the impulses that make this energy least. Where the sum is above 0 bodies part already, and any share of the impulses
// raises the energy. Those that carry bodies at rest have a sum below 0, however far they are from the solution.
template <class F>
void add_start_work(const ContactSystem& system, const cairn_schedule& schedule, F&& add) {
  double u[6 * 128];
  for (std::size_t k = 0; k < system.batches.size(); ++k) {
    const cairn_batch& b = system.batches[k];
    cairn_relative_velocities(&schedule, std::int32_t(k), 0, u);
    for (int lane = 0; lane < b.contacts; ++lane) {
      double work = 0;
      for (int c = 0; c < b.components; ++c) {
        const double r = at(b, b.r, lane, c);
        if (!(r > 0 || r < 0)) continue; // its bias may be none
        work += r * (u[c * b.count + lane] + (b.pack && c > 0 ? 0 : at(b, b.bias, lane, c)));
      }
      add(work);
    }
  }
}

// True if all contacts have friction cones, and none is a bond or a law with a solution of its own.
inline bool all_cones(const ContactSystem& system) {
  return std::all_of(system.batches.begin(), system.batches.end(),
                     [](const cairn_batch& b) { return b.relaxes != 0 && b.bonds == 0; });
}

} // namespace cairn
