#include "nodes.hpp"

namespace cairn {

Nodes::Nodes(int dimension) : dim(dimension) {
#define CAIRN_NODE_FIELD(field, type, c2, c3, unit_, stage_, when, meaning_)                                           \
  field.name = #field;                                                                                                 \
  field.unit = unit_;                                                                                                  \
  field.stage = #stage_;                                                                                               \
  field.meaning = meaning_;                                                                                            \
  field.need = Need::when;                                                                                             \
  field.components = dim == 2 ? c2 : c3;                                                                               \
  field.active = Need::when == Need::always;
#include "fields.def"
}

} // namespace cairn
