// Contacts that detection found within the margin, in its canonical order: what the interaction handler hands to the
// interactions.
#pragma once
#include <functional>
#include <tuple>
#include <vector>

#include "../base/field.hpp"

namespace cairn {

// Survives renumbering of bodies: ids are global. Orders and hashes as a whole.
struct ContactKey {
  std::int64_t contactor_a, contactor_b; // ids, a < b within a pair of like shapes
  std::int32_t feature;                  // which contact of the pair
  std::int32_t image;                    // periodic image of b seen from a: (ix+512) + 1024*((iy+512) + 1024*(iz+512))
  bool operator==(const ContactKey&) const = default;
  auto operator<=>(const ContactKey&) const = default;
};

// A node of a mesh over a flat side, or held at the rim of one: which face of it. Of contactors, by their ids, or their
// internal numbers.
struct RimSeat {
  std::int64_t node, side;
  std::int32_t face;
  bool operator==(const RimSeat&) const = default;
  bool operator<(const RimSeat& o) const { return std::tie(node, side, face) < std::tie(o.node, o.side, o.face); }
};

struct Candidates {
  std::int64_t count = 0;
  // per contact; n points from antagonist B to candidate A; point is the middle of the gap, relative to the origin of
  // the scene, on A's image
  Array<std::int32_t> contactor_a, contactor_b; // internal numbers
  Array<std::int32_t> feature, image;
  Array<double> gap;          // (count) [m], negative when overlapping
  Array<double> normal;       // (dim, count)
  Array<double> point;        // (dim, count) [m]
  std::vector<RimSeat> seats; // rising, by internal numbers; see rims.cpp
};

} // namespace cairn

template <>
struct std::hash<cairn::ContactKey> {
  std::size_t operator()(const cairn::ContactKey& key) const noexcept {
    std::uint64_t h = 0;
    for (std::uint64_t part : {std::uint64_t(key.contactor_a), std::uint64_t(key.contactor_b),
                               std::uint64_t(std::uint32_t(key.feature)) << 32 | std::uint32_t(key.image)}) {
      h = (h ^ part) * 0x9e3779b97f4a7c15u; // Fibonacci hashing (Knuth 1973)
      h ^= h >> 29;
    }
    return h;
  }
};
