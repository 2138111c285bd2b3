#include "../curved_surfaces.hpp"

namespace cairn {

extern const ShapeSurface surface_of_half_plane{surface::half_space};

} // namespace cairn
