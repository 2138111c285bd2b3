#include <algorithm>

#include "factors.hpp"

namespace cairn {

namespace {

class Diagonal final : public SoeFactors {
public:
  Diagonal(std::int64_t n, const char* storage) : diagonal_(n), storage_(storage) {}

  SoeStatus factor(const SparseMatrix& a) override {
    std::copy(a.value.begin(), a.value.end(), diagonal_.begin());
    return {};
  }

  void solve(int lanes, double* y, double*) const override {
    for (std::size_t i = 0; i < diagonal_.size(); ++i)
      for (int lane = 0; lane < lanes; ++lane) y[i * std::size_t(lanes) + std::size_t(lane)] /= diagonal_[i];
  }

  const double* diagonal() const override { return diagonal_.data(); }
  std::int64_t bytes() const override { return 8 * entries(); }
  std::int64_t entries() const override { return std::int64_t(diagonal_.size()); }
  const char* storage() const override { return storage_; }
  const char* library() const override { return "cairn"; }

private:
  std::vector<double> diagonal_;
  const char* storage_;
};

} // namespace

std::unique_ptr<SoeFactors> make_diagonal(const SparseMatrix& pattern, const char* storage) {
  return std::make_unique<Diagonal>(pattern.n, storage);
}

} // namespace cairn
