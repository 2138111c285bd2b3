/* Kernels that rows of elements/elements.def name. */
#ifndef CAIRN_ELEMENT_ROWS_H
#define CAIRN_ELEMENT_ROWS_H
#include "cairn/core.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CAIRN_ELEMENT(name, cell, dim, nodes, points, bulk_points, order)                                              \
  cairn_element_rule cairn_element_##name##_rule;                                                                      \
  cairn_element_rule cairn_element_##name##_bulk_rule;                                                                 \
  cairn_element_shape cairn_element_##name##_shape;
#include "../../../elements/elements.def"
#undef CAIRN_ELEMENT

#ifdef __cplusplus
}
#endif
#endif
