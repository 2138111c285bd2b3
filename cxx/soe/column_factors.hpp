// Solutions with L D L' by columns, whoever made them.
#pragma once
#include <cstdint>
#include <vector>

#include "factors.hpp"

namespace cairn {

// A view of the factors by columns, with derived data: ranges of columns, pivots, elimination tree.
struct ColumnFactors {
  std::vector<std::int64_t> first, last; // of a column's entries below the diagonal
  const std::int32_t* row = nullptr;     // rising in a column
  const double* value = nullptr;
  std::vector<double> pivot;
  SoeTree tree;

  void resize(std::int64_t n);
  void find_tree();
  // The first pivot, in the order of elimination, that counts as none; `order`: equation at each place.
  SoeStatus judge(const SparseMatrix& a, const std::int32_t* order) const;
  void solve(int lanes, double* y) const;
  SoeBlock block(std::int32_t column) const;
  std::int64_t bytes() const;
};

} // namespace cairn
