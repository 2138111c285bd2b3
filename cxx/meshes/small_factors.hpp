// Factors of small dense matrices.
#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cairn {

// Lower factor of a symmetric positive definite matrix (n, n) in its place; false: it is none.
inline bool factor_small(std::size_t n, std::vector<double>& a) {
  for (std::size_t j = 0; j < n; ++j)
    for (std::size_t i = j; i < n; ++i) {
      double sum = a[j * n + i];
      for (std::size_t k = 0; k < j; ++k) sum -= a[k * n + i] * a[k * n + j];
      if (i == j && !(sum > 0)) return false;
      a[j * n + i] = i == j ? std::sqrt(sum) : sum / a[j * n + j];
    }
  return true;
}

// Solves with that factor, in the place of the right side b (n).
inline void solve_small(std::size_t n, const std::vector<double>& l, double* b) {
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= l[k * n + i] * b[k];
    b[i] /= l[i * n + i];
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t k = i + 1; k < n; ++k) b[i] -= l[i * n + k] * b[k];
    b[i] /= l[i * n + i];
  }
}

inline double inner(const double* x, const double* y, std::int64_t n) {
  double sum = 0;
  for (std::int64_t i = 0; i < n; ++i) sum += x[i] * y[i];
  return sum;
}

} // namespace cairn
