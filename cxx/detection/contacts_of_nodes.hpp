// Index of contacts by the node of a mesh that is A, and by the side that it meets.
#pragma once
#include <span>
#include <utility>
#include <vector>

#include "placed_scene.hpp"

namespace cairn::detection {

class ContactsOfNodes {
public:
  using Entry = std::pair<std::int32_t, std::int64_t>; // contactor, contact

  void clear() { of_nodes_.clear(); }
  void fill(const PlacedScene& scene, const Candidates& out); // unless it is filled
  std::span<const Entry> all() const { return of_nodes_; }
  std::span<const Entry> of_node(std::int32_t node) const { return equal(of_nodes_, node); }
  std::span<const Entry> on_side(std::int32_t side) const { return equal(on_sides_, side); }

private:
  static std::span<const Entry> equal(const std::vector<Entry>& list, std::int32_t contactor);

  std::vector<Entry> of_nodes_, on_sides_;
};

} // namespace cairn::detection
