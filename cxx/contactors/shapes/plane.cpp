#include "../curved_surfaces.hpp"

namespace cairn {

namespace {

bool face_of_plane(const ShapeData&, const FaceSight&, int, FaceOutline& face) {
  face.endless = true;
  return true;
}

} // namespace

extern const ShapeSurface surface_of_plane{surface::half_space, face_of_plane};

} // namespace cairn
