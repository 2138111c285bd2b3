#include "../curved_surfaces.hpp"

namespace cairn {

extern const ShapeSurface surface_of_polygon{surface::corners};

} // namespace cairn
