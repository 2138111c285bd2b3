// Entries of the inverse at some unknowns, by the part of the factors that these reach.
#include <omp.h>

#include <algorithm>
#include <optional>
#include <string>

#include "../base/call.hpp"
#include "factors.hpp"

namespace cairn {

namespace {

constexpr std::int64_t lanes = 8;

// Nodes from those of some places up to their roots.
template <class Wanted>
class Paths {
public:
  Paths(const SoeTree& tree, const std::vector<Wanted>& wanted) : tree_(tree), last_(tree.parent.size(), -1) {
    for (std::int64_t k = std::int64_t(wanted.size()); k-- > 0;)
      for (std::int32_t i = node(wanted[k].place); i >= 0 && last_[i] < 0; i = tree.parent[i]) {
        last_[i] = std::int32_t(k);
        all_.push_back(i);
      }
    std::sort(all_.begin(), all_.end());
  }

  // Right sides at wanted [begin, end), solutions at those from `begin` on.
  void find(const std::vector<Wanted>& wanted, std::int64_t begin, std::int64_t end, SoeReach& reach,
            std::vector<std::int64_t>& mark) const {
    mark.resize(tree_.parent.size(), -1);
    reach.down.clear();
    for (std::int64_t k = begin; k < end; ++k)
      for (std::int32_t i = node(wanted[k].place); i >= 0 && mark[i] != begin; i = tree_.parent[i]) {
        mark[i] = begin;
        reach.down.push_back(i);
      }
    std::sort(reach.down.begin(), reach.down.end());
    reach.up.clear();
    std::copy_if(all_.begin(), all_.end(), std::back_inserter(reach.up),
                 [&](std::int32_t i) { return last_[i] >= begin; });
  }

  // Right sides at some, solutions at all.
  void find_all(std::span<const Wanted> sides, SoeReach& reach) const {
    std::vector<bool> seen(tree_.parent.size());
    reach.down.clear();
    for (const Wanted& w : sides)
      for (std::int32_t i = node(w.place); i >= 0 && !seen[i]; i = tree_.parent[i]) {
        seen[i] = true;
        reach.down.push_back(i);
      }
    std::sort(reach.down.begin(), reach.down.end());
    reach.up = all_;
  }

  void clear(const std::vector<std::int32_t>& nodes, double* y) const {
    for (const std::int32_t i : nodes) {
      const std::int64_t first = tree_.first.empty() ? i : tree_.first[i];
      const std::int64_t end = tree_.first.empty() ? i + 1 : tree_.first[i + 1];
      std::fill(y + first * lanes, y + end * lanes, 0.0);
    }
  }

private:
  std::int32_t node(std::int32_t place) const { return tree_.node.empty() ? place : tree_.node[place]; }

  const SoeTree& tree_;
  std::vector<std::int32_t> last_, all_; // of each node: the last wanted place that reaches it; nodes reached
};

} // namespace

std::vector<Soe::Wanted> Soe::wanted_of(std::span<const std::int32_t> indices) const {
  if (!factorised_) throw Error("there are no factors to solve with: give values that can be factorised first");
  std::vector<Wanted> wanted;
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] < 0 || indices[i] >= n_)
      throw Error("index " + std::to_string(i) + " names unknown " + std::to_string(indices[i]) + " of " +
                  std::to_string(n_) + ": they count from 0");
    if (const std::int32_t e = equation_[indices[i]]; e >= 0) wanted.push_back({std::int64_t(i), e, place_[e]});
  }
  std::stable_sort(wanted.begin(), wanted.end(), [](const Wanted& a, const Wanted& b) { return a.place < b.place; });
  return wanted;
}

void Soe::add_units(std::span<const std::int32_t> indices, std::int64_t known, double* out,
                    std::int64_t leading) const {
  if (!symmetric_) throw Error("entries are added to those of the inverse of a symmetric matrix alone");
  const std::int64_t m = std::int64_t(indices.size()), equations = scaled_.n;
  const std::vector<Wanted> wanted = wanted_of(indices);
  std::vector<Wanted> fresh;
  std::copy_if(wanted.begin(), wanted.end(), std::back_inserter(fresh),
               [&](const Wanted& w) { return w.index >= known; });
  for (std::int64_t c = known; c < m; ++c)
    for (std::int64_t r = 0; r < m; ++r) out[leading * c + r] = out[leading * r + c] = 0;
  const SoeTree* const tree = factors_->tree();
  std::optional<Paths<Wanted>> paths;
  if (tree != nullptr) paths.emplace(*tree, wanted);
  std::vector<double> y(std::size_t(work_size()), 0.0);
  SoeReach reach;
  for (std::size_t begin = 0; begin < fresh.size(); begin += lanes) {
    const std::size_t end = std::min(begin + std::size_t(lanes), fresh.size());
    const std::span<const Wanted> sides(&fresh[begin], end - begin);
    if (paths) {
      paths->find_all(sides, reach);
      paths->clear(reach.up, y.data());
    } else {
      std::fill(y.begin(), y.begin() + equations * lanes, 0.0);
    }
    for (std::size_t k = 0; k < sides.size(); ++k) y[sides[k].place * lanes + k] = left_[sides[k].equation];
    factors_->solve(int(lanes), y.data(), paths ? &reach : nullptr, y.data() + equations * lanes);
    for (const Wanted& w : wanted)
      for (std::size_t k = 0; k < sides.size(); ++k) {
        const bool twice = w.index >= known && w.place < sides[k].place; // the column of the lower place counts
        if (twice) continue;
        const double x = right_[w.equation] * y[w.place * lanes + k];
        out[leading * sides[k].index + w.index] = out[leading * w.index + sides[k].index] = x;
      }
  }
}

void Soe::solve_units(std::span<const std::int32_t> indices, double* out, int threads) const {
  const std::int64_t m = std::int64_t(indices.size()), equations = scaled_.n, size = work_size();
  const std::vector<Wanted> wanted = wanted_of(indices);
  std::fill(out, out + m * m, 0.0);
  const std::int64_t count = std::int64_t(wanted.size()), groups = (count + lanes - 1) / lanes;
  const SoeTree* const tree = factors_->tree();
  std::optional<Paths<Wanted>> paths;
  if (tree != nullptr) paths.emplace(*tree, wanted);
  const int team = int(std::clamp<std::int64_t>(groups, 1, std::max(threads, 1)));
#pragma omp parallel num_threads(team) if (team > 1)
  {
    std::vector<double> y(size);
    std::vector<std::int64_t> mark;
    SoeReach reach;
#pragma omp for schedule(dynamic)
    for (std::int64_t g = 0; g < groups; ++g) {
      const std::int64_t begin = g * lanes, end = std::min(begin + lanes, count);
      if (paths) {
        paths->find(wanted, begin, end, reach, mark);
        paths->clear(reach.up, y.data());
      } else {
        std::fill(y.begin(), y.begin() + equations * lanes, 0.0);
      }
      for (std::int64_t k = begin; k < end; ++k) y[wanted[k].place * lanes + (k - begin)] = left_[wanted[k].equation];
      factors_->solve(int(lanes), y.data(), paths ? &reach : nullptr, y.data() + equations * lanes);
      for (std::int64_t i = symmetric_ ? begin : 0; i < count; ++i)
        for (std::int64_t k = begin; k < end; ++k) {
          const double x = right_[wanted[i].equation] * y[wanted[i].place * lanes + (k - begin)];
          const std::int64_t row = wanted[i].index, column = wanted[k].index;
          if (!symmetric_ || i >= k) out[row * m + column] = x;
          if (symmetric_ && i > k) out[column * m + row] = x;
        }
    }
  }
}

} // namespace cairn
