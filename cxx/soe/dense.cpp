#include <algorithm>
#include <numeric>

#include "cairn/core.h"
#include "factors.hpp"
#include "lapack.hpp"
#include "one_blas_thread.hpp"

namespace cairn {

namespace {

// L is one block of columns, which the kernel of the sparse factors solves with.
class Dense final : public SoeFactors {
public:
  explicit Dense(std::int64_t n) : n_(n), factor_(std::size_t(n) * n), diagonal_(n), row_(n) {
    std::iota(row_.begin(), row_.end(), 0);
  }

  SoeStatus factor(const SparseMatrix& a) override {
    std::fill(factor_.begin(), factor_.end(), 0.0);
    for (std::int64_t j = 0; j < n_; ++j)
      for (std::int64_t k = a.start[j]; k < a.start[j + 1]; ++k) factor_[j * n_ + a.row[k]] = a.value[k];
    for (std::int64_t j = 0; j < n_; ++j) diagonal_[j] = factor_[j * (n_ + 1)];
    const int n = int(n_), stride = std::max(n, 1);
    int info = 0;
    {
      const OneBlasThread one;
      dpotrf_("L", &n, factor_.data(), &stride, &info, 1);
    }
    const std::int64_t good = info > 0 ? info - 1 : n_;
    for (std::int64_t j = 0; j < good; ++j) {
      const double l = factor_[j * (n_ + 1)];
      if (const SoeStatus status = judge_pivot(l * l, diagonal_[j], j); !status) return status;
    }
    return good == n_ ? SoeStatus{} : judge_pivot(std::min(factor_[good * (n_ + 1)], 0.0), diagonal_[good], good);
  }

  void solve(int lanes, double* y, double* work) const override {
    const std::int32_t whole[2] = {0, std::int32_t(n_)}, values[1] = {0};
    cairn_front_triangles(lanes, 1, whole, whole, values, row_.data(), factor_.data(), y, work);
  }

  std::int64_t work_per_lane() const override { return n_; }
  std::int64_t bytes() const override { return 8 * (entries() + n_) + 4 * n_; }
  std::int64_t entries() const override { return n_ * n_; }
  const char* storage() const override { return "dense"; }
  const char* library() const override { return "LAPACK"; }

private:
  std::int64_t n_;
  std::vector<double> factor_, diagonal_; // (n, n) by columns
  std::vector<std::int32_t> row_;
};

} // namespace

std::unique_ptr<SoeFactors> make_dense(const SparseMatrix& pattern) { return std::make_unique<Dense>(pattern.n); }

} // namespace cairn
