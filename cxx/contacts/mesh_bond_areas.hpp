// Areas of bonds on meshes.
#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "contact_classes.hpp"

namespace cairn {

// Which bonds have a part of the area of their face: all of them, or those to which something is left.
enum class AreaClaim : std::uint8_t { full, remainder };

// Shares the faces between meshes, or between a mesh and a flat body, among the bonds that begin there.
class MeshBondAreas {
public:
  MeshBondAreas(const AssemblyInput& in, const ContactClasses& classes) : in_(in), classes_(classes) {}
  using BondArea = std::pair<std::int32_t, double>; // candidate, area [m2]
  void leave_out_corners(std::vector<std::int32_t>& beginning) const;
  // Areas of those that begin, in their order, where they are not what ContactAreas says. Of the remainder those for
  // which something is left begin, too. The first finds bonds with flat bodies, the second adds those of two meshes.
  std::vector<BondArea> share_mesh_faces(std::vector<std::int32_t>& beginning,
                                         std::span<const std::int32_t> remainder) const;
  void share_mesh_pairs(std::vector<std::int32_t>& beginning, std::span<const std::int32_t> remainder,
                        std::vector<BondArea>& areas) const;

private:
  struct MeshFaceBond;
  struct MeshPairBond;
  class MeshFaces;
  class MeshPairFaces;
  bool as_mesh_bond(std::int32_t i, AreaClaim claim, MeshFaceBond& bond) const;
  bool as_mesh_pair_bond(std::int32_t i, AreaClaim claim, MeshPairBond& bond) const;
  bool is_there(std::span<const MeshFaceBond> bonds, const MeshFaceBond& wanted) const;

  const AssemblyInput& in_;
  const ContactClasses& classes_;
};

} // namespace cairn
