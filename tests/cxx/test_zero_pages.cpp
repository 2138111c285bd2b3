// Memory of arrays that hold zeros.
#include <gtest/gtest.h>
#ifdef __linux__
#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "base/zero_pages.hpp"
#include "scene/scene.hpp"

using namespace cairn;

namespace {

// Bytes of whole pages of an array that take memory.
std::size_t resident(const void* first, std::size_t bytes) {
  const auto page = std::size_t(sysconf(_SC_PAGESIZE));
  const auto begin = (reinterpret_cast<std::uintptr_t>(first) + page - 1) / page * page;
  const auto end = (reinterpret_cast<std::uintptr_t>(first) + bytes) / page * page;
  std::vector<unsigned char> known((end - begin) / page);
  EXPECT_EQ(mincore(reinterpret_cast<void*>(begin), end - begin, known.data()), 0);
  std::size_t there = 0;
  for (const unsigned char of_page : known) there += of_page & 1;
  return there * page;
}

constexpr std::size_t megabyte = 1 << 20;

} // namespace

TEST(ZeroPages, KeepWhatIsNotZeroAndGiveTheRestBack) {
  std::vector<double> values(4 * megabyte / sizeof(double), 0.0);
  values[values.size() / 2] = 3.0;
  values.back() = -0.0; // its bits are not zero
  EXPECT_GT(resident(values.data(), 4 * megabyte), 3 * megabyte);
  give_back_zero_pages(values.data(), 4 * megabyte);
  EXPECT_LT(resident(values.data(), 4 * megabyte), megabyte / 8);
  EXPECT_EQ(std::accumulate(values.begin(), values.end(), 0.0), 3.0);
  EXPECT_EQ(values[values.size() / 2], 3.0);
  EXPECT_TRUE(std::signbit(values.back()));
  values[7] = 5.0;
  EXPECT_EQ(values[7], 5.0);
}

TEST(ZeroPages, ShortRunsStay) {
  std::vector<double> values(megabyte / sizeof(double), 0.0);
  const std::size_t apart = (1 << 17) / sizeof(double);
  for (std::size_t i = 0; i < values.size(); i += apart) values[i] = 1.0;
  give_back_zero_pages(values.data(), megabyte);
  EXPECT_GT(resident(values.data(), megabyte), megabyte * 7 / 8);
}

// One driven body of many: arrays of drives take no memory for the others, before a new order and behind it.
TEST(ZeroPages, ADrivenBodyCostsNothingOfOthers) {
  constexpr std::int64_t n = 40'000;
  Scene scene(3);
  std::vector<double> x(3 * n), one(n, 1.0), three(3 * n, 1.0);
  for (std::int64_t i = 0; i < n; ++i) {
    x[std::size_t(3 * i)] = double(i * 7919 % n);
    x[std::size_t(3 * i) + 1] = double(i % 37);
  }
  const std::int64_t first = scene.add_bodies({n, x, {}, {}, one, three});
  const std::int64_t ids[] = {first + 5};
  const double speed[] = {0.5, 0, 0, 0, 0, 0};
  scene.drive(ids, 1, speed);
  const auto of_drives = [&] {
    return resident(scene.bodies.driven_velocity.values.data(), 48 * n) +
           resident(scene.bodies.reaction.values.data(), 48 * n) +
           resident(scene.bodies.velocity.values.data(), 48 * n);
  };
  EXPECT_LT(of_drives(), megabyte / 2); // of 5.8
  scene.renumber();
  EXPECT_LT(of_drives(), megabyte / 2);
  EXPECT_EQ(scene.bodies.driven_velocity[scene.internal(ids[0])][0], 0.5);
}
#endif
