// Contacts of declared pairs with triangles of a surface, whose point passed to another triangle.
#pragma once
#include "dropped_contacts.hpp"

namespace cairn::detection {

class SpareContacts {
public:
  explicit SpareContacts(const PlacedScene& scene) : scene_(scene) {}
  void drop(const DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out) const;

private:
  bool on_facet(const Candidates& out, std::int64_t i) const;
  const double* normal_of_facet(const Candidates& out, std::int64_t i) const; // places along each axis
  bool may_go_on(const Candidates& out, std::int64_t i, std::int64_t j) const;
  void drop_one(const Candidates& out, std::int64_t i, DroppedContacts& dropped) const;

  const PlacedScene& scene_;
};

} // namespace cairn::detection
