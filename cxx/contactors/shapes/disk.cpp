#include "../curved_surfaces.hpp"

namespace cairn {

extern const ShapeSurface surface_of_disk{surface::ball};

} // namespace cairn
