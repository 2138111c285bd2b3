#include "column_factors.hpp"

#include "cairn/core.h"

namespace cairn {

void ColumnFactors::resize(std::int64_t n) {
  first.resize(n);
  last.resize(n);
  pivot.resize(n);
  tree.parent.resize(n);
}

void ColumnFactors::find_tree() {
  for (std::size_t j = 0; j < first.size(); ++j) tree.parent[j] = first[j] < last[j] ? row[first[j]] : -1;
}

SoeStatus ColumnFactors::judge(const SparseMatrix& a, const std::int32_t* order) const {
  for (std::size_t j = 0; j < pivot.size(); ++j)
    if (const SoeStatus status = judge_pivot(pivot[j], a.value[a.start[order[j]]], order[j]); !status) return status;
  return {};
}

void ColumnFactors::solve(int lanes, double* y) const {
  cairn_column_triangles(lanes, std::int64_t(pivot.size()), first.data(), last.data(), row, value, pivot.data(), y);
}

SoeBlock ColumnFactors::block(std::int32_t column) const {
  const auto j = std::size_t(column);
  return {column, 1, last[j] - first[j], row + first[j], value + first[j], pivot[j]};
}

std::int64_t ColumnFactors::bytes() const { return std::int64_t(pivot.size()) * (8 + 8 + 8 + 4); }

} // namespace cairn
