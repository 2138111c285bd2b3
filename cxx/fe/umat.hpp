#pragma once
#include <csetjmp>
#include <cstdint>
#include <string>
#include <vector>

#include "bulk_materials.hpp"

namespace cairn {

// Numbers of a point's state before those of the routine: stress, strain, gradient of displacement, time, energies,
// increments.
inline constexpr int umat_stress = 0, umat_strain = 6, umat_gradient = 12, umat_time = 21, umat_energy = 22,
                     umat_increment = 25, umat_kept = 26;
inline constexpr int umat_writes_beyond = 5, umat_leaves = 6, umat_wants_less = 7, umat_ends = 8; // faults

// Where XIT goes to; null outside a call.
extern thread_local std::jmp_buf* umat_exit;

struct UmatCall { // arguments common to all points
  const BulkMaterialInfo& material;
  const std::vector<double>& params;
  bool large = false;          // strains: stresses are Cauchy's, turned with the rotation of the step
  int direct = 3, shear = 3;   // in the plane 3 and 1, for plane stress 2 and 1
  std::int64_t first_cell = 0; // of these points
  int points_of_cell = 1;
  double h = 1, time = 0; // of the step [s]; at its begin [s], not a number: that since the start
  int place(int k) const { return k < direct ? k : 3 + k - direct; } // of a component of the routine in Voigt order
};

struct UmatArrays {                                       // of the points
  const double *state_begin, *strain, *gradient;          // (states); (6), of large strains that of the step; (3, 3)
  const double *rotation, *length, *place;                // (3, 3) of the step, of large strains alone; (); (3)
  double *state, *stress, *tangent, *energy, *dissipated; // (states), (6), (6, 6), (), ()
  std::int32_t* status;
};

// Stresses of points one after the other; working_on, if given, is told which.
void call_umat_points(const UmatCall& call, std::int64_t points, const UmatArrays& arrays,
                      volatile std::int64_t* working_on = nullptr);

// The same in a process of its own, for a material with a time limit [s]: where that ends by itself, or exceeds the
// limit and is stopped, the point it was at has the fault umat_ends, and a new process answers the next call.
void call_umat_apart(const UmatCall& call, std::int64_t points, const UmatArrays& arrays);

// End of the last process of a material, with its last output: "ended its process (signal 11); it said: ...".
std::string last_words(const BulkMaterialInfo& material);

// The routine `symbol`, or that with an underscore, of a shared library, as a material of that name with so many states
// STATEV at each point; plane_stress: it is written for elements of plane stress; time_limit: of a call in a process of
// its own [s], 0 in this one. The library stays loaded. Throws Error.
void plug_umat(const std::string& library, const std::string& symbol, const std::string& name, int states,
               bool plane_stress, double time_limit = 0);

} // namespace cairn
