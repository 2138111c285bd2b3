// Contacts that are measured at the points which their bonds or joints hold.
#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "assembly_input.hpp"
#include "ropes.hpp"

namespace cairn {

// Replaces candidates of detection by the anchored contacts of the memory.
class AnchoredContacts {
public:
  AnchoredContacts(AssemblyInput& in, Ropes& ropes, const ContactMemory& memory)
      : in_(in), ropes_(ropes), memory_(memory) {}
  // numbers: contactors A and B of each key of the memory, -1 if they are gone.
  void measure(const Bodies& bodies, const Contactors& contactors, const LawTable& laws, const Cell& cell,
               std::span<const std::int32_t> numbers, Candidates& found, MeshSet* meshes, Nodes* nodes);
  bool any() const { return !anchor_of_.empty(); }
  bool is_anchored(std::int64_t i) const { return !anchor_of_.empty() && anchor_of_[std::size_t(i)] >= 0; }
  const Anchor& of(std::int64_t i) const { return held_[std::size_t(anchor_of_[std::size_t(i)])]; }
  // Number of an anchored candidate among all_held(), and key of the memory whose broken bond a candidate goes on
  // with; below 0: none.
  std::int32_t number_of(std::int64_t i) const { return anchor_of_[std::size_t(i)]; }
  std::int32_t broken_before(std::int64_t i) const { return -2 - anchor_of_[std::size_t(i)]; }
  const std::vector<Anchor>& all_held() const { return held_; }
  std::int64_t bytes() const;

private:
  struct Place {
    std::int32_t a, b, image, feature, key;
    bool sound, spans, joins;
  };
  void measure_pair(std::span<const Place> places, std::int64_t first, std::int64_t last, const Candidates& found);
  void find_bonds_on_surfaces();
  void find_bonded_nodes(const LawTable& laws, std::span<const std::int32_t> numbers);
  bool is_of_surface(std::int32_t side) const;
  std::int32_t surface_of(std::int32_t side) const;
  bool is_held_beside(std::int64_t i, const Candidates& found) const;
  bool is_held_by_nodes(std::int64_t i, const Candidates& found) const;
  bool is_held_by_nodes(std::int32_t side, std::int32_t other, std::int64_t i, const Candidates& found) const;

  AssemblyInput& in_;
  Ropes& ropes_;
  const ContactMemory& memory_;
  // Per candidate: its place among the anchors held in this step; -1 none; -2 - k: it goes on with what the memory's
  // key k left when it broke. Empty where no contact is anchored.
  std::vector<std::int32_t> anchor_of_;
  std::vector<Anchor> held_;
  std::vector<Place> places_, on_surfaces_;
  // A body, or -1 - number of a mesh, and a node that is held on it; sorted.
  std::vector<std::pair<std::int32_t, std::int32_t>> bonded_nodes_;
  std::vector<std::uint8_t> seen_;
  Candidates measured_;
};

} // namespace cairn
