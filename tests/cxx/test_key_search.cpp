// Contacts are found in the memory whatever happened to their order, against a plain map.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "detection/key_search.hpp"

namespace {

using cairn::ContactKey;

std::vector<ContactKey> some_keys(std::mt19937& random, int n) {
  std::vector<ContactKey> keys;
  for (int i = 0; i < n; ++i)
    keys.push_back({i / 4, i / 4 + 1 + i % 4, std::int32_t(i % 3), std::int32_t(random() % 5)});
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

void expect_found(const std::vector<ContactKey>& memory, const std::vector<ContactKey>& now) {
  std::map<ContactKey, std::int32_t> plain;
  for (std::size_t i = 0; i < memory.size(); ++i) plain[memory[i]] = std::int32_t(i);
  for (int threads : {1, 2, 4}) {
    cairn::Scratch scratch;
    std::vector<std::int32_t> place(now.size(), 7);
    cairn::find_keys(
        memory, std::int64_t(now.size()), [&](std::int64_t c) { return now[c]; }, threads, scratch, place.data());
    for (std::size_t c = 0; c < now.size(); ++c) {
      const auto found = now[c].contactor_a < 0 ? plain.end() : plain.find(now[c]);
      ASSERT_EQ(place[c], found == plain.end() ? -1 : found->second) << c << " of " << now.size();
    }
  }
}

TEST(KeySearch, FindsWhatIsThereWhateverTheOrder) {
  std::mt19937 random(5);
  for (int n : {0, 1, 7, 100, 3000}) {
    const std::vector<ContactKey> memory = some_keys(random, n);
    expect_found(memory, memory);
    std::vector<ContactKey> now = memory;
    std::erase_if(now, [&](const ContactKey&) { return random() % 10 == 0; }); // some end
    for (int k = 0; k < n / 20; ++k)                                           // some are new, some places are dummies
      now.insert(now.begin() + std::int64_t(random() % (now.size() + 1)),
                 ContactKey{random() % 3 ? std::int64_t(n + k) : -1, 2 * n, 0, 0});
    expect_found(memory, now);
    for (int k = 0; k < 20 && now.size() > 1; ++k) { // stretches change places
      const std::size_t a = random() % now.size(), b = a + random() % (now.size() - a);
      std::rotate(now.begin(), now.begin() + std::int64_t(a), now.begin() + std::int64_t(b));
    }
    expect_found(memory, now);
    std::shuffle(now.begin(), now.end(), random);
    expect_found(memory, now);
    std::reverse(now.begin(), now.end());
    expect_found(now.empty() ? memory : std::vector<ContactKey>{}, now);
    expect_found(memory, {});
  }
}

TEST(Scratch, WhatWasGivenBackIsTakenAgainAndOneBlockHoldsWhatWasAtHand) {
  cairn::Scratch scratch;
  const auto round = [&] {
    scratch.begin();
    scratch.take<double>(1000);
    const cairn::Scratch::Mark mark = scratch.mark();
    double* searching = scratch.take<double>(5000);
    scratch.release(mark);
    double* kept = scratch.take<double>(4000);
    std::fill_n(kept, 4000, 1.0);
    return kept == searching;
  };
  round(); // in several blocks
  EXPECT_TRUE(round());
  const std::int64_t settled = scratch.bytes(), needed = 8 * 6000;
  EXPECT_GE(settled, needed);
  EXPECT_LE(settled, needed + needed / 16 + 64);
  EXPECT_TRUE(round());
  EXPECT_EQ(scratch.bytes(), settled);
}

} // namespace
