// Pairs of shapes that the narrow phase has kernels for, as pairs.def names them.
#pragma once
#include <algorithm>
#include <cstdint>
#include <iterator>

#include "../contactors/shapes.hpp"
#include "cairn/rows/pair.h"

namespace cairn::detection {

struct PairKind {
  const char* name;
  Shape a, b;
  int most;                    // contacts of one pair
  cairn_pair_contact* contact; // null: see hull_contact
  cairn_hull_contact* hull_contact;
  cairn_pair_contact* built_in; // contact may come from a user's library
};
inline PairKind pair_kinds[] = {
#define CAIRN_PAIR(name, a, b, most) {#name, Shape::a, Shape::b, most, cairn_pair_##name, nullptr, cairn_pair_##name},
#define CAIRN_HULL_PAIR(name, a, b, most) {#name, Shape::a, Shape::b, most, nullptr, cairn_pair_##name, nullptr},
#define CAIRN_CONVEX_PAIR(a, b, most) {#a "_" #b, Shape::a, Shape::b, most, nullptr, cairn_pair_convex, nullptr},
#include "../../core_f90/detection/pairs.def"
};
inline constexpr int kinds = int(std::size(pair_kinds));
// True for kinds whose kernel starts from its last result.
inline bool recalls(const PairKind& kind) { return kind.hull_contact == cairn_pair_polyhedron_polyhedron; }

// Which kind two shapes make, and how they are turned to be A and B: 0 as they come, 1 the other way, 2 by id.
struct KindTable {
  std::int32_t kind[shapes * shapes], turn[shapes * shapes];
  KindTable() {
    std::fill(std::begin(kind), std::end(kind), -1);
    std::fill(std::begin(turn), std::end(turn), 0);
    for (int k = 0; k < kinds; ++k) {
      const int a = int(pair_kinds[k].a), b = int(pair_kinds[k].b);
      kind[a + shapes * b] = kind[b + shapes * a] = k;
      turn[b + shapes * a] = 1;
      if (a == b) turn[a + shapes * a] = 2;
    }
  }
};
inline const KindTable kind_table;

} // namespace cairn::detection
