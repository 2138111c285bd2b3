// Tributary areas: the part of a mesh's surface that each of its contact nodes and points stands for.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "mesh_seats.hpp"

namespace cairn {

class MeshAreas {
public:
  // Part of a side within the tributary area of a contact node or point.
  struct SidePart {
    std::int32_t owner; // contactor
    int corner;         // number of the node among those of the side, -1: a point
    double from, to;    // of an edge: from 0 at its first node to 1 at its second
    double area;        // [m2], of a metre across the plane, or round the axis
  };
  // is_mark: of each seat, whether it marks the end of a joint, and stands for no surface.
  void find(const MeshList& meshes, const MeshSeats& seats, const std::vector<std::uint8_t>& is_mark);
  void clear() { area_.clear(); }
  std::size_t count() const { return area_.size(); }
  // By the number of a seat [m2].
  double area(std::int32_t seat) const { return area_[std::size_t(seat)]; }
  double near_area(std::int32_t seat) const { return near_area_[std::size_t(seat)]; }
  std::span<const SidePart> parts(const MeshSeats::Seat& side) const;
  std::span<const double, 3> shares(const MeshSeats::Seat& side) const;
  // Area of a part of an edge, given by shares of its length [m2].
  static double edge_area(const MeshSeats::Seat& edge, double from, double to);

private:
  std::vector<double> area_, near_area_; // of each seat
  std::vector<double> side_share_;       // (3, sides), mesh by mesh
  std::vector<SidePart> parts_;          // side by side, mesh by mesh
  std::vector<std::int64_t> first_part_; // (sides + 1)
  std::vector<std::int64_t> first_side_; // of each mesh among them
};

} // namespace cairn
