// Systems of equations as a C++ program has them: every storage against elimination without any trick.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <random>
#include <string>

#include "soe/batched.hpp"
#include "soe/factors.hpp"
#include "soe/soe.hpp"

namespace {

using cairn::Soe;
using cairn::SoeOptions;
using cairn::SoeStatus;
using cairn::SoeStorage;
using cairn::SparseMatrix;

// Gauss' elimination with pivots, in long double.
std::vector<double> eliminate(std::vector<long double> a, std::vector<long double> b, std::int64_t n) {
  for (std::int64_t k = 0; k < n; ++k) {
    std::int64_t p = k;
    for (std::int64_t i = k; i < n; ++i)
      if (std::abs(a[i * n + k]) > std::abs(a[p * n + k])) p = i;
    for (std::int64_t j = 0; j < n; ++j) std::swap(a[k * n + j], a[p * n + j]);
    std::swap(b[k], b[p]);
    for (std::int64_t i = k + 1; i < n; ++i) {
      const long double f = a[i * n + k] / a[k * n + k];
      if (f == 0) continue;
      for (std::int64_t j = k; j < n; ++j) a[i * n + j] -= f * a[k * n + j];
      b[i] -= f * b[k];
    }
  }
  for (std::int64_t k = n; k-- > 0;) {
    for (std::int64_t j = k + 1; j < n; ++j) b[k] -= a[k * n + j] * b[j];
    b[k] /= a[k * n + k];
  }
  return {b.begin(), b.end()};
}

std::vector<long double> full(const SparseMatrix& a, bool symmetric) {
  std::vector<long double> out(a.n * a.n, 0);
  for (std::int64_t j = 0; j < a.n; ++j)
    for (std::int64_t k = a.start[j]; k < a.start[j + 1]; ++k) {
      out[a.row[k] * a.n + j] = a.value[k];
      if (symmetric) out[j * a.n + a.row[k]] = a.value[k];
    }
  return out;
}

// Springs and masses on a square of `side` by `side` nodes, numbered at random; reach 0 leaves the diagonal alone.
SparseMatrix springs(int side, int reach, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> some(0.5, 1.5);
  const int n = side * side;
  std::vector<std::int32_t> number(n);
  for (int i = 0; i < n; ++i) number[i] = i;
  std::shuffle(number.begin(), number.end(), random);
  std::vector<std::int64_t> start{0};
  std::vector<std::int32_t> unknown;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      for (const auto& [dx, dy] : {std::pair(reach, 0), std::pair(0, reach)})
        if (reach > 0 && x + dx < side && y + dy < side) {
          unknown.push_back(number[y * side + x]);
          unknown.push_back(number[(y + dy) * side + x + dx]);
          start.push_back(std::int64_t(unknown.size()));
        }
  SparseMatrix a = cairn::lower_pattern(n, start, unknown);
  for (int i = 0; i < n; ++i) a.value[place_of(a, i, i)] += some(random);
  for (std::size_t c = 0; c + 1 < start.size(); ++c) {
    const auto [low, high] = std::minmax(unknown[start[c]], unknown[start[c] + 1]);
    const double k = 10 * some(random);
    a.value[place_of(a, low, low)] += k;
    a.value[place_of(a, high, high)] += k;
    a.value[place_of(a, high, low)] -= k;
  }
  return a;
}

std::vector<double> numbers(std::int64_t n, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> some;
  std::vector<double> out(n);
  for (double& x : out) x = some(random);
  return out;
}

double largest(const std::vector<double>& x) {
  double out = 0;
  for (const double v : x) out = std::max(out, std::abs(v));
  return out;
}

void expect_close(const std::vector<double>& x, const std::vector<double>& expected, double tolerance) {
  ASSERT_EQ(x.size(), expected.size());
  for (std::size_t i = 0; i < x.size(); ++i) ASSERT_NEAR(x[i], expected[i], tolerance * largest(expected)) << i;
}

struct Kind {
  const char* name;
  SoeOptions options;
};

Kind kind(const char* name, SoeStorage storage, cairn::SoeOrder order = cairn::SoeOrder::automatic,
          cairn::SoeBlocks blocks = cairn::SoeBlocks::automatic) {
  return {name, {storage, order, blocks, {}}};
}

std::vector<Kind> kinds() {
  const SoeStorage sparse = SoeStorage::sparse;
  std::vector<Kind> out{kind("banded", SoeStorage::banded),
                        kind("dense", SoeStorage::dense),
                        kind("sparse", sparse),
                        kind("natural", sparse, cairn::SoeOrder::natural),
                        kind("amd", sparse, cairn::SoeOrder::amd),
                        kind("simplicial", sparse, cairn::SoeOrder::automatic, cairn::SoeBlocks::simplicial)};
  if (std::string(cairn::soe_licence()) == "gpl") {
    out.push_back(kind("supernodal", sparse, cairn::SoeOrder::automatic, cairn::SoeBlocks::supernodal));
    out.push_back(kind("own", sparse, cairn::SoeOrder::automatic, cairn::SoeBlocks::own));
    out.push_back(kind("metis", sparse, cairn::SoeOrder::metis));
  }
  return out;
}

TEST(Soe, EveryStorageSolvesAsElimination) {
  for (const int side : {1, 2, 7, 12})
    for (const Kind& each : kinds()) {
      const SparseMatrix a = springs(side, 1, 3);
      const auto soe = Soe::make(a, each.options);
      ASSERT_TRUE(soe->factor(a.value.data())) << each.name;
      std::vector<double> b = numbers(3 * a.n, 5), x = b;
      soe->solve(x.data(), 3);
      for (int c = 0; c < 3; ++c) {
        SCOPED_TRACE(std::string(each.name) + " " + soe->library());
        const auto begin = b.begin() + c * a.n;
        expect_close({x.begin() + c * a.n, x.begin() + (c + 1) * a.n},
                     eliminate(full(a, true), {begin, begin + a.n}, a.n), 1e-13);
      }
    }
}

TEST(Soe, UnitsThatAreAddedAreThoseOfAllAtOnce) {
  for (const Kind& each : kinds())
    for (const bool at_the_end : {false, true}) {
      const SparseMatrix a = springs(9, 1, 4);
      const std::vector<std::int32_t> wanted{80, 3, 17, 44, 0, 61, 62, 63, 64, 12, 9, 77, 30, 31, 32, 33, 34, 35};
      SoeOptions options = each.options;
      options.held.assign(a.n, 0);
      options.held[17] = options.held[50] = 1;
      options.last.assign(a.n, 0);
      for (const std::int32_t i : wanted) options.last[i] = at_the_end;
      const auto soe = Soe::make(a, options);
      ASSERT_TRUE(soe->factor(a.value.data()));
      const std::int64_t m = std::int64_t(wanted.size()), leading = m + 5;
      std::vector<double> all(m * m), out(leading * leading, std::numeric_limits<double>::quiet_NaN());
      soe->solve_units(wanted, all.data());
      for (const auto& [known, now] : {std::pair<std::int64_t, std::int64_t>{0, 2}, {2, 3}, {3, 14}, {14, m}})
        soe->add_units({wanted.data(), std::size_t(now)}, known, out.data(), leading);
      for (std::int64_t j = 0; j < m; ++j)
        for (std::int64_t i = 0; i < m; ++i) {
          ASSERT_EQ(out[leading * j + i], all[m * j + i]) << each.name << " " << i << " " << j;
          ASSERT_EQ(out[leading * j + i], out[leading * i + j]);
        }
    }
}

// Few unknowns, whose right-hand sides are stored, and all unknowns, whose storage would exceed half of that of the
// factors; requested in growing and shrinking portions; an unknown requested twice.
TEST(Soe, UnitsThatAreAddedInAnyTurnsKeepTheirBits) {
  std::mt19937 random(8);
  for (const Kind& each : kinds())
    for (const int side : {4, 24}) // of 16 unknowns all are asked for
      for (const bool falling : {false, true}) {
        const SparseMatrix a = springs(side, 1, 4);
        const auto soe = Soe::make(a, each.options);
        ASSERT_TRUE(soe->factor(a.value.data()));
        std::vector<std::int32_t> all(a.n);
        std::iota(all.begin(), all.end(), 0);
        std::shuffle(all.begin(), all.end(), random);
        if (side == 24) all.resize(40);
        all.push_back(all[3]);
        const std::int64_t m = std::int64_t(all.size());
        std::vector<double> expected(m * m), out(m * m);
        soe->solve_units(all, expected.data());
        std::int64_t known = 0;
        for (std::int64_t more = falling ? m / 2 : 1; known < m;
             more = falling ? std::max<std::int64_t>(more / 2, 1) : 2 * more) {
          const std::int64_t now = std::min(known + more, m);
          soe->add_units({all.data(), std::size_t(now)}, known, out.data(), m, falling ? 2 : 1);
          known = now;
        }
        ASSERT_EQ(out, expected) << each.name << " " << side << " " << falling;
        soe->add_units(all, 5, out.data(), m); // other than those of the last call: all are made again
        ASSERT_EQ(out, expected) << each.name;
        const double times_four = 4;
        std::vector<double> value = a.value;
        for (double& x : value) x *= times_four;
        ASSERT_TRUE(soe->factor(value.data()));
        soe->add_units(all, m - 1, out.data(), m); // of other factors
        for (std::size_t i = 0; i < out.size(); ++i) ASSERT_EQ(times_four * out[i], expected[i]) << each.name;
      }
}

// More than one thread takes at once.
TEST(Soe, ManyUnitsKeepTheirBitsUnderAnyNumberOfThreads) {
  for (const Kind& each : kinds()) {
    const SparseMatrix a = springs(24, 1, 4);
    const auto soe = Soe::make(a, each.options);
    ASSERT_TRUE(soe->factor(a.value.data()));
    std::vector<std::int32_t> all(a.n);
    std::iota(all.begin(), all.end(), 0);
    std::vector<double> one(a.n * a.n), more(a.n * a.n), b = numbers(a.n, 9), product(a.n);
    soe->solve_units(all, one.data());
    soe->solve_units(all, more.data(), 3);
    ASSERT_EQ(one, more) << each.name;
    for (std::int64_t j = 0; j < a.n; ++j)
      for (std::int64_t i = 0; i < a.n; ++i) product[i] += one[a.n * j + i] * b[j];
    soe->solve(b.data());
    expect_close(product, b, 1e-13);
  }
}

TEST(Soe, UnitsAreEntriesOfTheInverse) {
  std::vector<Kind> all = kinds();
  for (const Kind& each : all) {
    const SparseMatrix a = springs(9, 1, 4);
    const auto soe = Soe::make(a, each.options);
    ASSERT_TRUE(soe->factor(a.value.data()));
    const std::vector<std::int32_t> wanted{80, 3, 17, 44, 3, 0, 61, 62, 63, 64, 12, 9, 77, 30, 31, 32, 33, 34, 35};
    const std::int64_t m = std::int64_t(wanted.size());
    std::vector<double> out(m * m), twice(m * m), column(a.n);
    soe->solve_units(wanted, out.data());
    soe->solve_units(wanted, twice.data(), 2);
    ASSERT_EQ(out, twice) << each.name;
    for (std::int64_t j = 0; j < m; ++j) {
      std::fill(column.begin(), column.end(), 0.0);
      column[wanted[j]] = 1;
      soe->solve(column.data());
      for (std::int64_t i = 0; i < m; ++i) {
        ASSERT_NEAR(out[i * m + j], column[wanted[i]], 1e-15 * largest(column)) << each.name;
        ASSERT_EQ(out[i * m + j], out[j * m + i]);
      }
    }
  }
}

TEST(Soe, BitsDoNotDependOnThreadsColumnsOrUnits) {
  for (const Kind& each : kinds()) {
    SCOPED_TRACE(each.name);
    SparseMatrix a = springs(11, 1, 6);
    const auto soe = Soe::make(a, each.options);
    ASSERT_TRUE(soe->factor(a.value.data()));
    const std::int64_t n = a.n, columns = 21;
    const std::vector<double> b = numbers(columns * n, 7);
    std::vector<double> one = b, two = b, alone = b;
    soe->solve(one.data(), columns, 1);
    soe->solve(two.data(), columns, 2);
    for (std::int64_t c = 0; c < columns; ++c) soe->solve(alone.data() + c * n);
    ASSERT_EQ(one, two);
    ASSERT_EQ(one, alone);
    for (const int power : {-601, 1, 2, 17, 600}) { // the whole, and unknown 5 in another unit
      SparseMatrix other = a;
      for (std::int64_t j = 0; j < n; ++j)
        for (std::int64_t k = a.start[j]; k < a.start[j + 1]; ++k)
          other.value[k] = std::ldexp(a.value[k], power - 3 * (j == 5) - 3 * (a.row[k] == 5));
      ASSERT_TRUE(soe->factor(other.value.data()));
      std::vector<double> x(b.begin(), b.begin() + n);
      x[5] = std::ldexp(x[5], -3);
      soe->solve(x.data());
      for (std::int64_t i = 0; i < n; ++i) ASSERT_EQ(std::ldexp(x[i], power - 3 * (i == 5)), one[i]) << power;
    }
  }
}

TEST(Soe, HeldUnknownsStayAndPull) {
  for (const Kind& each : kinds()) {
    const SparseMatrix a = springs(8, 1, 8);
    SoeOptions options = each.options;
    options.held.assign(a.n, 0);
    for (const int i : {0, 13, 40}) options.held[i] = 1;
    const auto soe = Soe::make(a, options);
    ASSERT_TRUE(soe->factor(a.value.data()));
    const std::vector<double> b = numbers(a.n, 9);
    std::vector<double> x = b;
    soe->solve(x.data());
    const std::vector<long double> dense = full(a, true);
    for (std::int64_t i = 0; i < a.n; ++i) {
      if (options.held[i]) {
        ASSERT_EQ(x[i], b[i]);
        continue;
      }
      long double residual = b[i];
      for (std::int64_t j = 0; j < a.n; ++j) residual -= dense[i * a.n + j] * x[j];
      ASSERT_NEAR(double(residual), 0, 1e-13 * largest(b)) << each.name;
    }
    const std::vector<std::int32_t> wanted{13, 14};
    double out[4];
    soe->solve_units(wanted, out);
    ASSERT_EQ(out[0], 0);
    ASSERT_EQ(out[1], 0);
    ASSERT_GT(out[3], 0);
  }
}

TEST(Soe, WhatCannotBeFactorisedIsNamed) {
  std::vector<Kind> all = kinds();
  all.push_back(kind("diagonal", SoeStorage::diagonal));
  for (const Kind& each : all) {
    const bool diagonal = each.options.storage == SoeStorage::diagonal;
    SparseMatrix a = springs(5, diagonal ? 0 : 1, 10);
    const auto soe = Soe::make(a, each.options);
    const std::vector<double> good = a.value;
    a.value[place_of(a, 7, 7)] = std::nan("");
    EXPECT_EQ(soe->factor(a.value.data()).kind, SoeStatus::not_finite);
    EXPECT_EQ(soe->factor(a.value.data()).row, 7);
    a.value[place_of(a, 7, 7)] = -1;
    EXPECT_EQ(soe->factor(a.value.data()).kind, SoeStatus::indefinite);
    EXPECT_EQ(soe->factor(a.value.data()).row, 7);
    a.value[place_of(a, 7, 7)] = 0;
    EXPECT_EQ(soe->factor(a.value.data()).kind, SoeStatus::singular);
    EXPECT_FALSE(soe->factorised());
    double b[25] = {};
    EXPECT_THROW(soe->solve(b), std::runtime_error);
    EXPECT_TRUE(soe->factor(good.data())); // and a good one after it
    if (diagonal) continue;
    for (std::size_t k = 0; k < a.value.size(); ++k) a.value[k] = good[k]; // springs alone: one may drift
    for (int i = 0; i < 25; ++i) a.value[place_of(a, i, i)] = 0;
    for (std::int64_t j = 0; j < a.n; ++j)
      for (std::int64_t k = a.start[j]; k < a.start[j + 1]; ++k)
        if (a.row[k] != j) {
          a.value[k] = -1;
          a.value[place_of(a, j, j)] += 1;
          a.value[place_of(a, a.row[k], a.row[k])] += 1;
        }
    EXPECT_FALSE(soe->factor(a.value.data())) << each.name;
    EXPECT_GE(soe->factor(a.value.data()).row, 0) << each.name;
  }
}

TEST(Soe, MatricesThatAreNotSymmetric) {
  SparseMatrix lower = springs(6, 1, 11), a;
  a.n = lower.n;
  const std::vector<long double> dense = full(lower, true);
  std::mt19937 random(12);
  std::uniform_real_distribution<double> some(0.1, 2.0);
  for (std::int64_t j = 0; j < a.n; ++j) {
    for (std::int32_t i = 0; i < a.n; ++i)
      if (dense[i * a.n + j] != 0) {
        a.row.push_back(i);
        a.value.push_back(double(dense[i * a.n + j]) * some(random) * std::pow(10.0, i % 7));
      }
    a.start.push_back(std::int64_t(a.row.size()));
  }
  std::unique_ptr<Soe> soe;
  try {
    soe = Soe::make(a, kind("unsymmetric", SoeStorage::unsymmetric).options);
  } catch (const std::runtime_error& e) { GTEST_SKIP() << e.what(); }
  ASSERT_TRUE(soe->factor(a.value.data()));
  std::vector<double> b = numbers(a.n, 13), x(b);
  soe->solve(x.data());
  expect_close(x, eliminate(full(a, false), {b.begin(), b.end()}, a.n), 1e-12);
  const std::vector<std::int32_t> wanted{3, 30, 8};
  double out[9];
  soe->solve_units(wanted, out);
  std::vector<double> unit(a.n, 0.0);
  unit[30] = 1;
  soe->solve(unit.data());
  EXPECT_EQ(out[0 * 3 + 1], unit[3]);
  for (std::int64_t k = 0; k < std::int64_t(a.row.size()); ++k)
    if (a.row[k] == 20) a.value[k] = 0;
  EXPECT_EQ(soe->factor(a.value.data()).kind, SoeStatus::singular);
}

TEST(Soe, EigensColumnsAreThoseOfCholmod) {
  const SparseMatrix a = springs(10, 1, 14);
  const auto eigen = cairn::make_ldlt(a, {});
  if (!eigen) GTEST_SKIP() << "built without Eigen";
  ASSERT_TRUE(eigen->factor(a));
  const std::vector<double> b = numbers(a.n, 15);
  std::vector<double> y(a.n), x(a.n);
  for (std::int64_t i = 0; i < a.n; ++i) y[i] = b[eigen->order()[i]];
  eigen->solve(1, y.data(), nullptr);
  for (std::int64_t i = 0; i < a.n; ++i) x[eigen->order()[i]] = y[i];
  expect_close(x, eliminate(full(a, true), {b.begin(), b.end()}, a.n), 1e-13);
}

TEST(BatchedSoe, SolvesAsATextbookLoop) {
  for (const int n : {0, 1, 3, 6, 8, 24})
    for (const int bodies : {0, 1, 8, 13, 40}) {
      std::mt19937 random(n + 100 * bodies);
      std::normal_distribution<double> some;
      std::vector<double> a(std::size_t(bodies) * n * n), b = numbers(std::int64_t(bodies) * n, 16), x = b;
      for (int body = 0; body < bodies; ++body) {
        double* const m = a.data() + std::size_t(body) * n * n;
        std::vector<double> g(n * n);
        for (double& v : g) v = some(random);
        const double scale = std::ldexp(1.0, 20 * (body % 5) - 40);
        for (int i = 0; i < n; ++i)
          for (int j = 0; j < n; ++j) {
            m[i * n + j] = i == j ? scale * n : 0;
            for (int k = 0; k < n; ++k) m[i * n + j] += scale * g[i * n + k] * g[j * n + k];
          }
      }
      cairn::BatchedSoe batch(bodies, n);
      ASSERT_TRUE(batch.factor(a.data(), 2));
      batch.solve(x.data(), 2);
      std::vector<double> inverse(a.size()), again = b;
      batch.inverse(inverse.data());
      batch.solve(again.data());
      ASSERT_EQ(x, again);
      for (int body = 0; body < bodies; ++body) {
        const double* const m = a.data() + std::size_t(body) * n * n;
        const std::vector<long double> dense(m, m + n * n);
        const std::vector<double> expected = eliminate(dense, {b.begin() + body * n, b.begin() + (body + 1) * n}, n);
        expect_close({x.begin() + body * n, x.begin() + (body + 1) * n}, expected, 1e-13);
        for (int j = 0; j < n; ++j) {
          std::vector<long double> unit(n, 0);
          unit[j] = 1;
          const double* const row = inverse.data() + (std::size_t(body) * n + j) * n;
          expect_close({row, row + n}, eliminate(dense, unit, n), 1e-12);
        }
      }
    }
}

TEST(BatchedSoe, NamesTheFirstBodyThatFails) {
  const int n = 3, bodies = 20;
  std::vector<double> a(bodies * n * n, 0.0), b(bodies * n, 1.0);
  for (int body = 0; body < bodies; ++body)
    for (int i = 0; i < n; ++i) a[(body * n + i) * n + i] = 2;
  cairn::BatchedSoe batch(bodies, n);
  a[(17 * n + 2) * n + 2] = -1;
  a[(11 * n + 1) * n + 0] = a[(11 * n + 1) * n + 1] = 2; // rows 0 and 1 alike
  cairn::BatchedSoe::Status status = batch.factor(a.data());
  EXPECT_EQ(status.body, 11);
  EXPECT_EQ(status.row, 1);
  EXPECT_EQ(status.kind, SoeStatus::singular);
  batch.solve(b.data());
  for (const int body : {10, 12, 16}) EXPECT_EQ(b[body * n], 0.5);
  a[(4 * n + 1) * n + 1] = std::numeric_limits<double>::infinity();
  status = batch.factor(a.data(), 2);
  EXPECT_EQ(status.body, 4);
  EXPECT_EQ(status.row, 1);
  EXPECT_EQ(status.kind, SoeStatus::not_finite);
}

} // namespace
