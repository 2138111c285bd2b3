#include <algorithm>
#include <vector>

#include "cairn/core.h"
#include "interaction_handler.hpp"

namespace cairn {

// The box holds all points but the outermost hundredth on each side of each axis, so that a few far points do not
// coarsen the rest; quantiles move with the points, so that a change of unit by a power of two changes no bit of the
// quotients.
std::vector<std::int32_t> space_filling_order(int dim, std::int64_t count, const double* position) {
  std::vector<std::int32_t> order(count);
  if (count == 0) return order;
  double low[3] = {0, 0, 0}, width[3] = {1, 1, 1}, widest = 0;
  std::vector<double> x(count);
  for (int k = 0; k < dim; ++k) {
    for (std::int64_t i = 0; i < count; ++i) x[i] = position[k + dim * i];
    const std::int64_t edge = count / 100;
    std::nth_element(x.begin(), x.begin() + edge, x.end());
    low[k] = x[edge];
    std::nth_element(x.begin(), x.end() - 1 - edge, x.end());
    const double size = x[count - 1 - edge] - low[k];
    low[k] -= size / 16;
    widest = std::max(widest, size * 1.125);
  }
  for (double& w : width) w = widest > 0 ? widest : 1; // equal scale of all axes, to keep steps along the curve short
  std::vector<std::int64_t> key(count), key_work(count);
  std::vector<std::int32_t> order_work(count);
  cairn_hilbert_keys(dim, count, position, low, width, key.data());
  cairn_sort_keys(count, (std::int64_t(1) << (dim == 2 ? 42 : 60)) - 1, key.data(), order.data(), key_work.data(),
                  order_work.data());
  return order;
}

} // namespace cairn
