// Contacts that would push a node of a mesh along a side of its own.
#pragma once
#include "dropped_contacts.hpp"
#include "nodes_on_sides.hpp"

namespace cairn::detection {

class NodesAlongSides {
public:
  explicit NodesAlongSides(const PlacedScene& scene) : scene_(scene), sides_(scene) {}
  // Drops them; `met` has their nodes that met a flat side.
  void drop(DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out, std::vector<HeldNode>& met);

private:
  template <class Visit>
  void each_way(std::int32_t node, Visit&& visit) const;
  bool points_along_a_side(const Candidates& out, std::int64_t i, bool first) const;

  const PlacedScene& scene_;
  FlatSides sides_;
  std::vector<std::int64_t> joined_; // contactors of declared pairs, rising
};

} // namespace cairn::detection
