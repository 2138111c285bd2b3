/* Kernels that rows of integrators/integrators.def name. */
#ifndef CAIRN_INTEGRATOR_ROWS_H
#define CAIRN_INTEGRATOR_ROWS_H
#include "cairn/core.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CAIRN_INTEGRATOR(name, python, parameters, meaning) cairn_integrator cairn_integrator_##name;
#include "../../../integrators/integrators.def"
#undef CAIRN_INTEGRATOR

#ifdef __cplusplus
}
#endif
#endif
