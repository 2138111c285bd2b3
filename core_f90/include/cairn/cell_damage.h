/* Damage that all points of a cell share, see isotropic_damage.f90. */
#ifndef CAIRN_CELL_DAMAGE_H
#define CAIRN_CELL_DAMAGE_H
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* As a cairn_bulk_material that gets strains, of n cells; volume (points, n), drive (6, points, n), growth (n). */
void cairn_damage_of_cells(int32_t points, int64_t n, const double* params, const double* length, const double* volume,
                           const double* strain, const double* state_begin, double* state, double* stress,
                           double* tangent, double* drive, double* growth, double* energy, double* dissipated,
                           int32_t* status);

#ifdef __cplusplus
}
#endif
#endif
