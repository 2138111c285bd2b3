#include <cmath>

#include "../../base/vectors.hpp"
#include "../curved_surfaces.hpp"

namespace cairn {

namespace {

// The side is straight along the axis, the rim sharp across and round along, the end flat.
bool curve_of_cylinder(const ShapeData& shape, const CurvatureView& view, SurfaceCurvature& out) {
  constexpr double flat = 1e-4, upright = 1e-9; // sine, cosine: as convex_contact.f90 has them
  const double *axis = shape.normal(), radius = *shape.offset(), half = std::abs(dot(axis, shape.vertex() + 3));
  const double high = dot(axis, view.outward);
  double w[3], around[3];
  for (int l = 0; l < 3; ++l) w[l] = view.outward[l] - high * axis[l];
  const double length = std::sqrt(dot(w, w));
  if (length < flat) return true;
  if (std::abs(high) <= upright) {
    surface::bend_across(view, axis, 1 / radius, out);
    return true;
  }
  cross(axis, w, around);
  surface::make_edge(view, around, out);
  const double along[2] = {dot(around, view.t) / length, dot(around, view.s) / length};
  surface::add(length / radius, along, out.k);
  double lowest[3];
  const double end = std::copysign(half, dot(axis, view.at)); // of a line that leans both ends are listed
  for (int l = 0; l < 3; ++l) lowest[l] = radius / length * w[l] + end * axis[l];
  surface::mark_off(view, lowest, nullptr, out);
  return true;
}

// The disk at an end; vertices of a cylinder are the ends of its axis.
bool face_of_cylinder(const ShapeData& shape, const FaceSight& view, int sense, FaceOutline& face) {
  const double along = sense * dot(shape.normal(), view.normal);
  if (!(std::abs(along) > flat_faces)) return false;
  const double* end = shape.vertex() + (along > 0 ? 3 : 0);
  face.centre = view.corner(end);
  face.radius = *shape.offset();
  face.height = dot(view.normal, view.place(end).data());
  return true;
}

} // namespace

extern const ShapeSurface surface_of_cylinder{curve_of_cylinder, face_of_cylinder};

} // namespace cairn
