// Contacts of nodes of meshes that slid past the rim of a flat side.
#pragma once
#include <span>

#include "contacts_of_nodes.hpp"
#include "dropped_contacts.hpp"
#include "nodes_on_sides.hpp"

namespace cairn::detection {

class RimContacts {
public:
  explicit RimContacts(const PlacedScene& scene) : scene_(scene), sides_(scene), nodes_(scene) {}

  // Adds them, after the seats of the step before; drops those with sides that others hide; and writes the seats of
  // this step. met: nodes whose contact was dropped, as it pointed along a side.
  void hold(const OrderedPairs& pairs, std::span<const RimSeat> before, std::span<const HeldNode> met,
            DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out);

private:
  void note_seats(Candidates& out) const;
  bool past_its_rim(const OrderedPairs& pairs, const RimSeat& seat, HeldNode& held) const;
  bool comes_past_a_rim(const OrderedPairs& pairs, int kind, std::int64_t first, std::int64_t last,
                        HeldNode& held) const;
  void consider(const Candidates& out, const HeldNode& node);
  void consider_met(const OrderedPairs& pairs, const Candidates& out);
  void consider_slid(const OrderedPairs& pairs, std::span<const RimSeat> before, std::span<const HeldNode> met,
                     const Candidates& out);
  bool bears_as_high(const Candidates& out, const HeldNode& h) const;
  bool is_met_there(const Candidates& out, const HeldNode& h) const;
  bool hinders(const Candidates& out, std::int64_t i, const HeldNode& h) const;
  void put_held(Candidates& out);
  void drop_hidden(const OrderedPairs& pairs, DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out);

  const PlacedScene& scene_;
  FlatSides sides_;
  NodesOnSides nodes_;
  ContactsOfNodes contacts_;
  std::vector<HeldNode> held_;
  std::vector<std::uint8_t> hinders_;
  Candidates with_held_;
  mutable FlatSide seen_side_, seen_before_; // as large as was needed so far
};

} // namespace cairn::detection
