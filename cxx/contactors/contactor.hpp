// The shapes that detect, each carried by a body.
#pragma once
#include <iterator>

#include "../base/field.hpp"
#include "cairn/core.h"
#include "hulls.hpp"

namespace cairn {

enum class Shape : std::int16_t {
#define CAIRN_SHAPE(name, ...) name,
#include "../../core_f90/detection/shapes.def"
#undef CAIRN_SHAPE
};
// What shapes.def says of each.
struct ShapeInfo {
  const char* name;
  int dim;
  bool bounded;
  int round;
  bool directed;
  Hulls::Form hull;
  bool mover, faced;
  cairn_convex convex;
  constexpr bool ball() const { return round > 0; }
  constexpr bool hollow() const { return round < 0; }
  constexpr bool is_hull() const { return hull != Hulls::Form::none; }
};
inline constexpr ShapeInfo shape_infos[] = {
#define CAIRN_SHAPE(name, dimension, bounded, round, directed, hull, mover, faced, convex)                             \
  {#name,      dimension,  bounded != 0,         round, directed != 0, Hulls::Form::hull,                              \
   mover != 0, faced != 0, cairn_convex_##convex},
#include "../../core_f90/detection/shapes.def"
#undef CAIRN_SHAPE
};
inline constexpr int shapes = int(std::size(shape_infos));
constexpr const ShapeInfo& info(Shape shape) { return shape_infos[int(shape)]; }

struct Contactors {
  explicit Contactors(int dim);
  int dim;
  std::int64_t count = 0;
  Hulls hulls; // what those of them are that have one

#define CAIRN_CONTACTOR_FIELD(name, type, c2, c3, unit, stage, when, meaning) Field<type> name;
#include "../bodies/fields.def"

  template <class F>
  void for_each_field(F&& f) {
#define CAIRN_CONTACTOR_FIELD(name, type, c2, c3, unit, stage, when, meaning) f(name);
#include "../bodies/fields.def"
  }
};

} // namespace cairn
