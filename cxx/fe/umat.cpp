// A user's routine for the stress of a point, as Abaqus calls it (UMAT): 11 22 33 12 13 23, twice the shear in strains.
// It is called in three dimensions whatever the mesh, with the strain of the body's measure, whose axes turn with the
// material: DROT is the identity.
#include <algorithm>
#include <cmath>

#include "bulk_model.hpp"
#include "umat.hpp"

namespace cairn {
namespace {

constexpr int order[6] = {0, 1, 2, 3, 5, 4}; // of Abaqus in ours, which has 23 before 13

// False if the routine left by XIT: there are but Fortran's frames between here and there.
template <class Call>
[[gnu::noinline]] bool comes_back(const Call& call) {
  std::jmp_buf exit;
  if (setjmp(exit) != 0) {
    umat_exit = nullptr;
    return false;
  }
  umat_exit = &exit;
  call();
  umat_exit = nullptr;
  return true;
}

} // namespace

void call_umat_points(const BulkMaterialInfo& material, const std::vector<double>& params, std::int64_t first_cell,
                      int points_of_cell, std::int64_t points, double h, const UmatArrays& a) {
  const int states = int(material.state.size()), own = states - umat_kept;
  const int direct = 3, shear = 3, components = 6, parameters = int(params.size()), one = 1;
  const int step[4] = {1, 1, 0, 0};
  char name[80];
  std::fill_n(name, 80, ' ');
  std::copy_n(material.name.data(), std::min<std::size_t>(80, material.name.size()), name);
  const double none = 0;
  const double upright[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  for (std::int64_t p = 0; p < points; ++p) {
    const double* begin = a.state_begin + p * states;
    double* state = a.state + p * states;
    std::copy_n(begin, states, state);
    double stress[6], strain[6], change[6], tangent[36] = {}, gradient_begin[9], gradient[9];
    for (int k = 0; k < 6; ++k) {
      stress[k] = begin[k];
      strain[k] = begin[6 + k];
      change[k] = a.strain[6 * p + order[k]] - strain[k];
    }
    for (int k = 0; k < 9; ++k) {
      gradient_begin[k] = begin[12 + k] + upright[k];
      gradient[k] = a.gradient[9 * p + k] + upright[k];
    }
    double elastic = begin[22], plastic = begin[23], creep = begin[24], heat = 0, heat_t = 0, new_dt = 1;
    double by_temperature[6] = {}, heat_by_strain[6] = {};
    const double time[2] = {begin[21], begin[21]}, dt = h;
    const int cell = int(first_cell + p / points_of_cell) + 1, point = int(p % points_of_cell) + 1;
    double* own_state = state + umat_kept;
    double no_state = 0;
    const double zero_place[3] = {0, 0, 0};
    const bool back = comes_back([&] {
      material.umat(stress, own > 0 ? own_state : &no_state, tangent, &elastic, &plastic, &creep, &heat, by_temperature,
                    heat_by_strain, &heat_t, strain, change, time, &dt, &none, &none, &none, &none, name, &direct,
                    &shear, &components, &own, params.empty() ? &none : params.data(), &parameters, zero_place, upright,
                    &new_dt, &a.length[p], gradient_begin, gradient, &cell, &point, &one, &one, step, &one, 80);
    });
    bool finite = back && !(new_dt < 1); // it asks for a smaller step
    for (int k = 0; k < 6; ++k) finite = finite && std::isfinite(stress[k]);
    for (double t : tangent) finite = finite && std::isfinite(t);
    for (int k = 0; k < own; ++k) finite = finite && std::isfinite(own_state[k]);
    if (!finite) a.status[p] = 2;
    for (int k = 0; k < 6; ++k) {
      state[k] = stress[k];
      state[6 + k] = a.strain[6 * p + order[k]];
      a.stress[6 * p + order[k]] = stress[k];
      for (int l = 0; l < 6; ++l) a.tangent[36 * p + 6 * order[l] + order[k]] = tangent[6 * l + k];
    }
    std::copy_n(a.gradient + 9 * p, 9, state + 12);
    state[21] = begin[21] + h;
    state[22] = elastic;
    state[23] = plastic;
    state[24] = creep;
    a.energy[p] = elastic;
    a.dissipated[p] = plastic + creep - begin[23] - begin[24];
  }
}

} // namespace cairn
