#include "../curved_surfaces.hpp"

namespace cairn {

extern const ShapeSurface surface_of_sphere{surface::ball};

} // namespace cairn
