#include <algorithm>
#include <cmath>

#include "../../base/vectors.hpp"
#include "../curved_surfaces.hpp"

namespace cairn {

namespace {

// Flat along its normal, else an edge, or a corner if the contact is there.
bool curve_of_facet(const ShapeData& shape, const CurvatureView& view, SurfaceCurvature& out) {
  const double *vertex = shape.vertex(), *normal = shape.normal();
  double lean = 0, least = 0;
  for (int l = 0; l < 3; ++l) lean += (view.outward[l] - normal[l]) * (view.outward[l] - normal[l]);
  if (lean < 1e-12) return true;
  int nearest = -1;
  double edge[3] = {0, 0, 0};
  for (int i = 0; i < 3; ++i) {
    const double *from = vertex + std::ptrdiff_t(3) * i, *to = vertex + std::ptrdiff_t(3) * ((i + 1) % 3);
    double e[3], d[3];
    for (int l = 0; l < 3; ++l) e[l] = to[l] - from[l], d[l] = view.at[l] - from[l];
    const double way = dot(d, d), along = dot(d, e), square = way - along * along / dot(e, e);
    if (way < surface::flatness * surface::flatness * view.size * view.size) {
      surface::make_corner(out);
      return true;
    }
    if (nearest >= 0 && square >= least) continue;
    nearest = i;
    least = square;
    std::copy_n(e, 3, edge);
  }
  surface::make_edge(view, edge, out);
  return true;
}

bool face_of_facet(const ShapeData& shape, const FaceSight& view, int sense, FaceOutline& face) {
  const double *vertex = shape.vertex(), *m = shape.normal();
  if (!(sense * dot(m, view.normal) > flat_faces)) return false;
  if (std::abs(dot(m, view.place(vertex).data())) > as_high * view.size + std::abs(view.gap)) return false;
  for (int k = 0; k < 3; ++k) face.corner.push_back(view.corner(vertex + 3 * std::ptrdiff_t(k)));
  face.turn_left();
  return true;
}

} // namespace

extern const ShapeSurface surface_of_facet{curve_of_facet, face_of_facet};

} // namespace cairn
