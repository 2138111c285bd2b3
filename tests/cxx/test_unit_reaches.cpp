// Columns of inverse factors along their reaches, against entries of the inverse that were found otherwise.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "base/call.hpp"
#include "cairn/core.h"
#include "soe/soe.hpp"
#include "soe/unit_reaches.hpp"

namespace cairn {
namespace {

// Cells of a strip of 2 x cells squares, two unknowns a node: each a random matrix that is positive definite.
struct Strip {
  SparseMatrix matrix;
  std::int64_t nodes = 0;
};

Strip strip(std::int64_t cells, double scale = 1) {
  constexpr std::size_t size = 8;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::vector<std::int64_t> start{0};
  std::vector<std::int32_t> unknown;
  std::vector<double> full;
  for (std::int32_t c = 0; c < 2 * cells; ++c) {
    const std::int32_t corner = 3 * (c / 2) + c % 2;
    for (const std::int32_t node : {corner, corner + 1, corner + 3, corner + 4})
      for (std::int32_t k = 0; k < 2; ++k) unknown.push_back(2 * node + k);
    start.push_back(std::int64_t(unknown.size()));
    double root[size][size];
    for (auto& row : root)
      for (double& x : row) x = normal(random);
    for (std::size_t j = 0; j < size; ++j)
      for (std::size_t i = 0; i < size; ++i) {
        double sum = i == j ? 0.1 : 0.0;
        for (std::size_t k = 0; k < size; ++k) sum += root[i][k] * root[j][k];
        full.push_back(scale * sum);
      }
  }
  Strip out;
  out.nodes = 3 * (cells + 1);
  out.matrix = lower_pattern(2 * out.nodes, start, unknown);
  add_cliques(out.matrix, start, unknown, full.data(), out.matrix.value);
  return out;
}

std::vector<SoeOptions> sparse_kinds() {
  std::vector<SoeOptions> out;
  for (const SoeOrder order : {SoeOrder::amd, SoeOrder::natural})
    for (const SoeBlocks blocks : {SoeBlocks::automatic, SoeBlocks::simplicial}) {
      SoeOptions options;
      options.storage = SoeStorage::sparse;
      options.order = order;
      options.blocks = blocks;
      out.push_back(options);
    }
  if (std::string(soe_licence()) == "gpl") {
    out.push_back(out.front());
    out.back().blocks = SoeBlocks::own;
  }
  return out;
}

// Column c of group g in full.
std::vector<double> column(const UnitReaches& z, std::int64_t g, int together, int c) {
  std::vector<double> out(std::size_t(z.equations), 0.0);
  const double* value = z.value[std::size_t(g)];
  for (std::int64_t s = z.first[std::size_t(g)]; s < z.first[std::size_t(g) + 1]; ++s) {
    const std::int64_t length = z.length[std::size_t(s)];
    std::copy_n(value + c * length, length, out.begin() + z.place[std::size_t(s)]);
    value += together * length;
  }
  return out;
}

std::int64_t numbers(const UnitReaches& z, int together) {
  return together * std::accumulate(z.length.begin(), z.length.end(), std::int64_t(0));
}

std::vector<std::int32_t> unknowns_of(const std::vector<std::int32_t>& nodes) {
  std::vector<std::int32_t> out;
  for (const std::int32_t n : nodes) out.insert(out.end(), {2 * n, 2 * n + 1});
  return out;
}

TEST(UnitReaches, ProductsAreEntriesOfTheInverse) {
  const std::vector<std::int32_t> nodes{40, 3, 0, 119, 61, 62, 17, 120};
  const std::vector<std::int32_t> wanted = unknowns_of(nodes);
  const auto m = std::int64_t(wanted.size());
  for (const double scale : {1.0, 2.0, 1e-9}) // 2: the unit is no square
    for (SoeOptions options : sparse_kinds()) {
      const Strip a = strip(60, scale);
      options.held.assign(std::size_t(a.matrix.n), 0);
      options.held[2 * 61] = options.held[7] = options.held[34] = options.held[35] = 1; // one axis; elsewhere; a node
      const auto soe = Soe::make(a.matrix, options);
      ASSERT_TRUE(soe->factor(a.matrix.value.data()));
      std::vector<double> entries(std::size_t(m * m));
      soe->solve_units(wanted, entries.data());
      UnitReaches z;
      soe->add_reaches(wanted, 2, z);
      ASSERT_EQ(z.groups(), std::int64_t(nodes.size()));
      ASSERT_EQ(numbers(z, 2), soe->reach_numbers(wanted, 2));
      ASSERT_LT(numbers(z, 2), m * z.equations); // a reach is a part
      for (std::int64_t j = 0; j < m; ++j)
        for (std::int64_t i = 0; i < m; ++i) {
          const std::vector<double> one = column(z, i / 2, 2, int(i % 2)), other = column(z, j / 2, 2, int(j % 2));
          const double product = z.unit * std::inner_product(one.begin(), one.end(), other.begin(), 0.0);
          const double size = std::sqrt(entries[std::size_t(m * i + i)] * entries[std::size_t(m * j + j)]);
          ASSERT_LE(std::abs(product - entries[std::size_t(m * j + i)]), 1e-13 * size) << soe->library();
        }
    }
}

TEST(UnitReaches, HaveTheSameBitsInAnyTurnsAndUnderAnyNumberOfThreads) {
  for (const SoeOptions& options : sparse_kinds()) {
    const Strip a = strip(120);
    const auto soe = Soe::make(a.matrix, options);
    ASSERT_TRUE(soe->factor(a.matrix.value.data()));
    std::vector<std::int32_t> nodes(std::size_t(a.nodes));
    std::iota(nodes.begin(), nodes.end(), 0);
    std::mt19937 random(5);
    std::shuffle(nodes.begin(), nodes.end(), random);
    const std::vector<std::int32_t> wanted = unknowns_of(nodes);
    UnitReaches at_once, in_turns;
    soe->add_reaches(wanted, 2, at_once, 3);
    std::size_t known = 0;
    for (const std::size_t now : {std::size_t(2), std::size_t(30), wanted.size()}) {
      soe->add_reaches(std::span(wanted).subspan(known, now - known), 2, in_turns);
      known = now;
    }
    ASSERT_EQ(at_once.first, in_turns.first);
    ASSERT_EQ(at_once.place, in_turns.place);
    ASSERT_EQ(at_once.length, in_turns.length);
    for (std::int64_t g = 0; g < at_once.groups(); ++g)
      for (int c = 0; c < 2; ++c) ASSERT_EQ(column(at_once, g, 2, c), column(in_turns, g, 2, c));
    EXPECT_GE(at_once.bytes(), 8 * numbers(at_once, 2));
    at_once.clear();
    EXPECT_EQ(at_once.groups(), 0);
    EXPECT_EQ(at_once.first, std::vector<std::int64_t>{0});
  }
}

// Condensed body of contacts, by its compliance and by reaches: blocks, and velocities due to impulses.
TEST(UnitReaches, MakeTheSameCondensedBody) {
  const std::vector<std::int32_t> nodes{40, 3, 0, 119, 61, 62, 17, 120};
  const std::vector<std::int32_t> wanted = unknowns_of(nodes);
  const auto m = std::int64_t(wanted.size());
  for (const SoeOptions& options : sparse_kinds()) {
    const Strip a = strip(60, 2.0);
    const auto soe = Soe::make(a.matrix, options);
    ASSERT_TRUE(soe->factor(a.matrix.value.data()));
    std::vector<double> entries(std::size_t(m * m));
    soe->solve_units(wanted, entries.data());
    UnitReaches z;
    soe->add_reaches(wanted, 2, z);
    std::vector<double> y(std::size_t(z.equations), 0.0);
    const cairn_reach reach{z.equations,     z.unit,         z.first.data(), z.place.data(),
                            z.length.data(), z.value.data(), y.data()};
    const cairn_condensed formed{m, m, nullptr, entries.data(), nullptr}, reached{m, 0, nullptr, nullptr, &reach};
    const double size = *std::max_element(entries.begin(), entries.end());
    const double impulse[2] = {0.7, -1.3};
    for (std::int32_t pushed = 0; pushed < std::int32_t(nodes.size()); ++pushed) {
      std::fill(y.begin(), y.end(), 0.0);
      for (int k = 0; k < 2; ++k) {
        const std::vector<double> of_axis = column(z, pushed, 2, k);
        for (std::size_t i = 0; i < y.size(); ++i) y[i] += z.unit * of_axis[i] * impulse[k];
      }
      for (std::int32_t seen = 0; seen < std::int32_t(nodes.size()); ++seen) {
        double one[4], other[4], velocity[2];
        cairn_condensed_block(2, &formed, seen, pushed, one);
        cairn_condensed_block(2, &reached, seen, pushed, other);
        cairn_reached_velocity(2, &reached, seen, velocity);
        for (int k = 0; k < 4; ++k) ASSERT_NEAR(one[k], other[k], 1e-13 * size);
        for (int k = 0; k < 2; ++k)
          ASSERT_NEAR(velocity[k], one[k] * impulse[0] + one[2 + k] * impulse[1], 1e-12 * size);
        EXPECT_EQ(one[1], entries[std::size_t(m * 2 * pushed + 2 * seen + 1)]);
      }
    }
  }
}

TEST(UnitReaches, OtherFactorsHaveNone) {
  const Strip a = strip(20);
  for (const SoeStorage storage : {SoeStorage::banded, SoeStorage::dense}) {
    SoeOptions options;
    options.storage = storage;
    const auto soe = Soe::make(a.matrix, options);
    const std::vector<std::int32_t> one{0};
    UnitReaches z;
    EXPECT_EQ(soe->reach_numbers(one, 1), -1); // not factorised
    ASSERT_TRUE(soe->factor(a.matrix.value.data()));
    EXPECT_EQ(soe->reach_numbers(one, 1), -1);
    EXPECT_THROW(soe->add_reaches(one, 1, z), Error);
  }
  const auto soe = Soe::make(a.matrix, sparse_kinds().front());
  ASSERT_TRUE(soe->factor(a.matrix.value.data()));
  for (const std::int32_t wrong : {-1, int(a.matrix.n)}) {
    const std::vector<std::int32_t> one{wrong};
    EXPECT_THROW(soe->reach_numbers(one, 1), Error);
  }
}

} // namespace
} // namespace cairn
