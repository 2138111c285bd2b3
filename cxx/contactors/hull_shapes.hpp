// Hulls from the few numbers that describe them: round shapes, and the triangles of a surface.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "hulls.hpp"

namespace cairn {

// n hulls of one kind; sizes of each: "capsule" and "cylinder" radius and length along z [m], without the round ends;
// "superquadric" half axes a, b, c [m] and exponents e1, e2, see cairn.superquadrics. Returns the number of the first.
std::int32_t add_round_hulls(Hulls& hulls, const std::string& shape, std::int64_t n, const double* sizes);

// Facets of a surface, a hull each. around: vertices that each facet sees, its own three first.
struct SurfaceFacets {
  std::int32_t first = 0;     // hull
  std::vector<double> centre; // (3, triangles) [m]
  std::vector<std::int32_t> around, around_start;
};
// vertex (3, n) [m], triangle (3, m) anticlockwise from the free side. Throws Error for triangles without an area and
// for empty input.
SurfaceFacets add_facets(Hulls& hulls, std::span<const double> vertex, std::span<const std::int32_t> triangle);

} // namespace cairn
