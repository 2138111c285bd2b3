// A user's routine for the stress at a point, with the interface of Abaqus (UMAT) in the axes of the scene. Components
// are in Voigt order 11 22 33 12 13 23 with engineering shear strains; in the plane 11 22 33 12, in plane stress 11 22
// 12. At large strains STRESS is Cauchy's; it and STRAN arrive rotated by DROT, and DSTRAN is the strain increment
// about the middle of the step.
#include <algorithm>
#include <bit>
#include <cmath>

#include "bulk_model.hpp"
#include "umat.hpp"

namespace cairn {
namespace {

constexpr int order[6] = {0, 1, 2, 3, 5, 4}; // of Abaqus in ours, which has 23 before 13
constexpr int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
constexpr std::uint64_t untouched = 0x7ff4a5c3'96e1d20bULL; // no number that a routine would write

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

// t = r t r' for a symmetric tensor in Voigt order whose shear components are stored times 1 / share; r by columns.
void turn(const double* r, double share, double* t) {
  double full[3][3], half[3][3];
  for (int k = 0; k < 6; ++k) full[row[k]][column[k]] = full[column[k]][row[k]] = k < 3 ? t[k] : share * t[k];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) half[i][j] = r[i] * full[0][j] + r[3 + i] * full[1][j] + r[6 + i] * full[2][j];
  for (int k = 0; k < 6; ++k) {
    const int i = row[k], j = column[k];
    t[k] = (half[i][0] * r[j] + half[i][1] * r[3 + j] + half[i][2] * r[6 + j]) / (k < 3 ? 1 : share);
  }
}

bool all_finite(const double* of, int n) {
  return std::all_of(of, of + n, [](double x) { return std::isfinite(x); });
}

bool all_untouched(const double* of, const double* end) {
  return std::all_of(of, end, [](double x) { return std::bit_cast<std::uint64_t>(x) == untouched; });
}

// Arguments of a routine at a point.
struct Point {
  double stress[6], strain[6], change[6], tangent[36], gradient_begin[9], gradient[9], place[3];
  double elastic, plastic, creep, time[2];
  int cell, point, increment;

  // At the begin of the step.
  void take(const UmatCall& call, const UmatArrays& a, std::int64_t p, int states) {
    const double* begin = a.state_begin + p * states;
    std::copy_n(begin + umat_stress, 6, stress);
    std::copy_n(begin + umat_strain, 6, strain);
    if (call.large) {
      turn(a.rotation + 9 * p, 1, stress);
      turn(a.rotation + 9 * p, 0.5, strain);
    }
    for (int k = 0; k < 6; ++k) change[k] = a.strain[6 * p + order[k]] - (call.large ? 0 : strain[k]);
    for (int k = 0; k < 9; ++k) {
      const double one = k % 4 == 0;
      gradient_begin[k] = begin[umat_gradient + k] + one;
      gradient[k] = a.gradient[9 * p + k] + one;
    }
    std::copy_n(a.place + 3 * p, 3, place);
    elastic = begin[umat_energy];
    plastic = begin[umat_energy + 1];
    creep = begin[umat_energy + 2];
    time[0] = begin[umat_time];
    time[1] = std::isnan(call.time) ? time[0] : call.time;
    cell = int(call.first_cell + p / call.points_of_cell) + 1;
    point = int(p % call.points_of_cell) + 1;
    increment = int(begin[umat_increment]) + 1;
  }

  void keep(const UmatCall& call, const UmatArrays& a, std::int64_t p, int states) const {
    const double* begin = a.state_begin + p * states;
    double* state = a.state + p * states;
    std::copy_n(stress, 6, state + umat_stress);
    for (int k = 0; k < 6; ++k)
      state[umat_strain + k] = call.large ? strain[k] + change[k] : a.strain[6 * p + order[k]];
    std::copy_n(a.gradient + 9 * p, 9, state + umat_gradient);
    state[umat_time] = begin[umat_time] + call.h;
    state[umat_energy] = elastic;
    state[umat_energy + 1] = plastic;
    state[umat_energy + 2] = creep;
    state[umat_increment] = increment;
    a.energy[p] = elastic;
    a.dissipated[p] = plastic + creep - begin[umat_energy + 1] - begin[umat_energy + 2];
  }
};

// Calls the routine with the numbers of a point and its own states; returns its status.
int ask(const UmatCall& call, const char* name, const double* rotation, double length, Point& at, double* own_state) {
  const BulkMaterialInfo& material = call.material;
  const int own = int(material.state.size()) - umat_kept, parameters = int(call.params.size()), one = 1;
  const int direct = call.direct, shear = call.shear, components = direct + shear;
  const int step[4] = {1, 1, call.large, 0};
  const double none = 0;
  double heat = 0, heat_t = 0, new_dt = 1, by_temperature[6] = {}, heat_by_strain[6] = {}, no_state = 0;
  double stress[6], strain[6] = {}, change[6] = {};
  double* const beyond_stress = stress + components;
  double* const beyond_tangent = at.tangent + components * components;
  for (int k = 0; k < components; ++k) {
    stress[k] = at.stress[call.place(k)];
    strain[k] = at.strain[call.place(k)];
    change[k] = at.change[call.place(k)];
  }
  std::fill(at.tangent, beyond_tangent, 0.0);
  std::fill(beyond_stress, stress + 6, std::bit_cast<double>(untouched));
  std::fill(beyond_tangent, at.tangent + 36, std::bit_cast<double>(untouched));
  const bool back = comes_back([&] {
    material.umat(stress, own > 0 ? own_state : &no_state, at.tangent, &at.elastic, &at.plastic, &at.creep, &heat,
                  by_temperature, heat_by_strain, &heat_t, strain, change, at.time, &call.h, &none, &none, &none, &none,
                  name, &direct, &shear, &components, &own, parameters == 0 ? &none : call.params.data(), &parameters,
                  at.place, rotation, &new_dt, &length, at.gradient_begin, at.gradient, &at.cell, &at.point, &one, &one,
                  step, &at.increment, 80);
  });
  if (!all_untouched(beyond_stress, stress + 6) || !all_untouched(beyond_tangent, at.tangent + 36))
    return umat_writes_beyond;
  for (int k = 0; k < components; ++k) at.stress[call.place(k)] = stress[k];
  if (!back) return umat_leaves;
  if (new_dt < 1) return umat_wants_less;
  const bool sound =
      all_finite(stress, components) && all_finite(at.tangent, components * components) && all_finite(own_state, own);
  return sound ? 0 : 2;
}

} // namespace

void call_umat_points(const UmatCall& call, std::int64_t points, const UmatArrays& a,
                      volatile std::int64_t* working_on) {
  const int states = int(call.material.state.size()), components = call.direct + call.shear;
  const double upright[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  char name[80];
  std::fill_n(name, 80, ' ');
  std::copy_n(call.material.name.data(), std::min<std::size_t>(80, call.material.name.size()), name);
  for (std::int64_t p = 0; p < points; ++p) {
    double* state = a.state + p * states;
    std::copy_n(a.state_begin + p * states, states, state);
    std::fill_n(a.stress + 6 * p, 6, 0.0);
    std::fill_n(a.tangent + 36 * p, 36, 0.0);
    a.energy[p] = a.dissipated[p] = 0;
    if (a.status[p] != 0) continue; // its volume is not positive
    if (working_on) *working_on = p;
    Point at;
    at.take(call, a, p, states);
    const int status = ask(call, name, call.large ? a.rotation + 9 * p : upright, a.length[p], at, state + umat_kept);
    if (status != 0) a.status[p] = status;
    at.keep(call, a, p, states);
    for (int k = 0; k < components; ++k) {
      const int row = order[call.place(k)];
      a.stress[6 * p + row] = at.stress[call.place(k)];
      for (int l = 0; l < components; ++l)
        a.tangent[36 * p + 6 * order[call.place(l)] + row] = at.tangent[components * l + k];
    }
  }
}

} // namespace cairn
