// Remembered features of the separating axis of a pair of polyhedra save the search, and change no bit of the contacts.
#include <gtest/gtest.h>

#include "benchmarks/hull_pairs.hpp"

namespace {

using cairn::Pairs;

// Pairs of which the contacts differ in any bit.
int different(const Pairs& p, const Pairs& q) {
  int found = 0;
  for (int i = 0; i < Pairs::pairs; ++i) {
    bool same = p.count[i] == q.count[i];
    for (int k = i * Pairs::most; same && k < i * Pairs::most + p.count[i]; ++k) {
      same = p.gap[k] == q.gap[k] && p.feature[k] == q.feature[k];
      for (int c = 3 * k; c < 3 * k + 3; ++c) same = same && p.normal[c] == q.normal[c] && p.point[c] == q.point[c];
    }
    found += !same;
  }
  return found;
}

// `part`: of the size, how far bodies move between two looks.
void expect_same_bits(Pairs& pairs, double part, double share_in_contact) {
  pairs.recalls = true;
  pairs.detect();
  for (int step = 0; step < 5; ++step) {
    pairs.move(part);
    Pairs anew = pairs;
    anew.recalls = false;
    anew.detect();
    pairs.detect();
    EXPECT_EQ(different(pairs, anew), 0) << "step " << step;
    const auto touch = std::count_if(pairs.count.begin(), pairs.count.end(), [](auto n) { return n > 0; });
    EXPECT_GT(double(touch), share_in_contact * Pairs::pairs);
  }
  const auto known = std::count_if(pairs.recalled.begin(), pairs.recalled.end(), [](auto f) { return f != 0; });
  EXPECT_GT(double(known), 0.9 * 2 * Pairs::pairs);
}

TEST(HullRecall, changes_no_bit_of_random_pairs) {
  for (const int vertices : {4, 8, 12}) {
    Pairs pairs(vertices);
    expect_same_bits(pairs, 1e-3, 0.6);
    expect_same_bits(pairs, 3e-2, 0.3);
  }
}

TEST(HullRecall, changes_no_bit_of_flush_boxes) {
  Pairs pairs(8, true);
  expect_same_bits(pairs, 0, 0.99);
  for (const double part : {1e-15, 1e-13, 1e-11, 1e-9}) expect_same_bits(pairs, part, 0.99);
  expect_same_bits(pairs, 1e-3, 0.8);
}

TEST(HullRecall, nonsense_is_not_believed) {
  Pairs pairs(8);
  Pairs anew = pairs;
  anew.detect();
  std::uniform_int_distribution<std::int32_t> any(-20, 20), far(-2000000, 2000000);
  for (int round = 0; round < 20; ++round) {
    for (auto& f : pairs.recalled) f = round % 2 ? any(pairs.random) : far(pairs.random);
    pairs.recalls = true;
    pairs.detect();
    EXPECT_EQ(different(pairs, anew), 0) << "round " << round;
  }
}

} // namespace
