// Sparse factors by Eigen's SimplicialLDLT (MPL2), where CHOLMOD is not.
#include "../base/call.hpp"
#include "factors.hpp"

#if CAIRN_HAS_EIGEN
#include <Eigen/SparseCholesky>

#include "column_factors.hpp"
#endif

namespace cairn {

#if CAIRN_HAS_EIGEN

namespace {

template <class Order>
class EigenColumns final : public SoeFactors {
  using Matrix = Eigen::SparseMatrix<double, Eigen::ColMajor, std::int32_t>;

public:
  explicit EigenColumns(const SparseMatrix& pattern) : start_(pattern.start.begin(), pattern.start.end()) {
    ldlt_.analyzePattern(view(pattern));
    const auto& place = ldlt_.permutationP().indices();
    order_.resize(pattern.n);
    for (std::int32_t i = 0; i < pattern.n; ++i) order_[place.size() == 0 ? i : place[i]] = i;
    columns_.resize(pattern.n);
  }

  SoeStatus factor(const SparseMatrix& a) override {
    ldlt_.factorize(view(a));
    const auto& l = ldlt_.matrixL().nestedExpression();
    const auto d = ldlt_.vectorD();
    columns_.row = l.innerIndexPtr();
    columns_.value = l.valuePtr();
    for (std::int64_t j = 0; j < a.n; ++j) {
      columns_.first[j] = l.outerIndexPtr()[j];
      columns_.last[j] = l.outerIndexPtr()[j + 1];
      columns_.pivot[j] = d[j];
    }
    if (const SoeStatus status = columns_.judge(a, order_.data()); !status) return status;
    columns_.find_tree();
    return {};
  }

  std::span<const std::int32_t> order() const override { return order_; }
  void solve(int lanes, double* y, double*) const override { columns_.solve(lanes, y); }
  const SoeTree* tree() const override { return &columns_.tree; }
  SoeBlock block(std::int32_t node) const override { return columns_.block(node); }
  std::int64_t bytes() const override { return 12 * entries() + columns_.bytes() + 24 * std::int64_t(order_.size()); }
  std::int64_t entries() const override {
    return std::int64_t(order_.size()) + (columns_.last.empty() ? 0 : columns_.last.back());
  }
  const char* storage() const override { return "sparse"; }
  const char* library() const override { return "Eigen"; }

private:
  Eigen::Map<const Matrix> view(const SparseMatrix& a) const {
    return {a.n, a.n, std::int64_t(a.row.size()), start_.data(), a.row.data(), a.value.data()};
  }

  std::vector<std::int32_t> start_, order_;
  Eigen::SimplicialLDLT<Matrix, Eigen::Lower, Order> ldlt_;
  ColumnFactors columns_;
};

} // namespace

std::unique_ptr<SoeFactors> make_ldlt(const SparseMatrix& pattern, const SoeOptions& options) {
  if (options.order == SoeOrder::metis)
    throw Error("METIS' order comes with CHOLMOD, which this build has not: take 'amd'");
  if (options.order == SoeOrder::natural)
    return std::make_unique<EigenColumns<Eigen::NaturalOrdering<std::int32_t>>>(pattern);
  return std::make_unique<EigenColumns<Eigen::AMDOrdering<std::int32_t>>>(pattern);
}

#else

std::unique_ptr<SoeFactors> make_ldlt(const SparseMatrix&, const SoeOptions&) { return nullptr; }

#endif

} // namespace cairn
