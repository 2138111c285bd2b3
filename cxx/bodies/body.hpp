// The bodies of a scene: structure of arrays, small vectors fastest, in internal order.
#pragma once
#include "../base/field.hpp"

namespace cairn {

struct Bodies {
  explicit Bodies(int dim);
  int dim;
  std::int64_t count = 0; // owned bodies; ghosts would follow them

#define CAIRN_BODY_FIELD(name, type, c2, c3, unit, stage, when, meaning) Field<type> name;
#include "fields.def"
  std::vector<Field<double>> kept; // rows of kept_fields.def

  int dofs() const { return dim == 2 ? 3 : 6; }
  // Derivative k of the history of an integrator, from 0; null where it is not kept.
  double* history(int k);
  // calls f(field) for every row of both lists
  template <class F>
  void for_each_field(F&& f) {
#define CAIRN_BODY_FIELD(name, type, c2, c3, unit, stage, when, meaning) f(name);
#include "fields.def"
    for (Field<double>& field : kept) f(field);
  }
};

} // namespace cairn
