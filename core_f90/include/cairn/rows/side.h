/* Kernels that rows of sides/sides.def name. */
#ifndef CAIRN_SIDE_ROWS_H
#define CAIRN_SIDE_ROWS_H
#include "cairn/core.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CAIRN_MAPPED_SIDE(name, dimension, lever, width) cairn_side_gather cairn_side_##name##_gather;
#define CAIRN_SIDE(name, dimension, lever, width)                                                                      \
  cairn_side_gather cairn_side_##name##_gather;                                                                        \
  cairn_side_scatter cairn_side_##name##_scatter;                                                                      \
  cairn_side_delassus cairn_side_##name##_delassus;
#include "../../../sides/sides.def"
#undef CAIRN_SIDE
#undef CAIRN_MAPPED_SIDE

#ifdef __cplusplus
}
#endif
#endif
