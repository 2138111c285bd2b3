// Unsymmetric matrices: LU factors by UMFPACK (Davis, 2004; GPL), or by Eigen's SparseLU (MPL2).
#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "factors.hpp"
#include "one_blas_thread.hpp"

#if CAIRN_HAS_UMFPACK
#include <umfpack.h>
#elif CAIRN_HAS_EIGEN
#include <Eigen/SparseLU>
#endif

namespace cairn {

namespace {

#if CAIRN_HAS_UMFPACK

class Umfpack final : public SoeFactors {
public:
  Umfpack(const SparseMatrix& pattern, const SoeOptions& options)
      : n_(pattern.n), start_(pattern.start.begin(), pattern.start.end()) {
    umfpack_di_defaults(control_);
    if (options.order == SoeOrder::natural) control_[UMFPACK_ORDERING] = UMFPACK_ORDERING_NONE;
    if (options.order == SoeOrder::amd) control_[UMFPACK_ORDERING] = UMFPACK_ORDERING_AMD;
    if (options.order == SoeOrder::metis) control_[UMFPACK_ORDERING] = UMFPACK_ORDERING_METIS;
    if (n_ == 0) return;
    const int n = int(n_);
    if (umfpack_di_symbolic(n, n, start_.data(), pattern.row.data(), nullptr, &symbolic_, control_, nullptr) < 0)
      throw Error("UMFPACK cannot analyse a matrix of " + std::to_string(n_) + " unknowns: its factors are too large");
  }

  ~Umfpack() override {
    umfpack_di_free_numeric(&numeric_);
    umfpack_di_free_symbolic(&symbolic_);
  }

  SoeStatus factor(const SparseMatrix& a) override {
    a_ = &a;
    umfpack_di_free_numeric(&numeric_);
    if (n_ == 0) return {};
    double info[UMFPACK_INFO] = {};
    int status = 0;
    {
      const OneBlasThread one;
      status = umfpack_di_numeric(start_.data(), a.row.data(), a.value.data(), symbolic_, &numeric_, control_, info);
    }
    if (status < 0) return {SoeStatus::too_large};
    entries_ = std::int64_t(info[UMFPACK_LNZ] + info[UMFPACK_UNZ]);
    bytes_ = std::int64_t(info[UMFPACK_NUMERIC_SIZE] * info[UMFPACK_SIZE_OF_UNIT]);
    return judge(a);
  }

  void solve(int lanes, double* y, double* work) const override {
    if (n_ == 0) return;
    double *const b = work, *const x = work + n_, *const w = work + 2 * n_;
    int* const wi = reinterpret_cast<int*>(work + 7 * n_);
    for (int lane = 0; lane < lanes; ++lane) {
      for (std::int64_t i = 0; i < n_; ++i) b[i] = y[i * lanes + lane];
      umfpack_di_wsolve(UMFPACK_A, start_.data(), a_->row.data(), a_->value.data(), x, b, numeric_, control_, nullptr,
                        wi, w);
      for (std::int64_t i = 0; i < n_; ++i) y[i * lanes + lane] = x[i];
    }
  }

  std::int64_t work_per_lane() const override { return 8 * n_; }
  std::int64_t bytes() const override { return bytes_ + 4 * n_; }
  std::int64_t entries() const override { return entries_; }
  const char* storage() const override { return "unsymmetric"; }
  const char* library() const override { return "UMFPACK"; }

private:
  // A pivot against the largest entry of its column, in the units UMFPACK gives the rows.
  SoeStatus judge(const SparseMatrix& a) const {
    std::vector<int> order(n_);
    std::vector<double> pivot(n_), unit(n_);
    int reciprocal = 0;
    umfpack_di_get_numeric(nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, order.data(), pivot.data(),
                           &reciprocal, unit.data(), numeric_);
    for (std::int64_t j = 0; j < n_; ++j) {
      double largest = 0;
      for (std::int64_t k = a.start[order[j]]; k < a.start[order[j] + 1]; ++k) {
        const double r = unit[a.row[k]];
        largest = std::max(largest, std::abs(reciprocal ? a.value[k] * r : a.value[k] / r));
      }
      if (const SoeStatus status = judge_pivot(std::abs(pivot[j]), largest, order[j]); !status)
        return {SoeStatus::singular, order[j]};
    }
    return {};
  }

  std::int64_t n_, entries_ = 0, bytes_ = 0;
  const SparseMatrix* a_ = nullptr; // the caller's, for its iterations
  std::vector<int> start_;
  double control_[UMFPACK_CONTROL];
  void *symbolic_ = nullptr, *numeric_ = nullptr;
};

#elif CAIRN_HAS_EIGEN

class EigenLu final : public SoeFactors {
  using Matrix = Eigen::SparseMatrix<double, Eigen::ColMajor, std::int32_t>;

public:
  explicit EigenLu(const SparseMatrix& pattern) : start_(pattern.start.begin(), pattern.start.end()) {
    if (pattern.n > 0) lu_.analyzePattern(Matrix(view(pattern)));
  }

  SoeStatus factor(const SparseMatrix& a) override {
    if (a.n == 0) return {};
    const Matrix copy = view(a);
    lu_.factorize(copy);
    if (lu_.info() != Eigen::Success) return {SoeStatus::singular};
    return {};
  }

  void solve(int lanes, double* y, double*) const override {
    const std::int64_t n = std::int64_t(start_.size()) - 1;
    if (n == 0) return;
    Eigen::VectorXd b(n);
    for (int lane = 0; lane < lanes; ++lane) {
      for (std::int64_t i = 0; i < n; ++i) b[i] = y[i * lanes + lane];
      const Eigen::VectorXd x = lu_.solve(b);
      for (std::int64_t i = 0; i < n; ++i) y[i * lanes + lane] = x[i];
    }
  }

  std::int64_t bytes() const override { return 12 * entries(); }
  std::int64_t entries() const override { return lu_.info() == Eigen::Success ? lu_.nnzL() + lu_.nnzU() : 0; }
  const char* storage() const override { return "unsymmetric"; }
  const char* library() const override { return "Eigen"; }

private:
  Eigen::Map<const Matrix> view(const SparseMatrix& a) const {
    return {a.n, a.n, std::int64_t(a.row.size()), start_.data(), a.row.data(), a.value.data()};
  }

  std::vector<std::int32_t> start_;
  Eigen::SparseLU<Matrix, Eigen::COLAMDOrdering<std::int32_t>> lu_;
};

#endif

} // namespace

std::unique_ptr<SoeFactors> make_unsymmetric([[maybe_unused]] const SparseMatrix& pattern,
                                             [[maybe_unused]] const SoeOptions& options) {
#if CAIRN_HAS_UMFPACK
  return std::make_unique<Umfpack>(pattern, options);
#elif CAIRN_HAS_EIGEN
  return std::make_unique<EigenLu>(pattern);
#else
  throw Error("a matrix that is not symmetric needs UMFPACK (install libsuitesparse-dev, build with -D "
              "CAIRN_SUITESPARSE=gpl) or Eigen (libeigen3-dev)");
#endif
}

const char* soe_licence() {
#if CAIRN_HAS_UMFPACK
  return "gpl";
#elif CAIRN_HAS_CHOLMOD
  return "lgpl";
#elif CAIRN_HAS_SUITESPARSE
  return "bsd";
#else
  return "off";
#endif
}

} // namespace cairn
