// Factors, inverses and eigenvalues of small symmetric matrices.
#pragma once
#include <cmath>
#include <cstddef>

namespace cairn {

// L D L' of a symmetric matrix a (n, n) in its place, of which the lower triangle is read: the columns of L below the
// diagonal, D on it. Pivots within `least` of their own diagonal are rounding: their unknown is loose, its D and its
// column are 0. A pivot is measured by its own diagonal because masses and inertias have different units. The first row
// is overwritten. True if the matrix is positive definite.
inline bool factor_symmetric(std::size_t n, double* a, double least) {
  bool definite = true;
  for (std::size_t j = 1; j < n; ++j) a[n * j] = a[n * j + j]; // diagonals
  for (std::size_t j = 0; j < n; ++j) {
    const double pivot = a[n * j + j], own = j > 0 ? a[n * j] : pivot;
    const bool loose = !(std::abs(pivot) > least * std::abs(own));
    definite = definite && !loose && pivot > 0;
    if (loose) a[n * j + j] = 0;
    for (std::size_t c = j + 1; c < n; ++c) { // the columns behind, from their diagonals on
      const double share = loose ? 0 : a[n * j + c] / pivot;
      for (std::size_t r = c; share != 0 && r < n; ++r) a[n * c + r] -= share * a[n * j + r];
    }
    for (std::size_t r = j + 1; r < n; ++r) a[n * j + r] = loose ? 0 : a[n * j + r] / pivot;
  }
  return definite;
}

// Solves with these factors in the place of the right side x (n); loose unknowns are 0.
inline void solve_symmetric(std::size_t n, const double* a, double* x) {
  for (std::size_t j = 0; j < n; ++j)
    for (std::size_t r = j + 1; r < n; ++r) x[r] -= a[n * j + r] * x[j];
  for (std::size_t j = n; j-- > 0;) {
    const double pivot = a[n * j + j];
    x[j] = std::abs(pivot) > 0 ? x[j] / pivot : 0;
    for (std::size_t r = j + 1; r < n; ++r) x[j] -= a[n * j + r] * x[r];
  }
}

// Inverse of a symmetric matrix a (n, n) in its place, by Gauss's and Jordan's elimination; rows and columns of loose
// unknowns, as above, are 0. True if the matrix is positive definite.
template <std::size_t most>
bool invert_symmetric(std::size_t n, double (&a)[most][most], double least) {
  bool definite = true;
  double own[most];
  for (std::size_t k = 0; k < n; ++k) own[k] = std::abs(a[k][k]);
  for (std::size_t k = 0; k < n; ++k) {
    const double pivot = a[k][k];
    if (!(pivot > least * own[k])) {
      definite = false;
      for (std::size_t i = 0; i < n; ++i) a[i][k] = a[k][i] = 0;
      continue;
    }
    a[k][k] = 1;
    for (std::size_t j = 0; j < n; ++j) a[k][j] /= pivot;
    for (std::size_t i = 0; i < n; ++i) {
      const double factor = a[i][k];
      if (i == k || factor == 0) continue;
      a[i][k] = 0;
      for (std::size_t j = 0; j < n; ++j) a[i][j] -= factor * a[k][j];
    }
  }
  return definite;
}

// Eigenvalues on the diagonal of a symmetric matrix, eigenvectors in the columns of v, by Jacobi's rotations.
template <std::size_t n>
void diagonalise(double (*a)[n], double (*v)[n]) {
  constexpr int most = 60; // convergence is quadratic: a dozen are enough
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) v[i][j] = i == j;
  for (int pass = 0; pass < most; ++pass) {
    double off = 0, size = 0;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) (i == j ? size : off) += std::abs(a[i][j]);
    if (!(off > 1e-18 * size)) return;
    for (std::size_t p = 0; p < n; ++p)
      for (std::size_t q = p + 1; q < n; ++q) {
        if (!(std::abs(a[p][q]) > 0)) continue;
        const double ratio = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = std::copysign(1.0, ratio) / (std::abs(ratio) + std::hypot(1.0, ratio));
        const double c = 1 / std::hypot(1.0, t), s = t * c;
        const auto turn = [=](double& one, double& two) {
          const double x = one, y = two;
          one = c * x - s * y;
          two = s * x + c * y;
        };
        for (std::size_t k = 0; k < n; ++k) turn(a[k][p], a[k][q]);
        for (std::size_t k = 0; k < n; ++k) turn(a[p][k], a[q][k]);
        for (std::size_t k = 0; k < n; ++k) turn(v[k][p], v[k][q]);
      }
  }
}

} // namespace cairn
