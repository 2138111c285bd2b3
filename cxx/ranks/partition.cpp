#include "partition.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace cairn {

std::vector<std::int32_t> cut_curve(std::span<const std::int64_t> cost, int ranks) {
  using Wide = unsigned __int128;
  const std::int64_t total = std::max<std::int64_t>(std::accumulate(cost.begin(), cost.end(), std::int64_t(0)), 1);
  std::vector<std::int32_t> owner(cost.size());
  std::int64_t before = 0;
  for (std::size_t i = 0; i < cost.size(); ++i) { // by the middle of each body
    const Wide middle = Wide(2 * before + cost[i]) * Wide(ranks);
    owner[i] = std::int32_t(std::min<std::int64_t>(ranks - 1, std::int64_t(middle / Wide(2 * total))));
    before += cost[i];
  }
  return owner;
}

std::vector<std::uint8_t> bodies_everywhere(std::span<const double> radius, std::span<const std::uint8_t> fixed) {
  constexpr double far_larger = 8; // than the median
  std::vector<double> bounded;
  for (std::size_t i = 0; i < radius.size(); ++i)
    if (!fixed[i] && std::isfinite(radius[i])) bounded.push_back(radius[i]);
  double median = std::numeric_limits<double>::infinity();
  if (!bounded.empty()) {
    const auto middle = bounded.begin() + std::ptrdiff_t(bounded.size() / 2);
    std::nth_element(bounded.begin(), middle, bounded.end());
    median = *middle;
  }
  std::vector<std::uint8_t> everywhere(radius.size());
  for (std::size_t i = 0; i < radius.size(); ++i)
    everywhere[i] = fixed[i] || !std::isfinite(radius[i]) || radius[i] > far_larger * median;
  return everywhere;
}

bool near(const Surroundings& s, std::int64_t i, std::int64_t j) {
  double between[3] = {0, 0, 0}, square = 0;
  for (int k = 0; k < s.dim; ++k) between[k] = s.position[s.dim * i + k] - s.position[s.dim * j + k];
  for (int k = s.dim - 1; k >= 0; --k) {
    if (!s.cell.periodic[k]) continue;
    const double* vector = s.cell.vectors + 3 * k;
    const double turns = std::round(between[k] / vector[k]);
    for (int l = 0; l <= k; ++l) between[l] -= turns * vector[l];
  }
  for (int k = 0; k < s.dim; ++k) square += between[k] * between[k];
  const double limit = s.radius[i] + s.radius[j] + s.reach;
  return square <= limit * limit;
}

namespace {

// Cells of a grid that are wide enough for the ghosts of a body to stand in its own or a neighbouring one; along
// periodic axes in shares of the cell, and the first is beside the last.
class GhostGrid {
public:
  explicit GhostGrid(const Surroundings& s) : s_(s) {
    for (std::int64_t i = 0; i < s.count; ++i)
      if (!s.everywhere[i]) widest_ = std::max(widest_, s.radius[i]);
    place_cells();
    count_bodies();
  }

  // f(j) of each body that is no farther from body i than reach allows, itself too
  template <class F>
  void each_near(std::int64_t i, F&& f) const {
    std::int64_t at[3];
    cell_of(i, at);
    std::int64_t first[3] = {0, 0, 0}, last[3] = {0, 0, 0};
    for (int k = 0; k < s_.dim; ++k) {
      const bool all = s_.cell.periodic[k] && number_[k] < 3;
      first[k] = all ? 0 : at[k] - 1;
      last[k] = all ? number_[k] - 1 : at[k] + 1;
    }
    for (std::int64_t z = first[2]; z <= last[2]; ++z)
      for (std::int64_t y = first[1]; y <= last[1]; ++y)
        for (std::int64_t x = first[0]; x <= last[0]; ++x) {
          const std::int64_t cell = number_of(x, y, z);
          if (cell < 0) continue;
          for (std::int64_t k = start_[std::size_t(cell)]; k < start_[std::size_t(cell) + 1]; ++k)
            if (near(s_, i, item_[std::size_t(k)])) f(item_[std::size_t(k)]);
        }
  }

private:
  void place_cells() {
    const double wide = 2 * widest_ + s_.reach;
    double low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
    bool any = false;
    for (std::int64_t i = 0; i < s_.count; ++i) {
      if (s_.everywhere[i]) continue;
      for (int k = 0; k < s_.dim; ++k) {
        const double x = s_.position[s_.dim * i + k];
        low[k] = any ? std::min(low[k], x) : x;
        high[k] = any ? std::max(high[k], x) : x;
      }
      any = true;
    }
    double length[3] = {0, 0, 0}, cells = 1, most = 8.0 * double(s_.count) + 64;
    for (int k = 0; k < s_.dim; ++k) {
      length[k] = s_.cell.periodic[k] ? width_of_cell(k) : high[k] - low[k];
      low_[k] = low[k];
      if (wide > 0) cells *= std::max(1.0, length[k] / wide);
    }
    double factor = 1; // bodies that are far apart ask for wider cells
    while (cells > most) cells /= 2, factor *= s_.dim == 2 ? std::sqrt(2.0) : std::cbrt(2.0);
    for (int k = 0; k < s_.dim; ++k) {
      width_[k] = wide > 0 ? factor * wide : std::max(length[k], 1.0);
      const double along = std::min(length[k] / width_[k], most);
      number_[k] = std::int64_t(along) + (s_.cell.periodic[k] ? 0 : 1);
      if (s_.cell.periodic[k]) number_[k] = std::max<std::int64_t>(number_[k], 1);
      if (!s_.cell.periodic[k] && along >= most) width_[k] = length[k] / double(number_[k] - 1);
    }
  }

  // Distance between the faces of the periodic cell across an axis: vectors are upper triangular.
  double width_of_cell(int axis) const {
    double size = s_.cell.vectors[3 * axis + axis]; // of a vector that does not lean
    double lean = 0;
    for (int k = axis + 1; k < s_.dim; ++k)
      lean += std::abs(s_.cell.vectors[3 * k + axis] / s_.cell.vectors[3 * k + k]);
    return size / (1 + lean);
  }

  void cell_of(std::int64_t i, std::int64_t at[3]) const {
    const double* x = s_.position + s_.dim * i;
    double share[3] = {0, 0, 0};
    at[0] = at[1] = at[2] = 0;
    for (int k = s_.dim - 1; k >= 0; --k) { // shares of the cell vectors, from the last one on
      if (!s_.cell.periodic[k]) {
        at[k] = std::int64_t(std::floor((x[k] - low_[k]) / width_[k]));
        continue;
      }
      double rest = x[k] - s_.cell.corner[k];
      for (int l = k + 1; l < s_.dim; ++l) rest -= share[l] * s_.cell.vectors[3 * l + k];
      share[k] = rest / s_.cell.vectors[3 * k + k];
      const double within = share[k] - std::floor(share[k]);
      at[k] = std::min(std::int64_t(within * double(number_[k])), number_[k] - 1);
    }
  }

  std::int64_t number_of(std::int64_t x, std::int64_t y, std::int64_t z) const {
    std::int64_t at[3] = {x, y, z}, number = 0;
    for (int k = 2; k >= 0; --k) {
      if (k < s_.dim && s_.cell.periodic[k])
        at[k] = (at[k] + number_[k]) % number_[k];
      else if (at[k] < 0 || at[k] >= number_[k])
        return -1;
      number = number * number_[k] + at[k];
    }
    return number;
  }

  void count_bodies() {
    start_.assign(std::size_t(number_[0] * number_[1] * number_[2] + 1), 0);
    std::vector<std::int64_t> cell(std::size_t(s_.count), -1);
    for (std::int64_t i = 0; i < s_.count; ++i) {
      if (s_.everywhere[i]) continue;
      std::int64_t at[3];
      cell_of(i, at);
      cell[std::size_t(i)] = number_of(at[0], at[1], at[2]);
      ++start_[std::size_t(cell[std::size_t(i)]) + 1];
    }
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    item_.resize(std::size_t(start_.back()));
    std::vector<std::int64_t> next(start_.begin(), start_.end() - 1);
    for (std::int64_t i = 0; i < s_.count; ++i)
      if (cell[std::size_t(i)] >= 0) item_[std::size_t(next[std::size_t(cell[std::size_t(i)])]++)] = std::int32_t(i);
  }

  const Surroundings& s_;
  double widest_ = 0, low_[3] = {0, 0, 0}, width_[3] = {1, 1, 1};
  std::int64_t number_[3] = {1, 1, 1};
  std::vector<std::int64_t> start_;
  std::vector<std::int32_t> item_;
};

} // namespace

std::vector<std::vector<std::int32_t>> find_ghosts(const Surroundings& s, std::span<const int> ranks) {
  std::vector<std::vector<std::int32_t>> ghosts(ranks.size());
  if (s.count == 0) return ghosts;
  const GhostGrid grid(s);
  for (std::int64_t i = 0; i < s.count; ++i) {
    if (s.everywhere[i]) continue;
    const auto rank = std::lower_bound(ranks.begin(), ranks.end(), s.owner[i]);
    if (rank == ranks.end() || *rank != s.owner[i]) continue;
    auto& of_rank = ghosts[std::size_t(rank - ranks.begin())];
    grid.each_near(i, [&](std::int32_t j) {
      if (s.owner[j] != s.owner[i]) of_rank.push_back(j);
    });
  }
  for (auto& of_rank : ghosts) {
    std::sort(of_rank.begin(), of_rank.end());
    of_rank.erase(std::unique(of_rank.begin(), of_rank.end()), of_rank.end());
  }
  return ghosts;
}

} // namespace cairn
