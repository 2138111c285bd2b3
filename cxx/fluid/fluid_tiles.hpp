// Loops over particles, shared between threads.
#pragma once
#include <algorithm>
#include <cstdint>

#include "fluid.hpp"

namespace cairn {

// f(first, last) for tiles of particles, which any thread takes.
template <class F>
void each_tile(std::int64_t n, F&& f) {
  const std::int64_t tiles = (n + fluid_tile - 1) / fluid_tile;
#pragma omp parallel for schedule(dynamic, 4)
  for (std::int64_t t = 0; t < tiles; ++t) f(fluid_tile * t, std::min(fluid_tile * (t + 1), n));
}

} // namespace cairn
