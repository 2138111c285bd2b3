#include "body_records.hpp"

#include <algorithm>
#include <cmath>

#include "../contactors/shapes.hpp"
#include "body_speeds.hpp"

namespace cairn {

// Speeds and weights to which velocity errors are relative.
void BodyRecords::measure_speeds(const Bodies& bodies) {
  double by_loads = 0, at_begin = 0, of_meshes = 0;
  for (std::int64_t b = 0; b < bodies.count; ++b)
    each_speed(bodies, b, in_.dim(), [&](double change, double begin) {
      by_loads += change;
      at_begin += begin;
    });
  for (std::int64_t i = 0; in_.meshes && i < in_.nodes->count; ++i)
    for (int k = 0; k < in_.dim(); ++k) {
      const double v = in_.nodes->velocity_free[i][k], change = v - in_.nodes->velocity_begin[i][k],
                   mass = *in_.nodes->mass[i];
      by_loads += mass * change * change;
      of_meshes += mass * v * v;
    }
  system_.weight_speed_square = by_loads;
  system_.begin_speed_square = at_begin;
  system_.mesh_speed_square = of_meshes;
}

void BodyRecords::load() {
  const Bodies& b = *in_.bodies;
  const std::int64_t n = b.count; // nodes of meshes have no record
  system_.bodies = n;
  fit(system_.record, n + 1);
  const bool space = in_.dim() == 3, anisotropic = space && b.inverse_inertia.active;
  std::int32_t* motion = classes_.degree; // for the moment: 1 isotropic, 2 moves
  system_.record[n] = cairn_record{};
  for (std::int64_t i = 0; i < n; ++i) {
    const double *v = b.velocity[i], *m = b.inverse_mass[i];
    cairn_record& r = system_.record[i];
    bool isotropic, moves;
    if (!space) {
      r = cairn_record{{v[0], v[1], v[2], m[0], m[1], m[2], 0, 0}};
      isotropic = m[0] == m[1] && (m[0] > 0 || !(m[2] > 0));
      moves = m[0] > 0 || m[1] > 0 || m[2] > 0;
    } else {
      r = cairn_record{{v[0], v[1], v[2], v[3], v[4], v[5], m[0], m[3]}};
      isotropic = m[0] == m[1] && m[0] == m[2] && m[3] == m[4] && m[3] == m[5] && (m[0] > 0 || !(m[3] > 0));
      moves = m[0] > 0 || m[1] > 0 || m[2] > 0 || m[3] > 0 || m[4] > 0 || m[5] > 0;
      if (anisotropic) {
        const double* j = b.inverse_inertia[i];
        for (int k = 0; k < 6; ++k) isotropic = isotropic && j[k] == (k < 3 ? m[3 + k] : 0);
      }
    }
    motion[i] = (isotropic ? 1 : 0) + (moves ? 2 : 0);
  }
  bool wide = false; // only round bodies centred on their contactor do without their further inertia
  for (std::int64_t c = 0; c < in_.contactors->count; ++c) {
    bool centred = info(Shape(*in_.contactors->shape[c])).ball();
    centred = centred && !frames_.is_of_joint(*in_.contactors->material[c]);
    if (centred && in_.contactors->offset.active)
      for (int k = 0; k < in_.dim(); ++k) centred = centred && !(in_.contactors->offset[c][k] != 0);
    const std::int32_t carrier = in_.body(std::int32_t(c));
    const int of_body = carrier < 0 ? 0 : motion[carrier];
    classes_.kind[c] = carrier < 0 ? ContactClasses::moving + ContactClasses::mapped
                                   : std::uint8_t((centred ? of_body & 1 : 0) + (of_body & 2));
    wide = wide || (space && classes_.kind[c] == 2);
  }
  load_further_inertia(wide ? n : -1);
  load_meshes();
}

// All contacts of a mesh move it whole.
void BodyRecords::load_meshes() {
  system_.condensed_dofs.clear();
  system_.reaches = false;
  if (!in_.meshes) return system_.condensed.clear(); // the last one may have gone
  const Candidates& c = *in_.candidates;
  const bool images = in_.cell->any();
  in_.meshes->begin_to_want();
  for (std::int64_t i = 0; i < c.count; ++i) {
    const std::int32_t one = c.contactor_a[i], two = c.contactor_b[i];
    const double* point = &c.point[in_.dim() * i];
    if (classes_.is_mapped(one)) in_.meshes->want(in_.meshes->mapping(*in_.nodes, one, point, two));
    if (!classes_.is_mapped(two)) continue;
    double shift[3] = {0, 0, 0}, there[3] = {0, 0, 0}; // the point beside B, where B itself is
    if (images) image_shift(*in_.cell, c.image[i], shift);
    for (int k = 0; k < std::min(in_.dim(), 3); ++k) there[k] = point[k] - shift[k];
    in_.meshes->want(in_.meshes->mapping(*in_.nodes, two, there, one));
  }
  in_.meshes->condense(system_.condensed, system_.condensed_velocity, in_.options.pose.kernel != nullptr);
  for (const CondensedBody& body : system_.condensed) {
    system_.condensed_dofs.push_back(body.dofs);
    system_.reaches = system_.reaches || body.dofs.reach;
  }
  system_.load_condensed(in_.nodes->velocity);
}

// For sides that read it; -1: none does.
void BodyRecords::load_further_inertia(std::int64_t n) {
  fit(system_.general, std::size_t(n + 1));
  if (n < 0) return;
  const Bodies& b = *in_.bodies;
  system_.general[n] = cairn_record{};
  for (std::int64_t i = 0; i < n; ++i) {
    const double* m = b.inverse_mass[i];
    double inertia[6] = {m[3], m[4], m[5], 0, 0, 0};
    if (b.inverse_inertia.active) std::copy_n(b.inverse_inertia[i], 6, inertia);
    system_.general[i] =
        cairn_record{{m[1], m[2], inertia[0], inertia[1], inertia[2], inertia[3], inertia[4], inertia[5]}};
  }
}

} // namespace cairn
