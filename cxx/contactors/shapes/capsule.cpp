#include <cmath>

#include "../../base/vectors.hpp"
#include "../curved_surfaces.hpp"

namespace cairn {

namespace {

bool curve_of_capsule(const ShapeData& shape, const CurvatureView& view, SurfaceCurvature& out) {
  const double *axis = shape.normal(), half = std::abs(dot(axis, shape.vertex() + 3));
  if (std::abs(dot(axis, view.at)) < half * (1 - 1e-9))
    surface::bend_across(view, axis, 1 / *shape.offset(), out);
  else
    surface::make_even(1 / *shape.offset(), out);
  return true;
}

double end_of_capsule(const ShapeData& shape, const double*) { return *shape.offset(); }

} // namespace

extern const ShapeSurface surface_of_capsule{curve_of_capsule, nullptr, end_of_capsule};

} // namespace cairn
