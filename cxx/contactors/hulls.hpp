// Convex polygons, polyhedra and round shapes, shared by contactors. Once added a hull stays: its number is its place.
#pragma once
#include <span>

#include "../base/field.hpp"

namespace cairn {

// n hulls to add. Vertices from the centre of the contactor, in the axes of the body; faces as loops of vertices,
// numbered from 0 within the hull, counterclockwise from outside. A polygon is its vertices in order; it has no faces.
struct HullBatch {
  std::span<const double> vertex;             // (dim, vertices) [m]
  std::span<const std::int64_t> first_vertex; // (n + 1)
  std::span<const std::int64_t> first_face;   // (n + 1), empty in 2D
  std::span<const std::int64_t> first_corner; // (faces + 1), empty in 2D
  std::span<const std::int64_t> corner;       // (corners), empty in 2D
  // Each is triangle (0, 1, 2) of a surface, among the triangles that share a vertex with it, in the order of the
  // surface.
  bool facets = false;
  // Convex round shapes without corners, see convex_shape.f90: normals and offsets of the faces, and radii [m] of the
  // bounding balls around 0.
  std::span<const double> plane{}; // (4, faces) [-, m]; empty for all else
  std::span<const double> ball{};  // (n) [m]
};

// Vertices closer to a plane than this, relative to the size of the hull, are on it: as exact as files in single
// precision are. Coplanar triangles make one face, and faces whose neighbours stand out by no more are convex.
inline constexpr double hull_flatness = 1e-7;
inline constexpr std::int64_t most_face_corners = 1024, most_hull_edges = 16383;

struct Hulls {
  explicit Hulls(int dimension) : dim(dimension) {}
  int dim;
  // Form of a hull, from its numbers of faces and edges; none: no hull.
  enum class Form { none, polygon, polyhedron, facet, axial, superquadric };
  Form form(std::int32_t hull) const;
  // see cairn_hulls in cairn/core.h
  std::vector<std::int32_t> first_vertex{0}, first_face{0}, first_edge{0}, first_corner{0};
  std::vector<std::int32_t> corner_vertex, corner_edge, edge;
  std::vector<double> vertex, normal, offset; // (dim, vertices) [m], (dim, faces), (faces) [m]
  std::vector<double> inner, radius;          // (hulls) of the balls around 0 that it holds and that hold it [m]

  std::int32_t count() const { return std::int32_t(first_vertex.size()) - 1; }
  std::int32_t vertices(std::int32_t hull) const { return first_vertex[hull + 1] - first_vertex[hull]; }
  std::int32_t faces(std::int32_t hull) const { return first_face[hull + 1] - first_face[hull]; }
  // Adds all hulls or none: throws Error, naming hull, face and vertex, for a hull that is not closed, not convex or
  // without volume. Returns the number of the first.
  std::int32_t add(const HullBatch& batch);
  // Other places (3, vertices) for the vertices of a facet, from its centre: its plane and ball follow. Throws Error
  // where it has no area.
  void move_facet(std::int32_t hull, std::span<const double> x);
  std::int32_t copy(std::int32_t hull); // returns its number
  void scale(std::int32_t hull, double factor);
  // Lengths of a hull become those of one of `from`, of which it is a copy.
  void take_lengths(std::int32_t hull, const Hulls& from, std::int32_t of);
  void follow_vertices(std::int32_t hull); // planes and balls of a polygon or polyhedron whose vertices moved a little
  std::size_t bytes() const;

private:
  void add_polygon(std::span<const double> x, std::int64_t which);
  void add_polyhedron(const HullBatch& batch, std::int64_t which);
  void add_facet(const HullBatch& batch, std::int64_t which);
  void add_round(const HullBatch& batch, std::int64_t which);
  double measure(std::int32_t hull, bool facet) const;
};

} // namespace cairn
