#include "linear_system.hpp"

#include <algorithm>
#include <string>

#include "../call.hpp"

#if CAIRN_HAS_SUITESPARSE
#include <umfpack.h>

extern "C" {
void dgetrf_(const int* m, const int* n, double* a, const int* lda, int* pivot, int* info);
void dgetrs_(const char* trans, const int* n, const int* columns, const double* a, const int* lda, const int* pivot,
             double* b, const int* ldb, int* info, std::size_t);
void openblas_set_num_threads(int) __attribute__((weak)); // another BLAS has none
}
#endif

namespace cairn {

#if CAIRN_HAS_SUITESPARSE

void need_factorisations(const char*) {
  if (openblas_set_num_threads != nullptr) openblas_set_num_threads(1);
}

struct LinearSystem::Sparse {
  std::vector<std::int32_t> start, column; // pattern that was analysed
  void *symbolic = nullptr, *numeric = nullptr;
  double control[UMFPACK_CONTROL], info[UMFPACK_INFO];
  Array<double> x, work;
  std::vector<int> integers;
  Sparse() {
    umfpack_di_defaults(control);
    control[UMFPACK_IRSTEP] = 0; // Newton's method corrects itself
    control[UMFPACK_STRATEGY] = UMFPACK_STRATEGY_SYMMETRIC;
    control[UMFPACK_ORDERING] = UMFPACK_ORDERING_AMD;
    control[UMFPACK_SCALE] = UMFPACK_SCALE_NONE; // the contacts are scaled already
  }
  ~Sparse() {
    umfpack_di_free_numeric(&numeric);
    umfpack_di_free_symbolic(&symbolic);
  }
};

bool LinearSystem::factor_full() {
  const std::size_t n = rows_;
  matrix_.assign(n * n, 0);
  pivot_.resize(n);
  for (std::size_t i = 0; i < n; ++i) // transposed: columns of LAPACK are rows here
    for (std::int32_t k = start_[i]; k < start_[i + 1]; ++k) matrix_[i * n + column_[k]] = entry_[k];
  int info = 0;
  dgetrf_(&rows_, &rows_, matrix_.data(), &rows_, pivot_.data(), &info);
  return info == 0;
}

bool LinearSystem::factor_sparse() {
  if (!sparse_) sparse_ = std::make_unique<Sparse>();
  Sparse& s = *sparse_;
  const std::int32_t entries = start_[rows_];
  umfpack_di_free_numeric(&s.numeric);
  const bool same = s.symbolic != nullptr && std::size_t(rows_) + 1 == s.start.size() &&
                    std::equal(s.start.begin(), s.start.end(), start_) &&
                    std::equal(s.column.begin(), s.column.end(), column_);
  if (!same) {
    umfpack_di_free_symbolic(&s.symbolic);
    s.start.assign(start_, start_ + rows_ + 1);
    s.column.assign(column_, column_ + entries);
    const int status = umfpack_di_symbolic(rows_, rows_, start_, column_, entry_, &s.symbolic, s.control, s.info);
    if (status < 0) return false;
  }
  const int status = umfpack_di_numeric(start_, column_, entry_, s.symbolic, &s.numeric, s.control, s.info);
  s.x.resize(rows_);
  s.integers.resize(rows_);
  s.work.resize(5 * std::size_t(rows_));
  return status == UMFPACK_OK;
}

bool LinearSystem::factor(std::int32_t rows, const std::int32_t* start, const std::int32_t* column,
                          const double* entry) {
  rows_ = rows;
  start_ = start;
  column_ = column;
  entry_ = entry;
  if (rows == 0) return true;
  const double filled = double(start[rows]) / rows / rows;
  full_ = rows <= 96 || (rows <= 400 && filled > 0.25);
  return full_ ? factor_full() : factor_sparse();
}

void LinearSystem::solve(double* b) {
  if (rows_ == 0) return;
  if (full_) {
    const int one = 1;
    int info = 0;
    dgetrs_("T", &rows_, &one, matrix_.data(), &rows_, pivot_.data(), b, &rows_, &info, 1);
    return;
  }
  Sparse& s = *sparse_;
  umfpack_di_wsolve(UMFPACK_Aat, start_, column_, entry_, s.x.data(), b, s.numeric, s.control, s.info,
                    s.integers.data(), s.work.data());
  std::copy(s.x.begin(), s.x.end(), b);
}

#else

void need_factorisations(const char* solver) {
  throw Error(std::string("solver ") + solver + " factorises matrices, and this build has no SuiteSparse: install " +
              "libsuitesparse-dev and liblapack-dev and build again, or take nlgs");
}
struct LinearSystem::Sparse {};
bool LinearSystem::factor_full() { return false; }
bool LinearSystem::factor_sparse() { return false; }
bool LinearSystem::factor(std::int32_t, const std::int32_t*, const std::int32_t*, const double*) { return false; }
void LinearSystem::solve(double*) {}

#endif

LinearSystem::LinearSystem() = default;
LinearSystem::~LinearSystem() = default;

} // namespace cairn
