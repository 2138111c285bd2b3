// Contacts of points with edges of a mesh in the plane that follow each other along its boundary.
#pragma once
#include "dropped_contacts.hpp"

namespace cairn::detection {

class EdgeRows {
public:
  explicit EdgeRows(const PlacedScene& scene) : scene_(scene) {}
  // Drops contacts that the next edge of a row has.
  void drop(DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out);

private:
  enum class Owner { first, second, both }; // of a point at the corner between two edges
  Owner owner_at_corner(std::int32_t first, std::int32_t second, const double* x) const;
  std::int32_t edge_that_has_it(const Candidates& out, std::int64_t i) const; // of the contact, or the next one
  bool is_on_next_edge(const Candidates& out, std::int64_t i) const;
  void hold_without_heir(DeclaredPairs& declared, DroppedContacts& dropped, const Candidates& out);

  const PlacedScene& scene_;
  std::vector<std::int64_t> held_;
};

} // namespace cairn::detection
