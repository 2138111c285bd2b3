#include "block_factors.hpp"

#include <algorithm>
#include <limits>
#include <new>
#include <numeric>
#include <string>

#include "../../base/call.hpp"
#include "cairn/core.h"

#if CAIRN_HAS_SUITESPARSE
#include <amd.h>
#endif

namespace cairn {

#if CAIRN_HAS_SUITESPARSE
void need_factorisations(const char*) {}
bool has_factorisations() { return true; }
#else
bool has_factorisations() { return false; }
void need_factorisations(const char* solver) {
  throw Error(std::string("solver ") + solver + " factorises matrices, and this build has no SuiteSparse: install " +
              "libsuitesparse-dev and build again, or take nlgs");
}
#endif

BlockFactors::BlockFactors(int dim, const std::vector<std::int64_t>& row_start, const std::vector<std::int32_t>& column,
                           double max_bytes)
    : dim_(dim), n_(std::int64_t(row_start.size()) - 1), row_start_(row_start), column_(column), order_(n_),
      place_(n_) {
  const double wanted = bytes_of(find_order());
  if (wanted > max_bytes) throw FactorsTooLarge{wanted};
  for (std::int64_t i = 0; i < n_; ++i) place_[order_[i]] = std::int32_t(i);
  find_fill();
}

// Allocates at the first factorisation: a query of its cost needs no memory.
void BlockFactors::make_room() {
  if (!x_.empty()) return;
  const std::size_t size = std::size_t(dim_) * dim_, n = std::size_t(n_);
  lower_block_.resize(size * lower_.size());
  upper_block_.resize(size * upper_.size());
  diagonal_.resize(size * n);
  work_.resize(size * n);
  x_.resize(dim_ * n);
  lower_kept_.resize(lower_.size());
  upper_kept_.resize(upper_.size());
  lower_last_.resize(n);
  upper_last_.resize(n);
}

double BlockFactors::find_order() {
  std::iota(order_.begin(), order_.end(), 0);
#if CAIRN_HAS_SUITESPARSE
  if (row_start_.back() > std::numeric_limits<std::int32_t>::max())
    return double(row_start_.back()) / 2; // more than AMD can number; the factors hold at least this many blocks
  const std::vector<std::int32_t> start(row_start_.begin(), row_start_.end());
  double info[AMD_INFO] = {};
  const int status = amd_order(std::int32_t(n_), start.data(), column_.data(), order_.data(), nullptr, info);
  if (status == AMD_OUT_OF_MEMORY) throw std::bad_alloc();
  if (status != AMD_OK && status != AMD_OK_BUT_JUMBLED)
    throw Error("row_start or column of W is no pattern of a matrix: give rising starts and columns from 0 to " +
                std::to_string(n_ - 1));
  return info[AMD_LNZ];
#else
  return 0;
#endif
}

// Rows of U of the symmetrised pattern: those given to the right, and what its children in the elimination tree hand
// on.
void BlockFactors::find_fill() {
  const std::int64_t n = n_;
  std::vector<std::vector<std::int32_t>> right(n), children(n);
  for (std::int64_t a = 0; a < n; ++a)
    for (std::int64_t k = row_start_[a]; k < row_start_[a + 1]; ++k) {
      const auto [low, high] = std::minmax(place_[a], place_[column_[k]]);
      if (low != high) right[low].push_back(high);
    }
  std::vector<std::int32_t> seen(n, -1);
  std::vector<std::int64_t> count(n + 1, 0);
  upper_start_.assign(n + 1, 0);
  for (std::int32_t i = 0; i < n; ++i) {
    const std::size_t first = upper_.size();
    seen[i] = i;
    const auto take = [&](std::int32_t j) {
      if (seen[j] == i) return;
      seen[j] = i;
      upper_.push_back(j);
    };
    for (const std::int32_t j : right[i]) take(j);
    for (const std::int32_t c : children[i])
      for (std::int64_t k = upper_start_[c]; k < upper_start_[c + 1]; ++k) take(upper_[k]);
    std::sort(upper_.begin() + first, upper_.end());
    upper_start_[i + 1] = std::int64_t(upper_.size());
    if (upper_.size() > first) children[upper_[first]].push_back(i);
  }
  for (const std::int32_t j : upper_) ++count[j + 1];
  lower_start_.assign(n + 1, 0);
  std::partial_sum(count.begin(), count.end(), lower_start_.begin());
  std::vector<std::int64_t> next(lower_start_.begin(), lower_start_.end() - 1);
  lower_.resize(upper_.size());
  for (std::int32_t i = 0; i < n; ++i)
    for (std::int64_t k = upper_start_[i]; k < upper_start_[i + 1]; ++k) lower_[next[upper_[k]]++] = i;
}

double BlockFactors::operations() const {
  double sum = 0;
  for (std::size_t i = 0; i + 1 < upper_start_.size(); ++i) {
    const double right = double(upper_start_[i + 1] - upper_start_[i]);
    sum += right * (right + 1);
  }
  return 2.0 * dim_ * dim_ * dim_ * sum;
}

double BlockFactors::bytes_of(double blocks) const { return (8.0 * dim_ * dim_ + 8) * 2 * (blocks + double(n_)); }

double BlockFactors::bytes() const { return bytes_of(double(upper_.size())); }

bool BlockFactors::factor(const double* block, const std::int32_t* active) {
  active_ = active;
  make_room();
  return cairn_block_factor(dim_, n_, order_.data(), place_.data(), row_start_.data(), column_.data(), block, active,
                            lower_start_.data(), lower_.data(), upper_start_.data(), upper_.data(), lower_last_.data(),
                            lower_kept_.data(), upper_last_.data(), upper_kept_.data(), lower_block_.data(),
                            upper_block_.data(), diagonal_.data(), work_.data()) == 0;
}

void BlockFactors::solve(double* b) {
  cairn_block_solve(dim_, n_, order_.data(), active_, lower_start_.data(), lower_last_.data(), lower_kept_.data(),
                    upper_start_.data(), upper_last_.data(), upper_kept_.data(), lower_block_.data(),
                    upper_block_.data(), diagonal_.data(), b, x_.data());
}

} // namespace cairn
