#include "surface_motion.hpp"

#include <algorithm>

#include "../base/vectors.hpp"
#include "../laws/bond_laws.hpp"
#include "../laws/law_info.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "body_axes.hpp"

namespace cairn {

namespace {

bool has_belt(const Bodies& bodies, std::int32_t body) {
  const double* own = bodies.surface_velocity[body];
  return std::any_of(own, own + bodies.surface_velocity.components, [](double v) { return v < 0 || v > 0; });
}

bool has_belt(const AssemblyInput& in, std::int32_t contactor) {
  const std::int32_t body = in.body(contactor);
  return body >= 0 && has_belt(*in.bodies, body);
}

} // namespace

bool belt_velocity(const Bodies& bodies, int dim, std::int32_t body, const double* lever, const double* n,
                   double* out) {
  if (!bodies.surface_velocity.active || !has_belt(bodies, body)) return false;
  const double* own = bodies.surface_velocity[body];
  double along = 0;
  if (dim == 2) {
    to_space_axes(bodies, 2, body, own, out);
    out[0] -= own[2] * lever[1];
    out[1] += own[2] * lever[0];
  } else {
    double spin[3];
    to_space_axes(bodies, 3, body, own, out);
    to_space_axes(bodies, 3, body, own + 3, spin);
    add_cross(spin, lever, out);
  }
  for (int k = 0; k < dim; ++k) along += out[k] * n[k];
  for (int k = 0; k < dim; ++k) out[k] -= along * n[k];
  return true;
}

bool has_jumps(const AssemblyInput& in, const std::int32_t* contacts, int n) {
  if (in.sheared || !in.bodies->surface_velocity.active) return in.sheared;
  return std::any_of(contacts, contacts + n, [&](std::int32_t i) {
    return i >= 0 && (has_belt(in, in.candidates->contactor_a[i]) || has_belt(in, in.candidates->contactor_b[i]));
  });
}

namespace {

// Velocity of the surface of B less that of A, added to v, and their spins; false: no surface moves.
bool add_belts(const AssemblyInput& in, std::int64_t i, double* v, double* spin) {
  const int d = in.dim();
  double shift[3] = {0, 0, 0};
  bool moves = false;
  if (in.cell->any()) image_shift(*in.cell, in.candidates->image[i], shift);
  for (const int side : {0, 1}) {
    const std::int32_t body = in.body(side ? in.candidates->contactor_b[i] : in.candidates->contactor_a[i]);
    if (body < 0) continue;
    double lever[3] = {0, 0, 0}, own[3] = {0, 0, 0}, turn[3] = {0, 0, 0};
    for (int k = 0; k < d; ++k)
      lever[k] = in.candidates->point[d * i + k] - in.bodies->position[body][k] - (side ? shift[k] : 0);
    if (!belt_velocity(*in.bodies, d, body, lever, &in.candidates->normal[d * i], own)) continue;
    moves = true;
    const double* given = in.bodies->surface_velocity[body] + d;
    d == 2 ? void(turn[2] = given[0]) : to_space_axes(*in.bodies, 3, body, given, turn);
    for (int k = 0; k < d; ++k) v[k] += side ? own[k] : -own[k];
    for (int k = 0; k < 3; ++k) spin[k] += side ? turn[k] : -turn[k];
  }
  return moves;
}

} // namespace

void add_jump(const AssemblyInput& in, const ContactSystem& system, const cairn_batch& b, int lane, double* u) {
  const std::int64_t i = system.candidate[b.first + lane];
  const int n = b.count, d = in.dim();
  double v[3] = {0, 0, 0}, spin[3] = {0, 0, 0}, axes[3][3] = {};
  if (in.sheared) image_velocity(*in.cell, in.candidates->image[i], v);
  const bool bonded = law_infos()[b.law].joins || (can_bond(Law(b.law)) && b.state && b.state[lane] > 0);
  const bool moves = in.bodies->surface_velocity.active && !bonded && add_belts(in, i, v, spin);
  if (!in.sheared && !moves) return;
  axes_of(b, d, lane, axes);
  for (int c = 0; c < d; ++c) {
    double along = 0;
    for (int k = 0; k < d; ++k) along += axes[c][k] * v[k];
    u[c * n + lane] -= along;
  }
  if (!moves || b.mapped_a || b.mapped_b) return; // nothing turns relative to a mesh
  for (int c = d; c < b.components; ++c)
    u[c * n + lane] -=
        d == 2 ? spin[2] : axes[c - 3][0] * spin[0] + axes[c - 3][1] * spin[1] + axes[c - 3][2] * spin[2];
}

} // namespace cairn
