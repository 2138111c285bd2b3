// The linear systems of solvers that factorise: LAPACK where they are small or nearly full, SuiteSparse (UMFPACK, Davis
// 2004) where they are sparse. One thread, so that the bits do not depend on how many there are.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "../field.hpp"

namespace cairn {

// Throws Error where this build has no SuiteSparse, and says what to do.
void need_factorisations(const char* solver);

class LinearSystem {
public:
  LinearSystem();
  ~LinearSystem();
  LinearSystem(const LinearSystem&) = delete;
  LinearSystem& operator=(const LinearSystem&) = delete;

  // Square matrix by rows, columns rising; start (rows + 1). The arrays must live until the solve. A pattern equal to
  // the last one is not analysed again. False: singular to rounding.
  bool factor(std::int32_t rows, const std::int32_t* start, const std::int32_t* column, const double* entry);
  // Solution in place of b.
  void solve(double* b);

private:
  struct Sparse; // handles of UMFPACK
  bool factor_full();
  bool factor_sparse();
  std::int32_t rows_ = 0;
  const std::int32_t *start_ = nullptr, *column_ = nullptr;
  const double* entry_ = nullptr;
  bool full_ = false;
  Array<double> matrix_; // (rows, rows) of a full one
  std::vector<int> pivot_;
  std::unique_ptr<Sparse> sparse_;
};

} // namespace cairn
