// Bonds of bodies that came in.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "anchor_frames.hpp"
#include "contact_areas.hpp"
#include "mesh_bond_areas.hpp"
#include "redundant_bonds.hpp"

namespace cairn {

// Starts the memory of contacts whose law keeps pairs, for bodies that came in touching.
class NewBonds {
public:
  NewBonds(const AssemblyInput& in, ContactClasses& classes, const Ropes& ropes, const ContactCurvature& curvature,
           const ContactAreas& areas, const AnchorFrames& frames, ContactMemory& memory)
      : in_(in), classes_(classes), ropes_(ropes), curvature_(curvature), areas_(areas), frames_(frames),
        memory_(memory), mesh_areas_(in, classes), redundant_(in, classes) {}
  // Returns a warning about bodies that stay unjoined because they touch without an area; empty: none.
  std::string begin(double h, double theta);
  bool came_in_touching(std::int64_t i) const; // the bodies of a contact came in together, and touch

private:
  enum class Begun { joined, loose, without_area };
  Begun begin_kept(std::int64_t i, double with_h, double with_theta, double area);
  std::string warn_of_unjoined(std::span<const std::int32_t> joined, std::span<const std::int32_t> bare) const;
  void anchor(std::int64_t i, const LawInfo& law); // the last key of the memory, in new_anchors.cpp
  void anchor_bond(std::int64_t i, const LawInfo& law, Anchor& made) const;
  void anchor_joint(std::int64_t i, Anchor& made) const;
  void face_of_node(std::int32_t node, std::int32_t hull, const double* shift, double* normal, double* from) const;
  void space_anchors(std::size_t first); // reaches of those from a key on

  const AssemblyInput& in_;
  ContactClasses& classes_;
  const Ropes& ropes_;
  const ContactCurvature& curvature_;
  const ContactAreas& areas_;
  const AnchorFrames& frames_;
  ContactMemory& memory_;
  MeshBondAreas mesh_areas_;
  RedundantBonds redundant_;
};

} // namespace cairn
