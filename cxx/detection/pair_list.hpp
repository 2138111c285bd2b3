// Pairs that one thread found, before they are ordered.
#pragma once
#include <algorithm>
#include <cstdint>

#include "../base/scratch.hpp"

namespace cairn::detection {

inline constexpr std::int32_t declared_bit = 1 << 30; // beside an image
inline constexpr std::int32_t image_bits = declared_bit - 1;

struct alignas(128) PairList {
  std::int64_t count = 0, room = 0;
  std::int32_t *a = nullptr, *b = nullptr, *image = nullptr, *kind = nullptr;
  Array<std::int32_t> hits;
  void reserve(std::int64_t n, Scratch& scratch) {
    needed = std::max(needed, n);
    if (room >= n) return;
    room = std::max(n + n / 2, last); // as much as the last time, unless that is too little
#pragma omp critical(cairn_scratch)
    for (std::int32_t** column : {&a, &b, &image, &kind}) {
      auto* wider = scratch.take<std::int32_t>(room);
      std::copy_n(*column, count, wider);
      *column = wider;
    }
  }
  void begin() {
    last = needed + needed / 16;
    count = room = needed = 0;
  }

private:
  std::int64_t needed = 0, last = 0;
};

} // namespace cairn::detection
