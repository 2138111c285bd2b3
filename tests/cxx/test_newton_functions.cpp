// The functions of the Newton solvers: their zeros are solutions of Coulomb's law, and their rows are those of the
// derivative.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "cairn/core.h"

namespace {

using Function = void(std::int32_t, std::int64_t, const double*, const double*, const double*, const double*,
                      std::int32_t, double*, std::int32_t*, double*, double*, double*, double*, double*);

struct Named {
  const char* name;
  Function* function;
};
void PrintTo(const Named& f, std::ostream* out) { *out << f.name; }

// One contact: f, and the rows left du + own y = target of its derivative, dr = step + basis y.
struct Contact {
  int dim;
  double mu;
  std::array<double, 2> rho;
  std::array<double, 3> r, u, f, step, target;
  std::array<double, 9> left, basis, own;
  std::int32_t unknowns;

  void evaluate(Function* function, int want) {
    function(dim, 1, &mu, rho.data(), r.data(), u.data(), want, f.data(), &unknowns, left.data(), basis.data(),
             own.data(), step.data(), target.data());
  }
};

// The nearest (du, y) to `x` with left du + own y = target: x + A' (A A')^-1 (target - A x).
void satisfy_rows(const Contact& c, std::array<double, 6>& x) {
  const int d = c.dim;
  double a[3][6], g[3][4] = {};
  for (int i = 0; i < d; ++i)
    for (int j = 0; j < d; ++j) {
      a[i][j] = c.left[i + d * j];
      a[i][d + j] = c.own[i + d * j];
    }
  for (int i = 0; i < d; ++i) {
    g[i][d] = c.target[i];
    for (int k = 0; k < 2 * d; ++k) {
      g[i][d] -= a[i][k] * x[k];
      for (int j = 0; j < d; ++j) g[i][j] += a[i][k] * a[j][k];
    }
  }
  for (int p = 0; p < d; ++p) // positive definite: no pivoting
    for (int i = 0; i < d; ++i) {
      if (i == p) continue;
      const double factor = g[i][p] / g[p][p];
      for (int j = p; j <= d; ++j) g[i][j] -= factor * g[p][j];
    }
  for (int k = 0; k < 2 * d; ++k)
    for (int i = 0; i < d; ++i) x[k] += a[i][k] * g[i][d] / g[i][i];
}

class NewtonFunction : public testing::TestWithParam<Named> {};

// Along a step that satisfies the rows, f falls as 1 - t: the derivative of f there is -f. Central differences.
TEST_P(NewtonFunction, RowsAreTheDerivative) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int counts[4] = {};
  for (int trial = 0; trial < 4000; ++trial) {
    Contact c{};
    c.dim = 2 + trial % 2;
    c.mu = trial % 10 == 0 ? 0.0 : 1.5 * std::abs(uniform(random));
    c.rho = {0.3 + std::abs(uniform(random)), 0.3 + std::abs(uniform(random))};
    for (int i = 0; i < c.dim; ++i) {
      c.r[i] = uniform(random) + (i == 0 ? 0.7 : 0.0);
      c.u[i] = 0.5 * uniform(random);
    }
    c.evaluate(GetParam().function, 1);
    ++counts[c.unknowns];
    std::array<double, 6> x{}; // du, y
    for (double& value : x) value = uniform(random);
    if (c.unknowns > 0) satisfy_rows(c, x);
    std::array<double, 3> dr = c.step;
    for (int i = 0; i < c.dim; ++i)
      for (int j = 0; j < c.dim && c.unknowns > 0; ++j) dr[i] += c.basis[i + c.dim * j] * x[c.dim + j];
    const auto at = [&](double t) {
      Contact moved = c;
      for (int i = 0; i < c.dim; ++i) {
        moved.r[i] += t * dr[i];
        moved.u[i] += t * x[i];
      }
      moved.evaluate(GetParam().function, 0);
      return moved.f;
    };
    double size = 1, largest = 0, smooth = 0;
    for (int i = 0; i < c.dim; ++i) size = std::max({size, std::abs(dr[i]), std::abs(x[i])});
    const double t = 1e-6 / size;
    const auto ahead = at(t), behind = at(-t), far = at(3 * t);
    for (int i = 0; i < c.dim; ++i) {
      largest = std::max(largest, std::abs((ahead[i] - behind[i]) / (2 * t) + c.f[i]));
      smooth = std::max(smooth, std::abs((far[i] - ahead[i]) / (2 * t) - (ahead[i] - behind[i]) / (2 * t)));
    }
    if (smooth > 1e-3 * size) continue; // a corner between the points
    EXPECT_LT(largest, 1e-5 * size * size)
        << GetParam().name << " dim " << c.dim << " mu " << c.mu << " trial " << trial;
  }
  EXPECT_GT(counts[2] + counts[3], 500);
}

// Open, sticking and slipping states of Coulomb's law are zeros; states that violate it are not.
TEST_P(NewtonFunction, ZerosAreTheLaw) {
  for (const double scale : {1e-6, 1.0, 1e6}) {
    Contact c{};
    c.dim = 3;
    c.mu = 0.5;
    c.rho = {2.0, 1.5};
    const auto residual = [&](std::array<double, 3> r, std::array<double, 3> u) {
      for (int i = 0; i < 3; ++i) {
        c.r[i] = scale * r[i];
        c.u[i] = scale * u[i];
      }
      c.evaluate(GetParam().function, 0);
      return std::sqrt(c.f[0] * c.f[0] + c.f[1] * c.f[1] + c.f[2] * c.f[2]) / scale;
    };
    EXPECT_LT(residual({0, 0, 0}, {1, 0.3, -0.2}), 1e-14);
    EXPECT_LT(residual({2, 0.3, -0.4}, {0, 0, 0}), 1e-14);
    EXPECT_LT(residual({2, 0.6, -0.8}, {0, -0.3, 0.4}), 1e-14);
    EXPECT_GT(residual({2, 0.6, -0.8}, {0, 0.3, 0.4}), 0.1);
    EXPECT_GT(residual({2, 0.6, -1.8}, {0, 0, 0}), 0.1);
    EXPECT_GT(residual({0, 0, 0}, {-1, 0, 0}), 0.1);
    EXPECT_GT(residual({2, 0, 0}, {1, 0, 0}), 0.1);
  }
}

INSTANTIATE_TEST_SUITE_P(All, NewtonFunction,
                         testing::Values(Named{"alart_curnier", cairn_newton_alart_curnier},
                                         Named{"jean_moreau", cairn_newton_jean_moreau},
                                         Named{"fischer_burmeister", cairn_newton_fischer_burmeister}),
                         [](const auto& info) { return std::string(info.param.name); });

// Factors of a matrix on a ring of contacts, one of which is left out, against the product.
TEST(BlockFactors, SolveWhatTheyFactor) {
  for (const int dim : {2, 3}) {
    constexpr int n = 6;
    const int size = dim * dim;
    std::mt19937 random(dim);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::vector<std::int64_t> row_start{0};
    std::vector<std::int32_t> column, order{3, 0, 5, 1, 4, 2}, place(n), active(n, 1);
    for (int i = 0; i < n; ++i) place[order[i]] = i;
    active[4] = 0;
    for (int a = 0; a < n; ++a) {
      for (int b = 0; b < n; ++b)
        if (a == b || (a + 1) % n == b || (b + 1) % n == a) column.push_back(b);
      row_start.push_back(std::int64_t(column.size()));
    }
    std::vector<double> block(size * column.size());
    for (double& x : block) x = uniform(random);
    std::vector<std::int64_t> lower_start(n + 1), upper_start(n + 1), lower_last(n), upper_last(n);
    std::vector<std::int32_t> lower, upper; // full triangles: zeros are found by the kernel
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < i; ++j) lower.push_back(j);
      for (int j = i + 1; j < n; ++j) upper.push_back(j);
      lower_start[i + 1] = std::int64_t(lower.size());
      upper_start[i + 1] = std::int64_t(upper.size());
    }
    std::vector<std::int32_t> lower_kept(lower.size()), upper_kept(upper.size());
    std::vector<double> l(size * lower.size()), u(size * upper.size()), diagonal(size * n), work(size * n), x(dim * n),
        b(dim * n), workspace(dim * n);
    for (double& value : x) value = uniform(random);
    for (int a = 0; a < n; ++a)
      for (std::int64_t k = row_start[a]; k < row_start[a + 1]; ++k)
        for (int i = 0; i < size; ++i)
          if (active[a] && active[column[k]])
            b[dim * a + i % dim] += block[size * k + i] * x[dim * column[k] + i / dim];
    ASSERT_EQ(cairn_block_factor(dim, n, order.data(), place.data(), row_start.data(), column.data(), block.data(),
                                 active.data(), lower_start.data(), lower.data(), upper_start.data(), upper.data(),
                                 lower_last.data(), lower_kept.data(), upper_last.data(), upper_kept.data(), l.data(),
                                 u.data(), diagonal.data(), work.data()),
              0);
    EXPECT_LT(upper_last[0] - upper_start[0], 4); // fill is kept where it is, no more
    cairn_block_solve(dim, n, order.data(), active.data(), lower_start.data(), lower_last.data(), lower_kept.data(),
                      upper_start.data(), upper_last.data(), upper_kept.data(), l.data(), u.data(), diagonal.data(),
                      b.data(), workspace.data());
    for (int i = 0; i < dim * n; ++i) {
      if (active[i / dim] == 0) continue;
      EXPECT_NEAR(b[i], x[i], 1e-10) << dim << " " << i;
    }
  }
}

} // namespace
