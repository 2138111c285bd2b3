/* Pairs of smooth scenes: a part of core.h. */
#ifndef CAIRN_SMOOTH_H
#define CAIRN_SMOOTH_H
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

void cairn_smooth_sides(int32_t dim, int32_t n, const int32_t* a, const int32_t* b, const int32_t* body_a,
                        const int32_t* body_b, const double* grain, const double* between, const double* point,
                        int32_t has_offset, const double* centre, const double* position, double* lever_a,
                        double* lever_b, double* grain_a, double* grain_b);
void cairn_smooth_admit(int32_t n, const double* gap, const int32_t* status, double reach, int32_t states,
                        double* state, int8_t* active, int32_t* lane, int32_t* count, int32_t* filled);
void cairn_smooth_sums(int32_t count, int32_t m, const double* gap, const double* geometry, const double* energy,
                       double* deepest, double* contacts, double* energies);
void cairn_smooth_add(int32_t nd, int64_t n, const int32_t* body, const int32_t* place, const double* other,
                      double* force);

#ifdef __cplusplus
}
#endif
#endif
