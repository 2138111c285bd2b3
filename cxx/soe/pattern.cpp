#include <algorithm>
#include <string>

#include "../base/call.hpp"
#include "soe.hpp"

namespace cairn {

SparseMatrix lower_pattern(std::int64_t n, std::span<const std::int64_t> clique_start,
                           std::span<const std::int32_t> unknown) {
  for (const std::int32_t i : unknown)
    if (i < 0 || i >= n)
      throw Error("a clique names unknown " + std::to_string(i) + " of " + std::to_string(n) + ": they count from 0");
  const std::int64_t cliques = std::max<std::int64_t>(std::int64_t(clique_start.size()) - 1, 0);
  std::vector<std::int64_t> first(n + 1, 0); // cliques of each unknown
  for (const std::int32_t i : unknown) ++first[i + 1];
  for (std::int64_t i = 0; i < n; ++i) first[i + 1] += first[i];
  std::vector<std::int64_t> of(unknown.size()), next(first.begin(), first.end() - 1);
  for (std::int64_t c = 0; c < cliques; ++c)
    for (std::int64_t k = clique_start[c]; k < clique_start[c + 1]; ++k) of[next[unknown[k]]++] = c;
  SparseMatrix pattern;
  pattern.n = n;
  pattern.start.reserve(n + 1);
  std::vector<std::int32_t> seen(n, -1);
  for (std::int32_t j = 0; j < n; ++j) {
    const std::size_t begin = pattern.row.size();
    seen[j] = j;
    pattern.row.push_back(j);
    for (std::int64_t m = first[j]; m < first[j + 1]; ++m)
      for (std::int64_t k = clique_start[of[m]]; k < clique_start[of[m] + 1]; ++k)
        if (const std::int32_t i = unknown[k]; i > j && seen[i] != j) {
          seen[i] = j;
          pattern.row.push_back(i);
        }
    std::sort(pattern.row.begin() + std::ptrdiff_t(begin), pattern.row.end());
    pattern.start.push_back(std::int64_t(pattern.row.size()));
  }
  pattern.value.assign(pattern.row.size(), 0.0);
  return pattern;
}

void add_cliques(const SparseMatrix& pattern, std::span<const std::int64_t> clique_start,
                 std::span<const std::int32_t> unknown, const double* matrix, std::span<double> value) {
  for (std::size_t c = 0; c + 1 < clique_start.size(); ++c) {
    const std::int64_t begin = clique_start[c], size = clique_start[c + 1] - begin;
    for (std::int64_t j = 0; j < size; ++j)
      for (std::int64_t i = 0; i < size; ++i)
        if (unknown[begin + i] >= unknown[begin + j])
          value[place_of(pattern, unknown[begin + i], unknown[begin + j])] += matrix[size * j + i];
    matrix += size * size;
  }
}

std::int64_t place_of(const SparseMatrix& pattern, std::int64_t row, std::int64_t column) {
  const auto begin = pattern.row.begin() + pattern.start[column], end = pattern.row.begin() + pattern.start[column + 1];
  const auto found = std::lower_bound(begin, end, row);
  return found != end && *found == row ? found - pattern.row.begin() : -1;
}

} // namespace cairn
