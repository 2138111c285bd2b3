// Factors and eigenvalues of small symmetric matrices, against products and closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "base/small_matrices.hpp"
#include "base/vectors.hpp"

namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

// G G' of a random G (n, rank), by columns.
std::vector<double> gram(std::size_t n, std::size_t rank, unsigned seed) {
  std::mt19937 draw(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> g(n * rank), a(n * n, 0.0);
  for (double& x : g) x = uniform(draw);
  for (std::size_t j = 0; j < n; ++j)
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < rank; ++k) a[n * j + i] += g[n * k + i] * g[n * k + j];
  return a;
}

TEST(SmallMatrices, SolutionsOfADefiniteMatrixGiveTheirRightSide) {
  for (std::size_t n = 1; n <= 9; ++n) {
    const std::vector<double> a = gram(n, n + 2, unsigned(n));
    std::vector<double> factors = a, x(n);
    for (std::size_t i = 0; i < n; ++i) x[i] = double(i) - 1.5;
    std::vector<double> b(n, 0.0);
    for (std::size_t j = 0; j < n; ++j)
      for (std::size_t i = 0; i < n; ++i) b[i] += a[n * j + i] * x[j];
    EXPECT_TRUE(cairn::factor_symmetric(n, factors.data(), 1e-13));
    cairn::solve_symmetric(n, factors.data(), b.data());
    for (std::size_t i = 0; i < n; ++i) EXPECT_NEAR(b[i], x[i], 1e6 * epsilon * double(n)) << n;
  }
}

TEST(SmallMatrices, AnUnknownThatNothingHoldsIsZeroInAnyUnits) {
  for (const double unit : {1.0, 0x1p-40, 0x1p40}) { // of the second unknown
    double a[9] = {2, unit, 0, unit, unit * unit / 2, 0, 0, 0, 3}, b[3] = {4, 2 * unit, 6};
    EXPECT_FALSE(cairn::factor_symmetric(3, a, 1e-13));
    cairn::solve_symmetric(3, a, b);
    EXPECT_EQ(b[0], 2);
    EXPECT_EQ(b[1], 0);
    EXPECT_EQ(b[2], 2);
  }
}

TEST(SmallMatrices, TheInverseIsThatOfTheFactors) {
  constexpr std::size_t n = 6;
  const std::vector<double> whole = gram(n, n + 1, 3);
  std::vector<double> factors = whole;
  double a[n + 1][n + 1] = {};
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) a[i][j] = whole[n * j + i];
  EXPECT_TRUE(cairn::invert_symmetric(n, a, 1e-13));
  cairn::factor_symmetric(n, factors.data(), 1e-13);
  for (std::size_t j = 0; j < n; ++j) {
    double column[n] = {};
    column[j] = 1;
    cairn::solve_symmetric(n, factors.data(), column);
    for (std::size_t i = 0; i < n; ++i) EXPECT_NEAR(a[i][j], column[i], 1e6 * epsilon);
  }
  double loose[2][2] = {{0, 0}, {0, 4}};
  EXPECT_FALSE(cairn::invert_symmetric(2, loose, 1e-12));
  EXPECT_EQ(loose[0][0], 0);
  EXPECT_EQ(loose[1][1], 0.25);
}

TEST(SmallMatrices, AnIndefiniteMatrixIsSolvedAndToldOf) {
  double a[4] = {1, 2, 2, 1}, b[2] = {5, 4};
  EXPECT_FALSE(cairn::factor_symmetric(2, a, 0));
  cairn::solve_symmetric(2, a, b);
  EXPECT_EQ(b[0], 1);
  EXPECT_EQ(b[1], 2);
}

TEST(SmallMatrices, EigenvectorsDiagonalise) {
  const std::vector<double> whole = gram(4, 4, 7);
  double a[4][4], v[4][4];
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) a[i][j] = whole[4 * j + i];
  cairn::diagonalise(a, v);
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t i = 0; i < 4; ++i) {
      double product = 0, between = 0;
      for (std::size_t j = 0; j < 4; ++j) product += whole[4 * j + i] * v[j][k], between += v[j][i] * v[j][k];
      EXPECT_NEAR(product, a[k][k] * v[i][k], 64 * epsilon);
      EXPECT_NEAR(between, i == k ? 1 : 0, 16 * epsilon);
    }
}

TEST(SmallMatrices, EigenvaluesScaleWithTheirUnit) {
  double one[3][3] = {{2, 1, 0}, {1, 2, 0}, {0, 0, 5}}, tiny[3][3], v[3][3], w[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) tiny[i][j] = 0x1p-900 * one[i][j];
  cairn::diagonalise(one, v);
  cairn::diagonalise(tiny, w);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(tiny[i][i], 0x1p-900 * one[i][i]);
    for (int j = 0; j < 3; ++j) EXPECT_EQ(v[i][j], w[i][j]);
  }
  double values[3] = {one[0][0], one[1][1], one[2][2]};
  std::sort(values, values + 3);
  EXPECT_NEAR(values[0], 1, 8 * epsilon);
  EXPECT_NEAR(values[1], 3, 8 * epsilon);
  EXPECT_EQ(values[2], 5);
}

TEST(Vectors, ACrossProductIsSquareToBothAndTurnsFromOneToTheOther) {
  const double a[3] = {1, 2, 3}, b[3] = {-2, 0.5, 4};
  double c[3], sum[3] = {1, 1, 1};
  cairn::cross(a, b, c);
  EXPECT_EQ(c[0], 6.5);
  EXPECT_EQ(c[1], -10);
  EXPECT_EQ(c[2], 4.5);
  EXPECT_EQ(cairn::dot(a, c), 0);
  EXPECT_EQ(cairn::dot(b, c, 3), 0);
  cairn::add_cross(a, b, sum);
  EXPECT_EQ(sum[0], 7.5);
}

} // namespace
