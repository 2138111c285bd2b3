#include "contact_rows.hpp"

#include <algorithm>

#include "batch.hpp"

namespace cairn {

namespace {

// Inverse of a symmetric positive definite matrix of 3 x 3, scaled so that no unit enters.
void invert3(const double a[3][3], double out[3][3]) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const int p = (i + 1) % 3, q = (i + 2) % 3, r = (j + 1) % 3, s = (j + 2) % 3;
      out[j][i] = a[p][r] * a[q][s] - a[p][s] * a[q][r];
    }
  const double determinant = a[0][0] * out[0][0] + a[0][1] * out[1][0] + a[0][2] * out[2][0];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out[i][j] /= determinant;
}

} // namespace

void body_mass(const ContactSystem& system, std::int32_t body, double* mass, double* inverse) {
  const int n = system.velocities();
  std::fill_n(mass, n * n, 0.0);
  std::fill_n(inverse, n * n, 0.0);
  const double* x = system.record[body].x;
  if (system.dim == 2) {
    const double given[3] = {x[3], x[4], x[5]};
    for (int k = 0; k < 3; ++k) inverse[4 * k] = given[k];
  } else if (system.general.empty()) {
    for (int k = 0; k < 3; ++k) inverse[7 * k] = x[6], inverse[7 * (3 + k)] = x[7];
  } else {
    const double* y = system.general[body].x; // mass along y and z, inertia xx yy zz xy xz yz
    const double given[3] = {x[6], y[0], y[1]};
    for (int k = 0; k < 3; ++k) inverse[7 * k] = given[k], inverse[7 * (3 + k)] = y[2 + k];
    const int pair[3][2] = {{3, 4}, {3, 5}, {4, 5}};
    for (int k = 0; k < 3; ++k) inverse[n * pair[k][0] + pair[k][1]] = inverse[n * pair[k][1] + pair[k][0]] = y[5 + k];
  }
  const int turning = system.dim == 3 ? 3 : n; // where the full block begins
  double largest_inverse = 0;
  for (int k = 0; k < n; ++k) largest_inverse = std::max(largest_inverse, inverse[(n + 1) * k]);
  for (int k = 0; k < turning; ++k)
    mass[(n + 1) * k] = 1 / (inverse[(n + 1) * k] > 0 ? inverse[(n + 1) * k] : largest_inverse);
  if (turning == n) return;
  double a[3][3], b[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) a[i][j] = inverse[n * (3 + j) + 3 + i];
  const double largest = std::max({a[0][0], a[1][1], a[2][2]});
  for (int i = 0; i < 3; ++i)
    if (!(a[i][i] > 0)) a[i][i] = largest > 0 ? largest : 1; // driven: its row and column are empty
  invert3(a, b);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) mass[n * (3 + j) + 3 + i] = b[i][j];
}

void rigid_rows(const ContactSystem& system, const cairn_batch& b, int lane, int side, int components,
                const double* inverse, double* rows) {
  const int d = system.dim, n = system.velocities();
  double axes[3][3], lever[3] = {0, 0, 0};
  axes_of(b, d, lane, axes);
  for (int k = 0; k < d; ++k)
    lever[k] = is_radial(side ? b.side_b : b.side_a) ? at(b, side ? b.lever_b : b.lever_a, lane, 0) * axes[0][k]
                                                     : at(b, side ? b.lever_b : b.lever_a, lane, k);
  const double sign = side ? -1 : 1;
  std::fill_n(rows, components * n, 0.0);
  for (int c = 0; c < d; ++c) {
    const double* e = axes[c];
    for (int k = 0; k < d; ++k) rows[components * k + c] = sign * e[k];
    if (d == 2) {
      rows[components * 2 + c] = sign * (lever[0] * e[1] - lever[1] * e[0]);
      continue;
    }
    for (int k = 0; k < 3; ++k) {
      const int p = (k + 1) % 3, q = (k + 2) % 3;
      rows[components * (3 + k) + c] = sign * (lever[p] * e[q] - lever[q] * e[p]);
    }
  }
  for (int c = d; c < components; ++c) { // relative spins: about the normal and the tangents in space
    if (d == 2) rows[components * 2 + c] = sign;
    for (int k = 0; d == 3 && k < 3; ++k) rows[components * (3 + k) + c] = sign * axes[c - d][k];
  }
  for (int k = 0; k < n; ++k)
    if (!(inverse[(n + 1) * k] > 0)) std::fill_n(rows + components * k, components, 0.0);
}

} // namespace cairn
