#include "../../base/vectors.hpp"
#include "../curved_surfaces.hpp"

namespace cairn {

namespace {

bool face_of_polyhedron(const ShapeData& shape, const FaceSight& view, int sense, FaceOutline& face) {
  const Hulls& hulls = *shape.hulls;
  const std::int32_t hull = shape.hull;
  const double* vertex = shape.vertex();
  double best = 0;
  std::int32_t which = -1;
  for (std::int32_t f = hulls.first_face[hull]; f < hulls.first_face[hull + 1]; ++f)
    if (const double look = sense * dot(&hulls.normal[3 * std::size_t(f)], view.normal); look > best)
      best = look, which = f;
  if (!(best > flat_faces)) return false;
  for (std::int32_t k = hulls.first_corner[which]; k < hulls.first_corner[which + 1]; ++k)
    face.corner.push_back(view.corner(vertex + 3 * (std::ptrdiff_t(hulls.corner_vertex[k]) - 1)));
  const std::ptrdiff_t first = hulls.corner_vertex[hulls.first_corner[which]] - 1;
  face.height = dot(view.normal, view.place(vertex + 3 * first).data());
  face.turn_left();
  return true;
}

} // namespace

extern const ShapeSurface surface_of_polyhedron{surface::corners, face_of_polyhedron};

} // namespace cairn
