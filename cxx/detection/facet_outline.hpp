// A triangle of a surface in the axes of its body, and tests that leave out balls which cannot touch it.
#pragma once
#include <cmath>
#include <cstdint>

#include "../base/vectors.hpp"
#include "../contactors/contactor.hpp"

namespace cairn::detection {

// Tests on this outline cost a few products, and the narrow phase (sphere_facet.f90) many. They are conservative by a
// slack [m] that the caller gives against rounding: a triangle that they leave out has no contact.
struct FacetOutline {
  struct Edge {
    double out_next[3], end_next;   // as out and end, of the triangle beyond the edge; 0 where it is a rim
    double along[3], begin, length; // unit vector, offset of its first vertex [m], length [m]
    bool owned;                     // its points count for this triangle, not for the one beyond it
    bool owns_first;                // so does its first vertex
  };
  double centre[3], normal[3], offset, size; // offset of the plane from the centre; radius of the ball around it [m]
  double out[3][3], end[3]; // of the edges: unit vector in the plane, away from the triangle, and the offset along it
  Edge edge[3];

  FacetOutline(const Contactors& contactors, std::int32_t facet);

  // True if no point of the triangle is within `reach` of x, from the centre [m]. Such a point is in the disk that this
  // reach cuts from the plane; none exists if the disk lies beyond an edge, or farther than the ball around the
  // triangle.
  bool is_beyond(const double x[3], double reach, double slack) const {
    const double height = dot(x, normal) - offset, square = dot(x, x) - height * height;
    reach += slack;
    const double disk = reach * reach - height * height;
    if (disk < 0) return true;
    const double cut = std::sqrt(disk) + slack, apart = cut + size;
    bool beyond = square > apart * apart;
    for (int k = 0; k < 3; ++k) beyond |= dot(x, out[k]) - end[k] > cut;
    return beyond;
  }
  // True if the nearest point of the surface to x is none of this triangle, its edges and its vertices.
  bool is_elsewhere(const double x[3], double reach, double slack) const;
};

} // namespace cairn::detection
