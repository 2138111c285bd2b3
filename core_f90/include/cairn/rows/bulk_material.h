/* Kernels that rows of bulk_materials/bulk_materials.def name. */
#ifndef CAIRN_BULK_MATERIAL_ROWS_H
#define CAIRN_BULK_MATERIAL_ROWS_H
#include "cairn/core.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CAIRN_BULK_MATERIAL(name, python, given, parameters, state, symmetric) cairn_bulk_material cairn_bulk_##name;
#include "../../../bulk_materials/bulk_materials.def"
#undef CAIRN_BULK_MATERIAL
/* Of n cells whose points share one damage; volume (points, n), drive (6, points, n), growth (n), the others as of a
 * cairn_bulk_material that gets strains. */
void cairn_damage_of_cells(int32_t points, int64_t n, const double* params, const double* length, const double* volume,
                           const double* strain, const double* state_begin, double* state, double* stress,
                           double* tangent, double* drive, double* growth, double* energy, double* dissipated,
                           int32_t* status);

#ifdef __cplusplus
}
#endif
#endif
