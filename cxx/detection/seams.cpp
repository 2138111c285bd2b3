// Contacts with covered sides of flush bodies are dropped here; core_f90/detection/seams.f90 has the rule. This file
// lists the runs of contacts of each contactor, calls the kernel and applies its verdicts.
#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "cairn/seams.h"
#include "detection_workspace.hpp"

namespace cairn {

using namespace detection;

namespace {

// The kind of each shape in seams.f90.
struct SeamShapes {
  std::int32_t seen[shapes];
  SeamShapes() { std::transform(shape_infos().begin(), shape_infos().end(), seen, kind_of); }
  static std::int32_t kind_of(const ShapeInfo& shape) {
    if (shape.ball()) return cairn_seam_ball;
    if (shape.half_space()) return cairn_seam_half_space;
    if (shape.bar()) return cairn_seam_bar;
    switch (shape.hull) {
    case Hulls::Form::polygon:
    case Hulls::Form::polyhedron: return cairn_seam_hull;
    case Hulls::Form::facet: return cairn_seam_facet;
    case Hulls::Form::axial: return shape.faced ? cairn_seam_cylinder : cairn_seam_capsule;
    case Hulls::Form::superquadric: return cairn_seam_superquadric;
    default: return cairn_seam_other;
    }
  }
  bool has_rim(std::int16_t shape) const {
    return seen[shape] == cairn_seam_hull || seen[shape] == cairn_seam_bar || seen[shape] == cairn_seam_cylinder;
  }
};
const SeamShapes seam_shapes;

} // namespace

bool InteractionHandler::Workspace::may_have_seams() const {
  const auto& shape = contactors->shape.values;
  if (for_bonds || !(step > 0)) return false;
  std::int64_t surface = -1; // a triangle of a body; seams of surfaces are with other bodies
  bool several = false;
  for (std::int64_t c = 0; c < contactors->count; ++c) {
    if (seam_shapes.has_rim(shape[std::size_t(c)])) return true;
    const std::int32_t seen = seam_shapes.seen[shape[std::size_t(c)]];
    if (seen == cairn_seam_half_space) several = true;
    if (seen != cairn_seam_facet || contactors->body.values[c] < 0) continue;
    several = several || (surface >= 0 && contactors->body.values[c] != contactors->body.values[surface]);
    surface = c;
  }
  return surface >= 0 && several;
}

// Finds runs, contacts of a pair with equal normals.
std::int32_t InteractionHandler::Workspace::find_runs(const Candidates& out) {
  run.make_room(*scratch, out.count + 1);
  const std::int32_t *first = out.contactor_a.data(), *second = out.contactor_b.data();
  std::int32_t runs = 0;
  for (std::int64_t i = 0; i < out.count; ++i) {
    const bool goes_on = i > 0 && first[i] == first[i - 1] && second[i] == second[i - 1] &&
                         out.image[i] == out.image[i - 1] &&
                         std::equal(&out.normal[i * dim], &out.normal[i * dim] + dim, &out.normal[(i - 1) * dim]);
    if (!goes_on) run[runs++] = i;
  }
  run[runs] = out.count;
  return runs;
}

// Lists the runs of each contactor that may slide over a seam: a run of it with the rim of another body closes, or is
// pressed on by another run. Returns how many entries there are.
std::int32_t InteractionHandler::Workspace::list_runs(const Candidates& out, std::int32_t runs) {
  constexpr std::int8_t pressed = 1, slides = 2;
  const std::int32_t *first = out.contactor_a.data(), *second = out.contactor_b.data();
  const auto has_rim = [&](std::int32_t c) {
    return seam_shapes.has_rim(contactors->shape.values[c]) ||
           (seam_shapes.seen[contactors->shape.values[c]] == cairn_seam_facet && contactors->body.values[c] >= 0);
  };
  seam_mark.make_room(*scratch, contactors->count);
  runs_start.make_room(*scratch, contactors->count + 1);
  std::fill_n(seam_mark.begin(), contactors->count, std::int8_t(0));
  std::fill_n(runs_start.begin(), contactors->count + 1, 0);
  for (std::int32_t r = 0; r < runs; ++r)
    if (runs_close[r] == cairn_seam_by_speed) seam_mark[first[run[r]]] = seam_mark[second[run[r]]] = pressed;
  for (std::int32_t r = 0; r < runs; ++r) {
    const std::int32_t a = first[run[r]], b = second[run[r]];
    if ((runs_close[r] != 0 || (seam_mark[a] & pressed)) && has_rim(b)) seam_mark[a] |= slides;
    if ((runs_close[r] != 0 || (seam_mark[b] & pressed)) && has_rim(a)) seam_mark[b] |= slides;
  }
  for (std::int32_t r = 0; r < runs; ++r)
    for (const std::int32_t c : {first[run[r]], second[run[r]]})
      if (seam_mark[c] & slides) ++runs_start[c];
  std::int32_t all = 0;
  for (std::int64_t c = 0; c <= contactors->count; ++c) all += runs_start[c], runs_start[c] = all;
  runs_of.make_room(*scratch, all);
  for (std::int32_t r = runs - 1; r >= 0; --r) { // runs_start becomes where each begins
    if (seam_mark[second[run[r]]] & slides) runs_of[--runs_start[second[run[r]]]] = 2 * r + 1;
    if (seam_mark[first[run[r]]] & slides) runs_of[--runs_start[first[run[r]]]] = 2 * r;
  }
  return all;
}

// Replaces the normal of a contact, and recomputes gap and point along the new one, which points to the sliding body.
void InteractionHandler::Workspace::turn_contact(Candidates& out, std::int64_t i, bool of_b,
                                                 const double* normal) const {
  const double sense = of_b ? -1 : 1;
  const std::int32_t x = of_b ? out.contactor_b[i] : out.contactor_a[i],
                     y = of_b ? out.contactor_a[i] : out.contactor_b[i];
  const bool bar = Shape(contactors->shape.values[y]) == Shape::segment;
  const double layer = bar ? contactors->radius.values[y] : 0; // of the other body, around its axis
  double *n = &out.normal[i * dim], *point = &out.point[i * dim], from[3] = {}, to[3] = {}, shift[3] = {}, gap = 0;
  for (int c = 0; c < dim; ++c) { // points of the two bodies
    from[c] = point[c] - sense * (out.gap[i] / 2 + layer) * n[c] + layer * normal[c];
    to[c] = point[c] + sense * out.gap[i] / 2 * n[c];
  }
  if (info(Shape(contactors->shape.values[x])).ball()) {
    if (of_b && any_periodic) image_shift(*cell, out.image[i], shift);
    for (int c = 0; c < dim; ++c)
      to[c] = centre[std::int64_t(x) * dim + c] + shift[c] - contactors->radius.values[x] * normal[c];
  }
  for (int c = 0; c < dim; ++c) gap += normal[c] * (to[c] - from[c]);
  for (int c = 0; c < dim; ++c) point[c] = to[c] - gap / 2 * normal[c];
  for (int c = 0; c < dim; ++c) n[c] = sense * normal[c];
  out.gap[i] = gap;
}

void InteractionHandler::Workspace::leave_seams(Candidates& out) {
  if (!may_have_seams() || out.count < 2) return;
  const std::int32_t runs = find_runs(out);
  const Hulls& h = contactors->hulls;
  const bool hulls = contactors->hull.active;
  const cairn_seams given{dim,
                          any_periodic,
                          contactors->shape.values.data(),
                          seam_shapes.seen,
                          centre.data(),
                          contactors->radius.values.data(),
                          contactors->direction.active ? direction.data() : nullptr,
                          cell->vectors,
                          {dim, 0, 0, 0, hulls ? contactors->hull.values.data() : nullptr, h.first_vertex.data(),
                           h.first_face.data(), h.first_edge.data(), h.first_corner.data(), h.corner_vertex.data(),
                           h.corner_edge.data(), h.edge.data(), h.offset.data(), h.inner.data(), hull_place.data(),
                           turned.data(), nullptr},
                          out.contactor_a.data(),
                          out.contactor_b.data(),
                          out.image.data(),
                          out.gap.data(),
                          out.normal.data(),
                          out.point.data(),
                          run.data(),
                          contactors->body.values.data(),
                          position,
                          bodies->velocity.values.data(),
                          bodies->velocity_free.values.data(),
                          step};
  runs_close.make_room(*scratch, runs);
  runs_speed.make_room(*scratch, runs);
  in_slices(runs, [&](std::int64_t first, std::int64_t last) {
    cairn_seam_closing(&given, first, last, runs_close.data(), runs_speed.data());
  });
  if (std::all_of(runs_close.begin(), runs_close.begin() + runs, [](std::int8_t v) { return v == 0; })) return;
  const std::int64_t entries = list_runs(out, runs);
  if (entries == 0) return;
  seam_verdict.make_room(*scratch, entries);
  seam_normal.make_room(*scratch, entries * dim);
  std::fill_n(seam_verdict.begin(), entries, std::int8_t(cairn_seam_stays));
  in_slices(contactors->count, [&](std::int64_t first, std::int64_t last) {
    cairn_seam_contacts(&given, std::int32_t(first), std::int32_t(last), runs_start.data(), runs_of.data(),
                        runs_close.data(), runs_speed.data(), seam_verdict.data(), seam_normal.data());
  });
  if (std::all_of(seam_verdict.begin(), seam_verdict.begin() + entries, [](std::int8_t v) { return v == 0; })) return;
  left.assign(std::size_t(out.count), 0);
  if (!declared.empty()) put_declared_in_order();
  for (std::int64_t e = 0; e < entries; ++e) {
    if (seam_verdict[e] == cairn_seam_stays) continue;
    const std::int32_t r = runs_of[e] / 2;
    if (!declared.empty() && is_declared(out, run[r])) continue;
    if (contactors->body.values[out.contactor_a[run[r]]] < 0 || contactors->body.values[out.contactor_b[run[r]]] < 0)
      continue;
    if (left[std::size_t(run[r])]) continue; // seen from its other body
    for (std::int64_t i = run[r]; i < run[r + 1]; ++i) {
      left[std::size_t(i)] = 2;
      if (seam_verdict[e] == cairn_seam_turned) turn_contact(out, i, runs_of[e] % 2 != 0, &seam_normal[e * dim]);
      const double limit = share(out.contactor_a[i]) + share(out.contactor_b[i]);
      left[std::size_t(i)] |= seam_verdict[e] == cairn_seam_none || !(out.gap[i] <= limit);
    }
  }
  for (std::uint8_t& one : left) one &= 1;
  leave_out(out);
}

} // namespace cairn
