// Contacts of bodies with the far side of a surface or mesh thinner than themselves.
#pragma once
#include "dropped_contacts.hpp"

namespace cairn::detection {

class FarSides {
public:
  explicit FarSides(const PlacedScene& scene) : scene_(scene) {}
  void drop(DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out) const;

private:
  bool is_far(const Candidates& out, std::int64_t i) const;
  double round_layer(std::int32_t contactor) const;
  double along_its_edge(const Candidates& out, std::int64_t i) const;
  bool is_far_side_of(const Candidates& out, std::int64_t i, std::int64_t j, double layer) const;

  const PlacedScene& scene_;
};

} // namespace cairn::detection
