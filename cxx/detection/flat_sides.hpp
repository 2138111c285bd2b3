// Flat sides of contactors: edges of meshes, triangles of surfaces, sides of polygons, faces of polyhedra.
#pragma once
#include <cstdint>
#include <vector>

#include "placed_scene.hpp"

namespace cairn::detection {

inline constexpr double on_rim = 1e-6; // of the side, or of how far one is held: beyond its rim by less lies over it
inline constexpr double alike = 0.75;  // cosine between sides of one surface; below it, the edge between is a rim
inline constexpr double unlike_side = 0.5; // cosine to the way past a rim from which on a contact hinders the way back

// A flat side from the centre of its contactor: its plane, and its corners in turn.
struct FlatSide {
  double normal[3] = {0, 0, 0}, offset = 0; // [m]
  struct Corner {
    double x[3]; // [m]
    bool rim;    // true if the edge from here is a rim; in 2D, if this end is
  };
  std::vector<Corner> corner; // two in 2D
};

class FlatSides {
public:
  explicit FlatSides(const PlacedScene& scene) : scene_(scene) {}

  int count(std::int32_t contactor) const;
  void view(std::int32_t contactor, int face, FlatSide& side) const;
  // Distance of the foot of a point x, from the centre of the contactor, beyond the side [m]; whether it is past a rim,
  // and the unit vector that way. 0 over the side.
  double beyond(const FlatSide& side, const double* x, bool& rim, double* way) const;

private:
  void view_edge(std::int32_t contactor, FlatSide& side) const;
  void view_facet(std::int32_t contactor, FlatSide& side) const;
  void view_face(std::int32_t contactor, int face, FlatSide& side) const;

  const PlacedScene& scene_;
};

} // namespace cairn::detection
