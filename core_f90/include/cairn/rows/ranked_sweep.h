/* A sweep whose sums do not depend on how contacts are shared among ranks. */
#ifndef CAIRN_RANKED_SWEEP_H
#define CAIRN_RANKED_SWEEP_H
#include "cairn/core.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Sweeps the contacts of the schedule from r + factor (r - r_before), whose velocities the bodies have already, and
 * leaves r in r_before (stride, places). Per batch, in whole units, whose reciprocals are given: change, the sum of
 * |dr|^2/rho, dr what the sweep itself changed; along, that of -dr.(r - r_before)/rho. */
void cairn_ranked_sweep(const cairn_schedule* schedule, double factor, int32_t stride, double* r_before,
                        double unit_change, double unit_along, int64_t* change, int64_t* along);

#ifdef __cplusplus
}
#endif
#endif
