#include "shapes.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

constexpr ShapeInfo shape_table[] = {
#define CAIRN_SHAPE(name, dimension, bounded, round, directed, hull, mover, faced, convex)                             \
  {#name,      dimension,  bounded != 0,         round, directed != 0, Hulls::Form::hull,                              \
   mover != 0, faced != 0, cairn_convex_##convex},
#include "../../core_f90/detection/shapes.def"
#undef CAIRN_SHAPE
};
// A convex pair that its kernel cannot see does not compile.
constexpr cairn_convex seen(Shape shape) { return shape_table[int(shape)].convex; }
#define CAIRN_CONVEX_PAIR(a, b, most)                                                                                  \
  static_assert(seen(Shape::a) >= 0 && seen(Shape::a) != cairn_convex_half_space && seen(Shape::b) >= 0);
#include "../../core_f90/detection/pairs.def"

std::span<const ShapeInfo> shape_infos() { return shape_table; }

std::vector<std::pair<std::string, std::string>> pairs_of_shapes() {
  return {
#define CAIRN_PAIR(name, a, b, most) {#a, #b},
#define CAIRN_HULL_PAIR(name, a, b, most) {#a, #b},
#define CAIRN_CONVEX_PAIR(a, b, most) {#a, #b},
#include "../../core_f90/detection/pairs.def"
  };
}

Contactors::Contactors(int dimension) : dim(dimension), hulls(dimension) {
#define CAIRN_CONTACTOR_FIELD(field, type, c2, c3, unit_, stage_, when, meaning_)                                      \
  field.name = #field;                                                                                                 \
  field.unit = unit_;                                                                                                  \
  field.stage = #stage_;                                                                                               \
  field.meaning = meaning_;                                                                                            \
  field.need = Need::when;                                                                                             \
  field.components = dim == 2 ? c2 : c3;                                                                               \
  field.active = Need::when == Need::always;
#include "../bodies/fields.def"
}

double Contactors::size(std::int32_t i) const {
  const ShapeInfo& of = info(Shape(shape.values[std::size_t(i)]));
  if (!of.is_hull()) return radius.values[std::size_t(i)];
  if (of.hull == Hulls::Form::facet) return 0;
  const std::int32_t h = hull.values[std::size_t(i)];
  const double* offset = &hulls.offset[std::size_t(hulls.first_face[std::size_t(h)])];
  if (of.hull == Hulls::Form::superquadric) return std::min({offset[0], offset[1], offset[2]});
  constexpr double thinnest = 0x1p-10; // half width over reach: that of a sliver is rounding, and measures no overlap
  if (of.hull != Hulls::Form::axial)
    return std::max(hulls.inner[std::size_t(h)], thinnest * radius.values[std::size_t(i)]);
  const double half_length = std::abs(hulls.vertex[3 * std::size_t(hulls.first_vertex[std::size_t(h)]) + 2]);
  return of.faced ? std::min(offset[0], half_length) : offset[0]; // the ends of a capsule are round
}

} // namespace cairn
