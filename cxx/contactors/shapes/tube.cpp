#include <cmath>

#include "../../base/vectors.hpp"
#include "../curved_surfaces.hpp"

namespace cairn {

namespace {

bool curve_of_tube(const ShapeData& shape, const CurvatureView& view, SurfaceCurvature& out) {
  if (std::abs(dot(shape.direction, view.outward)) > 1e-6) return false; // the rim of an open end
  surface::bend_across(view, shape.direction, -1 / shape.radius, out);
  return true;
}

} // namespace

extern const ShapeSurface surface_of_tube{curve_of_tube};

} // namespace cairn
