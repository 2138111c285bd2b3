#include "detection_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cairn/core.h"

namespace cairn {

namespace {

constexpr int most_levels = 40;
constexpr double largest_product = 0x1p57; // keys in all
constexpr double farthest = 0x1p61;        // as in grid_levels.f90

std::int64_t cell_coordinate(double x, double inverse_cell) {
  return std::int64_t(std::floor(std::max(-farthest, std::min(x * inverse_cell, farthest))));
}

int level_of(double reach, double unit) {
  const double t = reach * (1 / unit);
  return t > 0x1p-1000 ? std::ilogb(t) + 1 : -1000;
}

} // namespace

void DetectionGrid::build(int dim, std::int64_t n, const double* x, const double* reach, Scratch& scratch,
                          const std::int8_t* apart) {
  dim_ = dim;
  n_ = n;
  cells_ = 0;
  if (n == 0) return;
  coarsening_ = 0;
  level_ = scratch.take<std::int32_t>(n + 1);
  order_ = scratch.take<std::int32_t>(n);
  key_ = scratch.take<std::int64_t>(n);
  cell_key_ = scratch.take<std::int64_t>(n + 1);
  sorted_ = scratch.take<double>(n * (dim + 1));
  choose_unit(reach);
  assign_levels(x, reach, apart);
  while (!lay_out(x)) {
    ++coarsening_; // wider cells hold more than they need, and still all they must
  }
  in_slices(n, [&](std::int64_t first, std::int64_t last) {
    cairn_grid_keys(dim, first, last, x, level_, levels_.lowest, levels_.highest, levels_.inverse_cell.data(),
                    levels_.origin.data(), levels_.stride.data(), levels_.first_key.data(), levels_.table_first.data(),
                    levels_.table_size.data(), table_.data(), table_place_.data(), key_);
  });
  // levels are in the keys from here on
  cairn_sort_keys(n, largest_key_, key_, order_, cell_key_, level_);
  cell_start_ = level_;
  cairn_grid_cells(n, key_, cell_key_, cell_start_, &cells_);
  in_slices(n, [&](std::int64_t first, std::int64_t last) {
    cairn_grid_gather(dim, n, first, last, order_, x, reach, sorted_);
  });
  levels_.first_cell.resize(levels_.count() + 1);
  for (std::size_t l = 0; l < levels_.count(); ++l)
    levels_.first_cell[l] = std::lower_bound(cell_key_, cell_key_ + cells_, levels_.first_key[l]) - cell_key_;
  levels_.first_cell.back() = cells_;
}

// Chooses the unit of length whose doublings give the best cells for most items: results do not depend on it, time
// does.
void DetectionGrid::choose_unit(const double* reach) {
  std::int64_t items[16];
  double widest[16], smallest = 0, largest = 0;
  cairn_grid_classes(n_, reach, items, widest, &smallest, &largest);
  double best = std::numeric_limits<double>::infinity();
  for (int b = 0; b < 16; ++b) {
    if (items[b] == 0) continue;
    double tests = 0;
    for (int k = 0; k < 16; ++k)
      tests += items[k] * std::pow((widest[k] <= widest[b] ? 1 : 2) * widest[b] / widest[k], dim_);
    if (tests < best) {
      best = tests;
      unit_ = widest[b] * (1 + 0x1p-20);
    }
  }
  levels_.highest = level_of(largest, unit_);
  levels_.lowest = std::max(level_of(smallest, unit_), levels_.highest - most_levels + 1);
}

void DetectionGrid::assign_levels(const double* x, const double* reach, const std::int8_t* apart) {
  const std::size_t count = levels_.count();
  levels_.items.assign(count, 0);
  levels_.low.assign(3 * count, std::numeric_limits<double>::infinity());
  levels_.high.assign(3 * count, -std::numeric_limits<double>::infinity());
  cairn_grid_level(0, n_, reach, unit_, levels_.lowest, levels_.highest, level_, levels_.items.data());
  cairn_grid_box(dim_, 0, n_, x, level_, levels_.lowest, levels_.highest, levels_.low.data(), levels_.high.data());
  levels_.apart.assign(count, apart ? 1 : 0);
  for (std::int64_t i = 0; apart && i < n_; ++i)
    if (!apart[i]) levels_.apart[std::size_t(level_[i] - levels_.lowest)] = 0;
}

bool DetectionGrid::lay_out(const double* x) {
  const std::size_t count = levels_.count();
  levels_.inverse_cell.assign(count, 0);
  for (auto* array : {&levels_.origin, &levels_.extent, &levels_.stride, &levels_.table_first, &levels_.table_size})
    array->assign(3 * count, 0);
  levels_.first_key.assign(count, 0);
  table_.clear();
  table_place_.clear();
  double keys = 0;
  std::int64_t next = 0;
  for (std::size_t l = 0; l < count; ++l) {
    levels_.inverse_cell[l] = std::ldexp(0.5 / unit_, -(levels_.lowest + int(l) + coarsening_));
    levels_.first_key[l] = next;
    if (levels_.items[l] == 0) continue;
    double product = 1;
    for (int k = 0; k < dim_; ++k) {
      const std::int64_t low = cell_coordinate(levels_.low[k + 3 * l], levels_.inverse_cell[l]);
      levels_.origin[k + 3 * l] = low - 1;
      levels_.extent[k + 3 * l] = cell_coordinate(levels_.high[k + 3 * l], levels_.inverse_cell[l]) - low + 1;
      product *= double(levels_.extent[k + 3 * l]) + 2;
    }
    if (product > largest_product / most_levels) {
      product = 1;
      for (int k = 0; k < dim_; ++k) {
        pack_axis(l, k, x);
        product *= double(levels_.extent[k + 3 * l]) + 2;
      }
    }
    keys += product;
    if (keys > largest_product) return false;
    std::int64_t stride = 1;
    for (int k = 0; k < dim_; ++k) {
      levels_.stride[k + 3 * l] = stride;
      stride *= levels_.extent[k + 3 * l] + 2;
    }
    next += stride;
  }
  largest_key_ = next;
  return true;
}

// Cuts short the stretches of an axis where a level has no items.
void DetectionGrid::pack_axis(std::size_t level, int axis, const double* x) {
  const std::size_t first = table_.size();
  for (std::int64_t i = 0; i < n_; ++i)
    if (level_[i] == levels_.lowest + int(level))
      table_.push_back(cell_coordinate(x[axis + dim_ * i], levels_.inverse_cell[level]));
  std::sort(table_.begin() + first, table_.end());
  table_.erase(std::unique(table_.begin() + first, table_.end()), table_.end());
  table_place_.resize(table_.size());
  table_place_[first] = 1;
  for (std::size_t i = first + 1; i < table_.size(); ++i)
    table_place_[i] = table_place_[i - 1] + std::min<std::int64_t>(table_[i] - table_[i - 1], 4);
  levels_.table_first[axis + 3 * level] = std::int64_t(first);
  levels_.table_size[axis + 3 * level] = std::int64_t(table_.size() - first);
  levels_.extent[axis + 3 * level] = table_place_.back();
}

std::int64_t DetectionGrid::search(std::int64_t first, std::int64_t last, Array<std::int32_t>& hits) const {
  for (;;) {
    std::int64_t found = 0, needed = 0;
    const std::int64_t capacity = std::int64_t(hits.size()) / 2;
    cairn_grid_search(dim_, n_, sorted_, cells_, first, last, cell_key_, cell_start_, std::int32_t(levels_.count()),
                      levels_.first_cell.data(), levels_.inverse_cell.data(), levels_.origin.data(),
                      levels_.extent.data(), levels_.stride.data(), levels_.first_key.data(),
                      levels_.table_first.data(), levels_.table_size.data(), table_.data(), table_place_.data(),
                      levels_.apart.data(), capacity, hits.data(), &found, &needed);
    if (needed <= capacity) return found;
    hits.resize(2 * (needed + needed / 4 + 1024));
  }
}

std::size_t DetectionGrid::bytes() const {
  return sizeof(std::int64_t) * (table_.capacity() + table_place_.capacity());
}

} // namespace cairn
