// The shapes that detect, each carried by a body.
#pragma once
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "../base/field.hpp"
#include "cairn/core.h"
#include "hulls.hpp"

namespace cairn {

enum class Shape : std::int16_t; // rows of shapes.def; their names stand in shapes.hpp
// Properties of a shape, from its row of shapes.def.
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
  constexpr bool half_space() const { return !bounded && round == 0; }
  constexpr bool bar() const { return bounded && directed; }
  constexpr bool corners() const { return hull == Hulls::Form::polygon || hull == Hulls::Form::polyhedron; }
  constexpr bool facet() const { return hull == Hulls::Form::facet; }
  constexpr bool curved_hull() const { return hull == Hulls::Form::axial || hull == Hulls::Form::superquadric; }
  constexpr bool is_hull() const { return hull != Hulls::Form::none; }
};
extern const ShapeInfo shape_table[];
std::span<const ShapeInfo> shape_infos();
std::vector<std::pair<std::string, std::string>> pairs_of_shapes(); // that meet, in the order of pairs.def
inline const ShapeInfo& info(Shape shape) { return shape_table[int(shape)]; }

struct Contactors {
  explicit Contactors(int dim);
  int dim;
  std::int64_t count = 0;
  Hulls hulls; // of each contactor that has one

#define CAIRN_CONTACTOR_FIELD(name, type, c2, c3, unit, stage, when, meaning) Field<type> name;
#include "../bodies/fields.def"

  // Size by which overlaps and ways are divided [m]: radius of a ball or bar, of the ball inscribed in a polygon or
  // polyhedron, half of the least width of other round shapes; 0 for facets and walls, which have no thickness.
  double size(std::int32_t contactor) const;

  template <class F>
  void for_each_field(F&& f) {
#define CAIRN_CONTACTOR_FIELD(name, type, c2, c3, unit, stage, when, meaning) f(name);
#include "../bodies/fields.def"
  }
};

} // namespace cairn
