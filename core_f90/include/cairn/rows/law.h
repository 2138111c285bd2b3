/* Kernels that rows of contact_laws/laws.def name. Slots that a row does not offer are declared too: nobody calls
 * them. */
#ifndef CAIRN_LAW_ROWS_H
#define CAIRN_LAW_ROWS_H
#include "cairn/core.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A cohesive zone as an element of a solid: r = -(spring u + pull) beside a contact of friction mu (n), with the
 * intensity beta (n) that the velocity u (n, c), bias included, allows. fall (n, c): relative change of the intensity
 * of the springs with the velocity, rise (n, c): change of the friction, either null if nobody asks. params, state as
 * solve has them. */
typedef void cairn_law_zone(int32_t n, int32_t c, const double* u, const double* params, const double* state,
                            double* spring, double* pull, double* fall, double* mu, double* rise, double* beta);
#define CAIRN_LAW(name, ...)                                                                                           \
  cairn_law_prepare cairn_law_##name##_prepare;                                                                        \
  cairn_law_solve cairn_law_##name##_solve;                                                                            \
  cairn_law_commit cairn_law_##name##_commit;                                                                          \
  cairn_law_residual cairn_law_##name##_residual;                                                                      \
  cairn_law_energy cairn_law_##name##_energy;                                                                          \
  cairn_law_zone cairn_law_##name##_zone;                                                                              \
  cairn_law_force cairn_law_##name##_force;                                                                            \
  cairn_law_stiffness cairn_law_##name##_stiffness;
#include "../../../contact_laws/laws.def"
#undef CAIRN_LAW

#ifdef __cplusplus
}
#endif
#endif
