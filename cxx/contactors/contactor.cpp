#include "shapes.hpp"

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

} // namespace cairn
