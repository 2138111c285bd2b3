// Bodies that grow push each other apart: laws that leave an overlap alone would not see it come from growth.
#include <algorithm>

#include "interaction_state.hpp"

namespace cairn {

// The overlap that growth made in the last step, and no more, is undone within this one. A law whose bias answers to
// overlaps has done it.
void Interactions::State::add_growth(const cairn_batch& b, const double* gap, double* bias) const {
  const int d = dim();
  const auto along = [&](bool mapped, std::int32_t side, double* lever, int lane) {
    if (mapped) return 0.0;
    if (is_radial(side)) return at(b, lever, lane, 0);
    double sum = 0;
    for (int k = 0; k < d; ++k) sum += at(b, lever, lane, k) * at(b, b.frame, lane, k);
    return sum;
  };
  const auto stretch = [&](bool mapped, std::int32_t body) { return mapped ? 0.0 : *bodies->stretch[body]; };
  // (b.l) l.n - b.n l.l/2 of what bent by b
  const auto bent = [&](bool mapped, std::int32_t body, std::int32_t side, double* lever, int lane) {
    if (mapped || !bodies->bend.active || is_radial(side)) return 0.0;
    const double* by = bodies->bend[body];
    double along = 0, across = 0, square = 0, normal = 0;
    for (int k = 0; k < d; ++k) {
      const double l = at(b, lever, lane, k), n = at(b, b.frame, lane, k);
      along += by[k] * l;
      across += l * n;
      square += l * l;
      normal += by[k] * n;
    }
    return along * across - normal * square / 2;
  };
  for (int lane = 0; lane < b.contacts; ++lane) {
    if (!(gap[lane] < 0) || bias[lane] < 0) continue;
    const double grown = stretch(b.mapped_b, b.body_b[lane]) * along(b.mapped_b, b.side_b, b.lever_b, lane) -
                         stretch(b.mapped_a, b.body_a[lane]) * along(b.mapped_a, b.side_a, b.lever_a, lane) +
                         bent(b.mapped_b, b.body_b[lane], b.side_b, b.lever_b, lane) -
                         bent(b.mapped_a, b.body_a[lane], b.side_a, b.lever_a, lane);
    if (grown > 0) bias[lane] -= std::min(grown, -gap[lane]) / h;
  }
}

} // namespace cairn
