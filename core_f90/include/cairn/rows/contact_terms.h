/* Contacts one by one, for sums over those of many ranks. */
#ifndef CAIRN_CONTACT_TERMS_H
#define CAIRN_CONTACT_TERMS_H
#include "cairn/core.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Error |F|^2/rho and size |r|^2/rho of each contact of a batch: terms (n, 2), dummies too [J]. want_status: the status
 * of each contact too, and sums (6) with least_scale as cairn_contact_error has them; without it sums are 0. */
void cairn_contact_terms(const cairn_schedule* schedule, int32_t batch, int32_t thread, int32_t want_status,
                         double least_scale, double* sums, double* terms);

#ifdef __cplusplus
}
#endif
#endif
