// Side of a body on which a node of a mesh lies, at the edge between two sides or two bodies.
#pragma once
#include <algorithm>
#include <cstdint>

#include "flat_sides.hpp"
#include "pair_list.hpp"

namespace cairn::detection {

// Contact of a node with the plane of a side.
struct HeldNode {
  std::int32_t node = -1, side = -1, face = 0, kind = 0, image = 0;
  double gap = 0, normal[3] = {}, way[3] = {}; // way: past the rim
};
// Contact i as a record of its node.
HeldNode met_node(const Candidates& out, int dim, std::int64_t i);

// f(pair, kind) for the pairs of a node, kind by kind, until it says no; true if it never did.
template <class F>
bool each_pair_of(const OrderedPairs& pairs, std::int32_t node, F&& f) {
  std::int64_t begin = 0;
  for (int kind = 0; kind < int(pairs.kind_end.size()); ++kind) {
    const std::int64_t end = pairs.kind_end[std::size_t(kind)];
    const auto first = std::lower_bound(pairs.a.begin() + begin, pairs.a.begin() + end, node) - pairs.a.begin();
    for (std::int64_t p = first; p < end && pairs.a[p] == node; ++p)
      if (!f(p, kind)) return false;
    begin = end;
  }
  return true;
}

class NodesOnSides {
public:
  explicit NodesOnSides(const PlacedScene& scene) : scene_(scene), sides_(scene) {}

  // True if the node of a contact lies on another side of the same body, which `held` then has.
  bool lies_on_another(const OrderedPairs& pairs, const HeldNode& met, HeldNode& held) const;
  bool reaches_back(std::int32_t node, const double* normal, const double* way, double far) const;
  // True if a node that lies on the side of contact j cannot meet that of contact i.
  bool hides(const OrderedPairs& pairs, const Candidates& out, std::int64_t j, std::int64_t i) const;

private:
  bool way_inward(std::int32_t node, double* inward) const;
  bool is_behind_own(const Candidates& out, std::int64_t j, std::int64_t i, bool& decided) const;

  const PlacedScene& scene_;
  FlatSides sides_;
  mutable FlatSide seen_side_, own_side_; // as large as was needed so far
};

} // namespace cairn::detection
