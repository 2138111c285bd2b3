// Many small systems of one size, factorised eight at a time: bodies of few degrees of freedom.
#pragma once
#include <cstdint>
#include <vector>

#include "soe.hpp"

namespace cairn {

// LDL' factors of `bodies` symmetric positive definite matrices of n unknowns each, n at most 24, eight matrices side
// by side in SIMD lanes. Bits are independent of the number of threads and of the neighbouring lanes.
class BatchedSoe {
public:
  struct Status : SoeStatus {
    std::int64_t body = -1; // the first that failed; `row` is of its unknowns
  };

  BatchedSoe(std::int64_t bodies, int n);
  // value (bodies, n, n): lower triangles are read. Solutions of a body that failed are meaningless; those of all
  // others are valid.
  Status factor(const double* value, int threads = 1);
  void solve(double* b, int threads = 1) const;     // b (bodies, n), in place
  void inverse(double* out, int threads = 1) const; // out (bodies, n, n), symmetric to the last bit
  std::int64_t bodies() const { return bodies_; }
  int size() const { return n_; }
  std::int64_t bytes() const { return std::int64_t(sizeof(double)) * std::int64_t(factor_.size()); }

private:
  std::int64_t bodies_ = 0;
  int n_ = 0;
  std::vector<double> factor_; // (groups of eight, n, n, 8)
};

} // namespace cairn
