// Columns of the inverse factor of a symmetric matrix, each along its reach.
#pragma once
#include <cstdint>
#include <vector>

namespace cairn {

// Z of L Z = E' for groups of unknowns, such as the dofs of a node, by places in the order of elimination: the entries
// of the inverse between two of them are unit Z' Z. Where factors are sparse a column has numbers along the way from
// its unknown to the root of their tree alone. Of group i segments first[i] to first[i + 1] - 1, places rising.
struct UnitReaches {
  std::int64_t equations = 0; // places there are
  double unit = 1;            // a power of two
  std::vector<std::int64_t> first{0}, place, length;
  std::vector<const double*> value; // of each group its numbers (length, together) segment by segment
  std::vector<std::vector<double>> kept;

  std::int64_t groups() const { return std::int64_t(value.size()); }
  std::int64_t bytes() const;
  void clear() { *this = {}; }
};

} // namespace cairn
