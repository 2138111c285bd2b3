/* Kernels that rows of detection/pairs.def name. */
#ifndef CAIRN_PAIR_ROWS_H
#define CAIRN_PAIR_ROWS_H
#include "cairn/core.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CAIRN_PAIR(name, a, b, most) cairn_pair_contact cairn_pair_##name;
#define CAIRN_HULL_PAIR(name, a, b, most) cairn_hull_contact cairn_pair_##name;
#include "../../../detection/pairs.def"

#ifdef __cplusplus
}
#endif
#endif
