#include <algorithm>

#include "factors.hpp"

namespace cairn {

namespace {

class Diagonal final : public SoeFactors {
public:
  Diagonal(std::int64_t n, const char* storage) : diagonal_(n), storage_(storage) { tree_.parent.assign(n, -1); }

  SoeStatus factor(const SparseMatrix& a) override {
    std::copy(a.value.begin(), a.value.end(), diagonal_.begin());
    return {};
  }

  void solve(int lanes, double* y, const SoeReach* reach, double*) const override {
    const std::size_t count = reach != nullptr ? reach->up.size() : diagonal_.size();
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = reach != nullptr ? reach->up[k] : k;
      for (int lane = 0; lane < lanes; ++lane) y[i * lanes + lane] /= diagonal_[i];
    }
  }

  const SoeTree* tree() const override { return &tree_; }

  std::int64_t bytes() const override { return 12 * entries(); }
  std::int64_t entries() const override { return std::int64_t(diagonal_.size()); }
  const char* storage() const override { return storage_; }
  const char* library() const override { return "cairn"; }

private:
  std::vector<double> diagonal_;
  SoeTree tree_;
  const char* storage_;
};

} // namespace

std::unique_ptr<SoeFactors> make_diagonal(const SparseMatrix& pattern, const char* storage) {
  return std::make_unique<Diagonal>(pattern.n, storage);
}

} // namespace cairn
