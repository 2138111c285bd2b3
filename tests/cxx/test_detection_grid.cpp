// Pairs of the grid against a loop over all pairs, where some items stand apart.
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "detection/detection_grid.hpp"

namespace {

using Pair = std::pair<std::int32_t, std::int32_t>;

// Items (x, y, z, reach), and which of them stand apart.
struct Items {
  std::vector<double> x, reach;
  std::vector<std::int8_t> apart;
  std::int64_t count() const { return std::int64_t(reach.size()); }
};

// Small ones that stand apart, from_reach to twice as wide, among larger ones that do not.
Items items(double from_reach, bool mixed) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(0, 1), size(1, 2);
  Items made;
  for (int i = 0; i < 500; ++i) {
    for (int k = 0; k < 3; ++k) made.x.push_back(place(random));
    const bool small = i % 5 > 0;
    made.reach.push_back(size(random) * (small ? from_reach : 0.04));
    made.apart.push_back(std::int8_t(small && !(mixed && i == 1)));
  }
  return made;
}

std::set<Pair> found(const Items& of, const std::int8_t* apart) {
  cairn::Scratch scratch;
  cairn::DetectionGrid grid;
  grid.build(3, of.count(), of.x.data(), of.reach.data(), scratch, apart);
  cairn::Array<std::int32_t> hits;
  std::set<Pair> pairs;
  const std::int64_t n = grid.search(0, grid.cells(), hits);
  for (std::int64_t i = 0; i < n; ++i)
    EXPECT_TRUE(pairs.insert(std::minmax(grid.order()[hits[2 * i]], grid.order()[hits[2 * i + 1]])).second);
  return pairs;
}

// Pairs within reach; of two items that stand apart, or of others.
std::set<Pair> plain(const Items& of, bool apart) {
  std::set<Pair> pairs;
  for (std::int32_t i = 0; i < of.count(); ++i)
    for (std::int32_t j = i + 1; j < of.count(); ++j) {
      double square = 0;
      for (int k = 0; k < 3; ++k) square += std::pow(of.x[3 * i + k] - of.x[3 * j + k], 2);
      if (square <= std::pow(of.reach[i] + of.reach[j], 2) && (of.apart[i] && of.apart[j]) == apart)
        pairs.insert({i, j});
    }
  return pairs;
}

TEST(DetectionGrid, leaves_out_no_pair_but_of_two_items_that_stand_apart) {
  for (const double reach : {0.005, 0.012, 0.03}) { // one level, several, and that of the others
    const Items of = items(reach, false);
    const std::set<Pair> needed = plain(of, false), idle = plain(of, true), pairs = found(of, of.apart.data());
    ASSERT_GT(needed.size(), 20u);
    for (const Pair& pair : needed) EXPECT_TRUE(pairs.count(pair));
    for (const Pair& pair : pairs) EXPECT_TRUE(needed.count(pair) || idle.count(pair));
    if (reach < 0.03) { EXPECT_EQ(pairs, needed); }
    std::set<Pair> all = needed;
    all.insert(idle.begin(), idle.end());
    EXPECT_EQ(found(of, nullptr), all);
  }
}

TEST(DetectionGrid, finds_pairs_of_levels_where_one_item_does_not_stand_apart) {
  const Items of = items(0.012, true);
  const std::set<Pair> pairs = found(of, of.apart.data());
  for (const Pair& pair : plain(of, false)) EXPECT_TRUE(pairs.count(pair));
}

} // namespace
