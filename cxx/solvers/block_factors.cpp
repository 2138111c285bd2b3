#include "block_factors.hpp"

#include <algorithm>
#include <numeric>
#include <string>

#include "../call.hpp"

#if CAIRN_HAS_SUITESPARSE
#include <amd.h>
#endif

namespace cairn {

#if CAIRN_HAS_SUITESPARSE
void need_factorisations(const char*) {}
#else
void need_factorisations(const char* solver) {
  throw Error(std::string("solver ") + solver + " factorises matrices, and this build has no SuiteSparse: install " +
              "libsuitesparse-dev and build again, or take nlgs");
}
#endif

BlockFactors::BlockFactors(const FrictionProblem& p) : p_(p), order_(p.contacts), place_(p.contacts) {
  find_order();
  for (std::int64_t i = 0; i < p.contacts; ++i) place_[order_[i]] = std::int32_t(i);
  find_fill();
  const std::int64_t size = p.dim * p.dim;
  lower_block_.resize(size * lower_.size());
  upper_block_.resize(size * upper_.size());
  diagonal_.resize(size * p.contacts);
  work_.resize(size * p.contacts);
  x_.resize(p.unknowns());
  lower_kept_.resize(lower_.size());
  upper_kept_.resize(upper_.size());
  lower_last_.resize(p.contacts);
  upper_last_.resize(p.contacts);
}

void BlockFactors::find_order() {
  std::iota(order_.begin(), order_.end(), 0);
#if CAIRN_HAS_SUITESPARSE
  const std::vector<std::int32_t> start(p_.row_start.begin(), p_.row_start.end());
  amd_order(std::int32_t(p_.contacts), start.data(), p_.column.data(), order_.data(), nullptr, nullptr);
#endif
}

// Rows of U of the symmetrised pattern: those of W to the right, and what its children in the elimination tree hand on.
void BlockFactors::find_fill() {
  const std::int64_t n = p_.contacts;
  std::vector<std::vector<std::int32_t>> right(n), children(n);
  for (std::int64_t a = 0; a < n; ++a)
    for (std::int64_t k = p_.row_start[a]; k < p_.row_start[a + 1]; ++k) {
      const auto [low, high] = std::minmax(place_[a], place_[p_.column[k]]);
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

bool BlockFactors::factor(const double* block, const std::int32_t* active) {
  active_ = active;
  return cairn_block_factor(p_.dim, p_.contacts, order_.data(), place_.data(), p_.row_start.data(), p_.column.data(),
                            block, active, lower_start_.data(), lower_.data(), upper_start_.data(), upper_.data(),
                            lower_last_.data(), lower_kept_.data(), upper_last_.data(), upper_kept_.data(),
                            lower_block_.data(), upper_block_.data(), diagonal_.data(), work_.data()) == 0;
}

void BlockFactors::solve(double* b) {
  cairn_block_solve(p_.dim, p_.contacts, order_.data(), active_, lower_start_.data(), lower_last_.data(),
                    lower_kept_.data(), upper_start_.data(), upper_last_.data(), upper_kept_.data(),
                    lower_block_.data(), upper_block_.data(), diagonal_.data(), b, x_.data());
}

} // namespace cairn
