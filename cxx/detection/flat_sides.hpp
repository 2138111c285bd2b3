// Constants and loops of the stages that decide on which flat side a node of a mesh lies.
#pragma once
#include <algorithm>
#include <cstdint>

#include "../base/vectors.hpp"
#include "detection_workspace.hpp"

namespace cairn::detection {

inline constexpr double on_rim = 1e-6; // of the side, or of how far one is held: beyond its rim by less lies over it
inline constexpr double alike =
    0.75; // cosine between sides of one surface; where it is less, the edge between is a rim
inline constexpr double unlike_side = 0.5; // cosine to the way past a rim from which on a contact hinders the way back

// f(pair, kind) for the pairs of a node, kind by kind, until it says no; whether it never did.
template <class Pairs, class F>
bool each_pair_of(const Pairs& pairs, std::int32_t node, F&& f) {
  std::int64_t begin = 0;
  for (int kind = 0; kind < kinds; ++kind) {
    const std::int64_t end = pairs.kind_end[std::size_t(kind)];
    const auto first = std::lower_bound(pairs.a.begin() + begin, pairs.a.begin() + end, node) - pairs.a.begin();
    for (std::int64_t p = first; p < end && pairs.a[p] == node; ++p)
      if (!f(p, kind)) return false;
    begin = end;
  }
  return true;
}

} // namespace cairn::detection
