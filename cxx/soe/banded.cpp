#include <algorithm>
#include <numeric>

#include "cairn/core.h"
#include "factors.hpp"
#include "lapack.hpp"
#include "one_blas_thread.hpp"

namespace cairn {

namespace {

// The graph of both triangles without the diagonal.
struct Graph {
  explicit Graph(const SparseMatrix& lower) : start(lower.n + 1, 0) {
    for_each(lower, [&](std::int32_t i, std::int32_t j) { ++start[i + 1], ++start[j + 1]; });
    std::partial_sum(start.begin(), start.end(), start.begin());
    neighbour.resize(start.back());
    std::vector<std::int64_t> next(start.begin(), start.end() - 1);
    for_each(lower, [&](std::int32_t i, std::int32_t j) { neighbour[next[i]++] = j, neighbour[next[j]++] = i; });
  }

  template <class Visit>
  static void for_each(const SparseMatrix& lower, Visit&& visit) {
    for (std::int32_t j = 0; j < lower.n; ++j)
      for (std::int64_t k = lower.start[j]; k < lower.start[j + 1]; ++k)
        if (lower.row[k] != j) visit(lower.row[k], j);
  }

  std::int64_t degree(std::int32_t i) const { return start[i + 1] - start[i]; }

  std::vector<std::int64_t> start;
  std::vector<std::int32_t> neighbour;
};

struct Levels {
  std::int64_t count = 0;
  std::size_t last = 0; // where the last one begins
};

// Level after level from `seed`, each node's neighbours by rising degree; appended to `order`.
Levels breadth_first(const Graph& graph, std::int32_t seed, std::vector<std::int32_t>& order,
                     std::vector<std::int32_t>& mark, std::int32_t now) {
  const auto by_degree = [&](std::int32_t a, std::int32_t b) {
    return std::pair(graph.degree(a), a) < std::pair(graph.degree(b), b);
  };
  Levels levels;
  std::size_t next = order.size();
  order.push_back(seed);
  mark[seed] = now;
  for (std::size_t k = next; k < order.size(); ++k) {
    if (k == next) {
      ++levels.count;
      levels.last = k;
      next = order.size();
    }
    const std::size_t first = order.size();
    for (std::int64_t e = graph.start[order[k]]; e < graph.start[order[k] + 1]; ++e)
      if (mark[graph.neighbour[e]] != now) {
        mark[graph.neighbour[e]] = now;
        order.push_back(graph.neighbour[e]);
      }
    std::sort(order.begin() + std::ptrdiff_t(first), order.end(), by_degree);
  }
  return levels;
}

class Banded final : public SoeFactors {
public:
  Banded(const SparseMatrix& pattern, std::vector<std::int32_t> order)
      : n_(pattern.n), half_(half_band(pattern, order)), order_(std::move(order)), place_(n_), diagonal_(n_),
        factor_(std::size_t(half_ + 1) * n_) {
    for (std::int64_t i = 0; i < n_; ++i) place_[order_[i]] = std::int32_t(i);
  }

  SoeStatus factor(const SparseMatrix& a) override {
    std::fill(factor_.begin(), factor_.end(), 0.0);
    for (std::int64_t j = 0; j < n_; ++j)
      for (std::int64_t k = a.start[j]; k < a.start[j + 1]; ++k) {
        const auto [low, high] = std::minmax(place_[a.row[k]], place_[j]);
        factor_[low * (half_ + 1) + (high - low)] = a.value[k];
      }
    for (std::int64_t j = 0; j < n_; ++j) diagonal_[j] = factor_[j * (half_ + 1)];
    const int n = int(n_), half = int(half_), stride = half + 1;
    int info = 0;
    {
      const OneBlasThread one;
      dpbtrf_("L", &n, &half, factor_.data(), &stride, &info, 1);
    }
    const std::int64_t good = info > 0 ? info - 1 : n_;
    for (std::int64_t j = 0; j < good; ++j) {
      const double l = factor_[j * (half_ + 1)];
      if (const SoeStatus status = judge_pivot(l * l, diagonal_[j], order_[j]); !status) return status;
    }
    return good == n_ ? SoeStatus{}
                      : judge_pivot(std::min(factor_[good * (half_ + 1)], 0.0), diagonal_[good], order_[good]);
  }

  std::span<const std::int32_t> order() const override { return order_; }

  void solve(int lanes, double* y, double*) const override {
    cairn_band_triangles(lanes, n_, half_, factor_.data(), y);
  }

  std::int64_t bytes() const override { return 8 * (entries() + n_) + 8 * n_; }
  std::int64_t entries() const override { return std::int64_t(factor_.size()); }
  const char* storage() const override { return "banded"; }
  const char* library() const override { return "LAPACK"; }

private:
  std::int64_t n_, half_;
  std::vector<std::int32_t> order_, place_;
  std::vector<double> diagonal_, factor_; // columns of the band from their diagonal entry down
};

} // namespace

// From an end of each part of the graph: as long as that gives more levels, one of least degree in the last level
// (George and Liu, 1979).
std::vector<std::int32_t> cuthill_mckee(const SparseMatrix& pattern) {
  const Graph graph(pattern);
  std::vector<std::int32_t> order, part, mark(pattern.n, -1), part_mark(pattern.n, -1);
  order.reserve(pattern.n);
  std::int32_t round = 0;
  for (std::int32_t i = 0; i < pattern.n; ++i) {
    if (mark[i] >= 0) continue;
    std::int32_t seed = i;
    for (std::int64_t most = 0;;) {
      part.clear();
      const Levels levels = breadth_first(graph, seed, part, part_mark, round++);
      if (levels.count <= most) break;
      most = levels.count;
      seed = *std::min_element(part.begin() + std::ptrdiff_t(levels.last), part.end(),
                               [&](std::int32_t a, std::int32_t b) { return graph.degree(a) < graph.degree(b); });
    }
    breadth_first(graph, seed, order, mark, 0);
  }
  std::reverse(order.begin(), order.end());
  return order;
}

std::int64_t half_band(const SparseMatrix& pattern, const std::vector<std::int32_t>& order) {
  std::vector<std::int32_t> place(pattern.n);
  for (std::int64_t i = 0; i < pattern.n; ++i) place[order[i]] = std::int32_t(i);
  std::int64_t half = 0;
  for (std::int64_t j = 0; j < pattern.n; ++j)
    for (std::int64_t k = pattern.start[j]; k < pattern.start[j + 1]; ++k)
      half = std::max<std::int64_t>(half, std::abs(place[pattern.row[k]] - place[j]));
  return half;
}

std::unique_ptr<SoeFactors> make_banded(const SparseMatrix& pattern, std::vector<std::int32_t> order) {
  return std::make_unique<Banded>(pattern, std::move(order));
}

} // namespace cairn
