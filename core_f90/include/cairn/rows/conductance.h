/* Kernels that rows of networks/networks.def name. */
#ifndef CAIRN_CONDUCTANCE_ROWS_H
#define CAIRN_CONDUCTANCE_ROWS_H
#include "cairn/core.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CAIRN_CONDUCTANCE(name, python, parameters, reads, meaning) cairn_conductance cairn_conductance_##name;
#include "../../../networks/networks.def"

#ifdef __cplusplus
}
#endif
#endif
