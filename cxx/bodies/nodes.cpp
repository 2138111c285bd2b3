#include "nodes.hpp"

namespace cairn {
namespace {

enum NodePlace {
#define CAIRN_KEPT_NODE_FIELD(name, ...) node_place_of_##name,
#include "kept_fields.def"
};
static_assert(node_place_of_snap == node_place_of_jerk + 1 && node_place_of_crackle == node_place_of_snap + 1);

} // namespace

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
#define CAIRN_KEPT_NODE_FIELD(field, c2, c3, unit_, stage_, when, meaning_)                                            \
  kept.push_back({#field, unit_, #stage_, meaning_, Need::when, dim == 2 ? c2 : c3, Need::when == Need::always, {}});
#include "kept_fields.def"
}

double* Nodes::history(int k) {
  Field<double>& field = k == 0 ? acceleration : kept[std::size_t(node_place_of_jerk + k - 1)];
  return field.active ? field.values.data() : nullptr;
}

} // namespace cairn
