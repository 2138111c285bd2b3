#include "shape_surface.hpp"

#include <algorithm>

#include "shapes.hpp"

namespace cairn {

#define CAIRN_SHAPE(name, ...) extern const ShapeSurface surface_of_##name;
#include "../../core_f90/detection/shapes.def"
#undef CAIRN_SHAPE

const ShapeSurface& surface_of(Shape shape) {
  static constexpr const ShapeSurface* surfaces[] = {
#define CAIRN_SHAPE(name, ...) &surface_of_##name,
#include "../../core_f90/detection/shapes.def"
#undef CAIRN_SHAPE
  };
  return *surfaces[int(shape)];
}

ShapeData data_of(const Contactors& of, std::int32_t i) {
  const ShapeInfo& shape = info(Shape(of.shape.values[std::size_t(i)]));
  ShapeData out{of.dim, of.radius.values[std::size_t(i)], {0, 0, 0}, &of.hulls, 0};
  if (shape.directed) std::copy_n(of.direction[i], of.dim, out.direction);
  if (shape.is_hull()) out.hull = of.hull.values[std::size_t(i)];
  return out;
}

} // namespace cairn
