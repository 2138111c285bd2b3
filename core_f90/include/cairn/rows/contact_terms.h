/* Contacts one by one, for sums over those of many ranks. */
#ifndef CAIRN_CONTACT_TERMS_H
#define CAIRN_CONTACT_TERMS_H
#include "cairn/core.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Error |F|^2/rho and size |r|^2/rho of each contact of a batch: terms (n, 2), dummies too [J]. */
void cairn_contact_terms(const cairn_schedule* schedule, int32_t batch, int32_t thread, double* terms);

#ifdef __cplusplus
}
#endif
#endif
