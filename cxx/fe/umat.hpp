#pragma once
#include <csetjmp>
#include <cstdint>
#include <string>
#include <vector>

#include "bulk_materials.hpp"

namespace cairn {

inline constexpr int umat_kept = 25; // numbers of a point's state before those of the routine

// Where XIT goes to; null outside a call.
extern thread_local std::jmp_buf* umat_exit;

struct UmatArrays {                                       // of the points
  const double *state_begin, *strain, *gradient, *length; // (states), (6), (3, 3), ()
  double *state, *stress, *tangent, *energy, *dissipated; // (states), (6), (6, 6), (), ()
  std::int32_t* status;
};

// Stresses of points one after the other, by the routine of `material`.
void call_umat_points(const BulkMaterialInfo& material, const std::vector<double>& params, std::int64_t first_cell,
                      int points_of_cell, std::int64_t points, double h, const UmatArrays& arrays);

// The routine `symbol`, or that with an underscore, of a shared library, as a material of that name with so many states
// STATEV at each point; the library stays loaded. Throws Error.
void plug_umat(const std::string& library, const std::string& symbol, const std::string& name, int states);

} // namespace cairn
