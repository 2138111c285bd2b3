#include <cmath>

#include "../curved_surfaces.hpp"

namespace cairn {

namespace {

// A bar is round or sharp at its ends, and flat between.
bool curve_of_segment(const ShapeData& shape, const CurvatureView& view, SurfaceCurvature& out) {
  const double* along = shape.direction;
  if (std::abs(along[0] * view.outward[0] + along[1] * view.outward[1]) > 1e-6)
    shape.radius > 0 ? surface::make_even(1 / shape.radius, out) : surface::make_corner(out);
  return true;
}

} // namespace

extern const ShapeSurface surface_of_segment{curve_of_segment};

} // namespace cairn
