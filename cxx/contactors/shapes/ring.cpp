#include "../curved_surfaces.hpp"

namespace cairn {

namespace {

bool curve_of_ring(const ShapeData& shape, const CurvatureView&, SurfaceCurvature& out) {
  surface::make_even(-1 / shape.radius, out);
  return true;
}

} // namespace

extern const ShapeSurface surface_of_ring{curve_of_ring};

} // namespace cairn
