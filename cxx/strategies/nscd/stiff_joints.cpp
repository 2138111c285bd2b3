// Geometric stiffness K of loaded joints, implicit where tension swings light bodies faster than steps follow:
//   (I + g h^2 K) (w+ - w-) = h T,   g = (1 - 1/x)/2 for x = h^2 K/I > 1, else 0,
// T: torques of the step. Axes are those in which K and I are diagonal together (Tournier et al. 2015; Andrews,
// Teichmann & Kry 2017). The energy of g h^2 K counts as dissipation of the integrator.
#include "stiff_joints.hpp"

#include <algorithm>
#include <cmath>

#include "../../base/small_matrices.hpp"

namespace cairn {
namespace {

constexpr int pair_of[3][2] = {{0, 1}, {0, 2}, {1, 2}};

void full(const double packed[6], double out[3][3]) {
  for (int k = 0; k < 3; ++k) {
    out[k][k] = packed[k];
    out[pair_of[k][0]][pair_of[k][1]] = out[pair_of[k][1]][pair_of[k][0]] = packed[3 + k];
  }
}

void pack(const double full[3][3], double out[6]) {
  for (int k = 0; k < 3; ++k) {
    out[k] = full[k][k];
    out[3 + k] = full[pair_of[k][0]][pair_of[k][1]];
  }
}

// LDL' factors of a semidefinite 3 x 3 matrix; D = 0 for fixed dofs. Roots are taken of products of two D alone, so
// that a change of units by powers of two preserves all digits.
struct Factors {
  double l[3][3], d[3];
  explicit Factors(const double a[3][3]) {
    constexpr double rounding = 0x1p-44;
    double columns[9];
    for (int k = 0; k < 9; ++k) columns[k] = a[k % 3][k / 3];
    factor_symmetric(3, columns, rounding);
    for (int j = 0; j < 3; ++j) {
      d[j] = std::max(0.0, columns[4 * j]);
      for (int i = 0; i < 3; ++i) l[i][j] = i == j ? 1 : i < j || !(d[j] > 0) ? 0 : columns[3 * j + i];
    }
  }
  double root(int i, int j) const { return std::sqrt(d[i] * d[j]); }
  bool move(int i, int j) const { return d[i] > 0 && d[j] > 0; }
  // L^-1 x
  void solve(const double x[3], double y[3]) const {
    for (int i = 0; i < 3; ++i) {
      y[i] = x[i];
      for (int k = 0; k < i; ++k) y[i] -= l[i][k] * y[k];
    }
  }
  // Squares of step times rate, on the diagonal of k along axes v.
  void swings(const double stiffness[6], double h, double k[3][3], double v[3][3]) const {
    double load[3][3];
    full(stiffness, load);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        double sum = 0;
        for (int p = 0; p < 3; ++p)
          for (int q = 0; q < 3; ++q) sum += l[p][i] * load[p][q] * l[q][j];
        k[i][j] = h * h * root(i, j) * sum;
      }
    for (const auto& [i, j] : pair_of) k[j][i] = k[i][j];
    diagonalise(k, v);
  }
};

// No eigenvalue of K over the inertia is larger.
double bound(const double stiffness[6], const double inverse[6]) {
  double square = 0;
  for (int k = 0; k < 6; ++k) square += (k < 3 ? 1 : 2) * stiffness[k] * stiffness[k];
  return std::sqrt(square) * (inverse[0] + inverse[1] + inverse[2]);
}

// In place of the inverse inertia and the free spin w of a body that has the spin w_begin: of I + g h^2 K. False: K is
// slow. added: g h^2 K.
bool stiffened_inertia(const double stiffness[6], double h, double inverse[6], const double* begin, double* w,
                       double added[6]) {
  double whole[3][3], k[3][3], v[3][3], soft[3][3], kept[3][3], change[3], y[3], out[3][3], sum[3][3], more[3];
  if (!(h * h * bound(stiffness, inverse) > 1)) return false;
  full(inverse, whole);
  const Factors f(whole);
  f.swings(stiffness, h, k, v);
  double most = 0;
  for (int i = 0; i < 3; ++i) most = std::max(most, more[i] = implicit_share(k[i][i]) * k[i][i]);
  if (!(most > 0)) return false;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      soft[i][j] = kept[i][j] = 0;
      for (int m = 0; m < 3; ++m) soft[i][j] += v[i][m] * v[j][m] / (1 + more[m]);
      for (int m = 0; m < 3 && f.move(i, j); ++m) kept[i][j] += v[i][m] * v[j][m] * more[m] / f.root(i, j);
    }
  for (int i = 0; i < 3; ++i) change[i] = w[i] - begin[i];
  f.solve(change, y);
  double softened[3] = {}, unit[3][3];
  for (int p = 0; p < 3; ++p)
    for (int q = 0; q < 3; ++q)
      if (f.move(p, q)) softened[p] += (soft[p][q] - (p == q)) * std::sqrt(f.d[p] / f.d[q]) * y[q];
  for (int i = 0; i < 3; ++i)
    for (int p = 0; p < 3; ++p) w[i] += f.l[i][p] * softened[p];
  for (int j = 0; j < 3; ++j) {
    const double one[3] = {j == 0 ? 1.0 : 0.0, j == 1 ? 1.0 : 0.0, j == 2 ? 1.0 : 0.0};
    f.solve(one, unit[j]); // a column of L^-1
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      out[i][j] = sum[i][j] = 0;
      for (int p = 0; p < 3; ++p)
        for (int q = 0; q < 3; ++q) {
          out[i][j] += f.l[i][p] * soft[p][q] * f.root(p, q) * f.l[j][q];
          sum[i][j] += unit[i][p] * kept[p][q] * unit[j][q];
        }
    }
  pack(sum, added);
  pack(out, inverse);
  return true;
}

// Largest eigenvalue of h^2 K over the inertia.
double swing_of(const double stiffness[6], double h, const double inverse[6]) {
  double whole[3][3], k[3][3], v[3][3];
  full(inverse, whole);
  Factors(whole).swings(stiffness, h, k, v);
  return std::max({k[0][0], k[1][1], k[2][2], 0.0});
}

// Six numbers as the contacts have them, in the plane the first alone.
void inverse_of(const Bodies& b, std::int32_t body, double out[6]) {
  std::fill_n(out, 6, 0.0);
  if (b.dim == 2)
    out[0] = b.inverse_mass[body][2];
  else if (b.inverse_inertia.active)
    std::copy_n(b.inverse_inertia[body], 6, out);
  else
    std::copy_n(&b.inverse_mass[body][3], 3, out);
}

} // namespace

void StiffJoints::restore(Simulation& s) {
  Bodies& b = s.scene.bodies;
  const int d = s.scene.dim, n = b.dofs() - d;
  for (const Stiffened& one : stiffened_) {
    std::copy_n(one.spin, n, &b.velocity_free[one.body][d]);
    std::copy_n(one.inverse_mass, n, &b.inverse_mass[one.body][d]);
    if (b.inverse_inertia.active) std::copy_n(one.inverse_inertia, 6, b.inverse_inertia[one.body]);
  }
  stiffened_.clear();
}

bool StiffJoints::stiffen(Simulation& s, double h) {
  Bodies& b = s.scene.bodies;
  const bool was = !stiffened_.empty();
  restore(s);
  s.interactions.joints().loads(loads_);
  const int d = s.scene.dim, n = b.dofs() - d;
  for (const JointLoad& load : loads_) {
    Stiffened one{load.body, {}, {}, {}, {}};
    double *spin = &b.velocity_free[load.body][d], *diagonal = &b.inverse_mass[load.body][d], inverse[6];
    inverse_of(b, load.body, inverse);
    std::copy_n(spin, n, one.spin);
    std::copy_n(diagonal, n, one.inverse_mass);
    if (b.inverse_inertia.active) std::copy_n(b.inverse_inertia[load.body], 6, one.inverse_inertia);
    double stiffness[6];
    std::copy_n(load.stiffness, 6, stiffness);
    if (d == 3 && !b.inverse_inertia.active) { // all bodies are balls: as stiff about each axis as about any
      const double one_axis[6] = {1, 1, 1, 0, 0, 0}, largest = swing_of(stiffness, 1, one_axis);
      for (int k = 0; k < 6; ++k) stiffness[k] = k < 3 ? largest : 0;
    }
    double turns[3] = {}, begin[3] = {};
    std::copy_n(spin, n, turns);
    std::copy_n(&b.velocity[load.body][d], n, begin);
    if (!stiffened_inertia(stiffness, h, inverse, begin, turns, one.added)) continue;
    std::copy_n(turns, n, spin);
    if (b.inverse_inertia.active)
      std::copy_n(inverse, 6, b.inverse_inertia[load.body]);
    else
      std::copy_n(inverse, n, diagonal);
    stiffened_.push_back(one);
  }
  return was || !stiffened_.empty();
}

bool StiffJoints::swing(Simulation& s, double h) {
  constexpr double fast = 3; // square of step times rate; steps hold below 4
  if (s.interactions.joints().swing_across() > fast) return true;
  s.interactions.joints().loads(loads_);
  for (const JointLoad& load : loads_) {
    double inverse[6];
    inverse_of(s.scene.bodies, load.body, inverse);
    if (h * h * bound(load.stiffness, inverse) > fast && swing_of(load.stiffness, h, inverse) > fast) return true;
  }
  return false;
}

double StiffJoints::energy(const Simulation& s) const {
  const Bodies& b = s.scene.bodies;
  const int d = s.scene.dim, n = b.dofs() - d;
  double sum = 0;
  for (const Stiffened& one : stiffened_) {
    const double *now = &b.velocity[one.body][d], *was = &b.velocity_begin[one.body][d];
    double inertia[3][3];
    full(one.added, inertia);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) sum += 0.5 * (now[i] - was[i]) * inertia[i][j] * (now[j] + was[j]);
  }
  return sum;
}

} // namespace cairn
