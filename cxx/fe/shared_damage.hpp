// Damage that the points of a cell share (core_f90/bulk_materials/isotropic_damage.f90), asked without the list of all
// materials: sources that include that are compiled anew with each row.
#pragma once
#include <cstdint>

namespace cairn {

// See cairn_damage_of_cells in cairn/rows.h.
using DamageOfCells = void(std::int32_t points, std::int64_t n, const double* params, const double* length,
                           const double* volume, const double* strain, const double* state_begin, double* state,
                           double* stress, double* tangent, double* drive, double* growth, double* energy,
                           double* dissipated, std::int32_t* status);
DamageOfCells* damage_of_cells();

} // namespace cairn
