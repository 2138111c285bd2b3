// Hierarchical grid of the broad phase: sorts items by cell and finds pairs within reach of each other. It has cells
// only where items are, and levels only for sizes that occur.
#pragma once
#include "../base/scratch.hpp"

namespace cairn {

class DetectionGrid {
public:
  // x (dim, n) and reach (n) [m], finite, reach >= 0. Valid as long as the memory from the scratch. Pairs of two items
  // that stand apart (n, if given) are of no use; levels that have no other items are not searched for them.
  void build(int dim, std::int64_t n, const double* x, const double* reach, Scratch& scratch,
             const std::int8_t* apart = nullptr);

  std::int64_t cells() const { return cells_; }
  const std::int32_t* order() const { return order_; } // item at each place of the sorted order

  // Pairs of places whose reaches meet, found from cells first to last-1, into hits (2, result), which grows as needed.
  std::int64_t search(std::int64_t first, std::int64_t last, Array<std::int32_t>& hits) const;

  std::size_t bytes() const;

private:
  // Data of each level, three per axis where needed. The finest items of more than 40 levels share a level.
  struct Levels {
    std::int32_t lowest = 0, highest = 0;
    std::vector<double> inverse_cell, low, high;
    std::vector<std::int64_t> items, origin, extent, stride, first_key, table_first, table_size, first_cell;
    std::vector<std::int8_t> apart;
    std::size_t count() const { return std::size_t(highest - lowest + 1); }
  };
  void choose_unit(const double* reach);
  void assign_levels(const double* x, const double* reach, const std::int8_t* apart);
  bool lay_out(const double* x); // false: the keys do not fit their bits
  void pack_axis(std::size_t level, int axis, const double* x);

  int dim_ = 2;
  std::int64_t n_ = 0, cells_ = 0, largest_key_ = 0;
  double unit_ = 1;
  int coarsening_ = 0;
  Levels levels_;
  Array<std::int64_t> table_, table_place_;
  // in the scratch
  std::int32_t *level_ = nullptr, *order_ = nullptr, *cell_start_ = nullptr;
  std::int64_t *key_ = nullptr, *cell_key_ = nullptr;
  double* sorted_ = nullptr;
};

// Calls f(first, last) for slices of 0..n, on all threads; results of f must not depend on the slices.
template <class F>
void in_slices(std::int64_t n, F&& f) {
  constexpr std::int64_t slice = 8192;
  if (n <= slice) return void(n > 0 ? f(std::int64_t(0), n) : void());
  const std::int64_t slices = (n + slice - 1) / slice;
#pragma omp parallel for schedule(static)
  for (std::int64_t s = 0; s < slices; ++s) f(s * slice, s + 1 < slices ? (s + 1) * slice : n);
}

} // namespace cairn
