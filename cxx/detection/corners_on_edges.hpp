// Contacts of bodies with corners that slide over edges of a mesh in the plane.
#pragma once
#include "dropped_contacts.hpp"

namespace cairn::detection {

class CornersOnEdges {
public:
  explicit CornersOnEdges(const PlacedScene& scene) : scene_(scene) {}
  // Drops contacts that would stop such a body at the end of an edge.
  void drop(DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out) const;

private:
  bool points_along_the_row(const Candidates& out, std::int64_t i) const;
  bool is_beyond_its_edge(const Candidates& out, std::int64_t i, const DroppedContacts& dropped) const;
  // Else with the gap that the mesh has there.
  bool is_past_its_end(Candidates& out, std::int64_t i, const DroppedContacts& dropped) const;
  bool is_flush(std::int32_t body, const double* corner, const double* normal, double slack) const;

  const PlacedScene& scene_;
};

} // namespace cairn::detection
