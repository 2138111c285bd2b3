// Abaqus's utility routines for UMATs, under their Fortran names: invariants, principal values and directions, rotation
// of a stress or strain, and XIT, which here ends the call alone.
#include <algorithm>
#include <cmath>

#include "../base/small_matrices.hpp"
#include "umat.hpp"

namespace cairn {

thread_local std::jmp_buf* umat_exit = nullptr;

namespace {

using Tensor = double[3][3];

void read(const double* s, int kind, int direct, int shear, Tensor a) {
  static const int place[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) a[i][k] = 0;
  for (int i = 0; i < direct; ++i) a[i][i] = s[i];
  const double share = kind == 2 ? 0.5 : 1; // strains have twice their shear
  for (int k = 0; k < shear; ++k) a[place[k][0]][place[k][1]] = a[place[k][1]][place[k][0]] = share * s[direct + k];
}

} // namespace
} // namespace cairn

#define CAIRN_FOR_UMATS extern "C" __attribute__((visibility("default"), used))

CAIRN_FOR_UMATS void sinv_(const double* stress, double* mean, double* mises, const int* direct, const int* shear) {
  cairn::Tensor a;
  cairn::read(stress, 1, *direct, *shear, a);
  *mean = (a[0][0] + a[1][1] + a[2][2]) / 3;
  double square = 0;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) square += std::pow(a[i][k] - (i == k ? *mean : 0), 2);
  *mises = std::sqrt(1.5 * square);
}

CAIRN_FOR_UMATS void sprind_(const double* s, double* value, double* direction, const int* kind, const int* direct,
                             const int* shear) {
  cairn::Tensor a, q;
  cairn::read(s, *kind, *direct, *shear, a);
  cairn::diagonalise(a, q);
  for (int i = 0; i < 3; ++i) value[i] = a[i][i];
  for (int k = 0; k < 3 && direction; ++k)
    for (int i = 0; i < 3; ++i) direction[3 * i + k] = q[i][k]; // AN(k, i): component i of direction k
}

CAIRN_FOR_UMATS void sprinc_(const double* s, double* value, const int* kind, const int* direct, const int* shear) {
  sprind_(s, value, nullptr, kind, direct, shear);
}

CAIRN_FOR_UMATS void rotsig_(const double* s, const double* r, double* turned, const int* kind, const int* direct,
                             const int* shear) {
  static const int place[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  cairn::Tensor a, b{};
  cairn::read(s, *kind, *direct, *shear, a);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l) b[i][j] += r[3 * k + i] * a[k][l] * r[3 * l + j];
  for (int i = 0; i < *direct; ++i) turned[i] = b[i][i];
  const double share = *kind == 2 ? 2 : 1;
  for (int k = 0; k < *shear; ++k) turned[*direct + k] = share * b[place[k][0]][place[k][1]];
}

CAIRN_FOR_UMATS void xit_() {
  if (cairn::umat_exit) std::longjmp(*cairn::umat_exit, 1);
}
