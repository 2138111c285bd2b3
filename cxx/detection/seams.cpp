// Contacts with covered sides of flush bodies are dropped here; core_f90/detection/seams.f90 has the rule. This file
// lists the runs of contacts of each contactor, calls the kernel and applies its verdicts.
#include "seams.hpp"

#include <algorithm>
#include <cmath>

#include "../contactors/shapes.hpp"
#include "cairn/seams.h"
#include "detection_grid.hpp"

namespace cairn::detection {

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

constexpr std::uint8_t seen_once = 2; // mark of a contact beside 1, dropped

} // namespace

void Seams::begin() {
  run_ = {};
  for (auto* array : {&runs_of_, &runs_start_}) *array = {};
  for (auto* array : {&verdict_, &runs_close_, &mark_}) *array = {};
  for (auto* array : {&normal_, &runs_speed_}) *array = {};
}

bool Seams::may_have_seams() const {
  const auto& shape = scene_.contactors->shape.values;
  if (scene_.for_bonds || !(scene_.step > 0)) return false;
  std::int64_t surface = -1; // a triangle of a body; seams of surfaces are with other bodies
  bool several = false;
  for (std::int64_t c = 0; c < scene_.contactors->count; ++c) {
    if (seam_shapes.has_rim(shape[std::size_t(c)])) return true;
    const std::int32_t seen = seam_shapes.seen[shape[std::size_t(c)]];
    if (seen == cairn_seam_half_space) several = true;
    if (seen != cairn_seam_facet || scene_.contactors->body.values[c] < 0) continue;
    several = several || (surface >= 0 && scene_.contactors->body.values[c] != scene_.contactors->body.values[surface]);
    surface = c;
  }
  return surface >= 0 && several;
}

// Finds runs, contacts of a pair with equal normals.
std::int32_t Seams::find_runs(const Candidates& out) {
  run_.make_room(*scene_.scratch, out.count + 1);
  const std::int32_t *first = out.contactor_a.data(), *second = out.contactor_b.data();
  std::int32_t runs = 0;
  for (std::int64_t i = 0; i < out.count; ++i) {
    const bool goes_on = i > 0 && first[i] == first[i - 1] && second[i] == second[i - 1] &&
                         out.image[i] == out.image[i - 1] &&
                         std::equal(&out.normal[i * scene_.dim], &out.normal[i * scene_.dim] + scene_.dim,
                                    &out.normal[(i - 1) * scene_.dim]);
    if (!goes_on) run_[runs++] = i;
  }
  run_[runs] = out.count;
  return runs;
}

// Lists the runs of each contactor that may slide over a seam: a run of it with the rim of another body closes, or is
// pressed on by another run. Returns how many entries there are.
std::int32_t Seams::list_runs(const Candidates& out, std::int32_t runs) {
  constexpr std::int8_t pressed = 1, slides = 2;
  const std::int32_t *first = out.contactor_a.data(), *second = out.contactor_b.data();
  const auto has_rim = [&](std::int32_t c) {
    return seam_shapes.has_rim(scene_.contactors->shape.values[c]) ||
           (seam_shapes.seen[scene_.contactors->shape.values[c]] == cairn_seam_facet &&
            scene_.contactors->body.values[c] >= 0);
  };
  mark_.make_room(*scene_.scratch, scene_.contactors->count);
  runs_start_.make_room(*scene_.scratch, scene_.contactors->count + 1);
  std::fill_n(mark_.begin(), scene_.contactors->count, std::int8_t(0));
  std::fill_n(runs_start_.begin(), scene_.contactors->count + 1, 0);
  for (std::int32_t r = 0; r < runs; ++r)
    if (runs_close_[r] == cairn_seam_by_speed) mark_[first[run_[r]]] = mark_[second[run_[r]]] = pressed;
  for (std::int32_t r = 0; r < runs; ++r) {
    const std::int32_t a = first[run_[r]], b = second[run_[r]];
    if ((runs_close_[r] != 0 || (mark_[a] & pressed)) && has_rim(b)) mark_[a] |= slides;
    if ((runs_close_[r] != 0 || (mark_[b] & pressed)) && has_rim(a)) mark_[b] |= slides;
  }
  for (std::int32_t r = 0; r < runs; ++r)
    for (const std::int32_t c : {first[run_[r]], second[run_[r]]})
      if (mark_[c] & slides) ++runs_start_[c];
  std::int32_t all = 0;
  for (std::int64_t c = 0; c <= scene_.contactors->count; ++c) all += runs_start_[c], runs_start_[c] = all;
  runs_of_.make_room(*scene_.scratch, all);
  for (std::int32_t r = runs - 1; r >= 0; --r) { // runs_start becomes where each begins
    if (mark_[second[run_[r]]] & slides) runs_of_[--runs_start_[second[run_[r]]]] = 2 * r + 1;
    if (mark_[first[run_[r]]] & slides) runs_of_[--runs_start_[first[run_[r]]]] = 2 * r;
  }
  return all;
}

// Replaces the normal of a contact, and recomputes gap and point along the new one, which points to the sliding body.
void Seams::turn_contact(Candidates& out, std::int64_t i, bool of_b, const double* normal) const {
  const double sense = of_b ? -1 : 1;
  const std::int32_t x = of_b ? out.contactor_b[i] : out.contactor_a[i],
                     y = of_b ? out.contactor_a[i] : out.contactor_b[i];
  const bool bar = scene_.shape(y).bar();
  const double layer = bar ? scene_.contactors->radius.values[y] : 0; // of the other body, around its axis
  double *n = &out.normal[i * scene_.dim], *point = &out.point[i * scene_.dim], from[3] = {}, to[3] = {}, shift[3] = {},
         gap = 0;
  for (int c = 0; c < scene_.dim; ++c) { // points of the two bodies
    from[c] = point[c] - sense * (out.gap[i] / 2 + layer) * n[c] + layer * normal[c];
    to[c] = point[c] + sense * out.gap[i] / 2 * n[c];
  }
  if (scene_.shape(x).ball()) {
    if (of_b && scene_.any_periodic) image_shift(*scene_.cell, out.image[i], shift);
    for (int c = 0; c < scene_.dim; ++c)
      to[c] =
          scene_.centre[std::int64_t(x) * scene_.dim + c] + shift[c] - scene_.contactors->radius.values[x] * normal[c];
  }
  for (int c = 0; c < scene_.dim; ++c) gap += normal[c] * (to[c] - from[c]);
  for (int c = 0; c < scene_.dim; ++c) point[c] = to[c] - gap / 2 * normal[c];
  for (int c = 0; c < scene_.dim; ++c) n[c] = sense * normal[c];
  out.gap[i] = gap;
}

// Writes the verdicts on the runs of sliding contactors; false if all contacts stay.
bool Seams::judge(const Candidates& out) {
  const std::int32_t runs = find_runs(out);
  const Hulls& h = scene_.contactors->hulls;
  const bool hulls = scene_.contactors->hull.active;
  const cairn_seams given{scene_.dim,
                          scene_.any_periodic,
                          scene_.contactors->shape.values.data(),
                          seam_shapes.seen,
                          scene_.centre.data(),
                          scene_.contactors->radius.values.data(),
                          scene_.contactors->direction.active ? scene_.direction.data() : nullptr,
                          scene_.cell->vectors,
                          {scene_.dim, 0, 0, 0, hulls ? scene_.contactors->hull.values.data() : nullptr,
                           h.first_vertex.data(), h.first_face.data(), h.first_edge.data(), h.first_corner.data(),
                           h.corner_vertex.data(), h.corner_edge.data(), h.edge.data(), h.offset.data(), h.inner.data(),
                           scene_.hull_place.data(), scene_.turned.data(), nullptr},
                          out.contactor_a.data(),
                          out.contactor_b.data(),
                          out.image.data(),
                          out.gap.data(),
                          out.normal.data(),
                          out.point.data(),
                          run_.data(),
                          scene_.contactors->body.values.data(),
                          scene_.position,
                          scene_.bodies->velocity.values.data(),
                          scene_.bodies->velocity_free.values.data(),
                          scene_.step};
  runs_close_.make_room(*scene_.scratch, runs);
  runs_speed_.make_room(*scene_.scratch, runs);
  in_slices(runs, [&](std::int64_t first, std::int64_t last) {
    cairn_seam_closing(&given, first, last, runs_close_.data(), runs_speed_.data());
  });
  if (std::all_of(runs_close_.begin(), runs_close_.begin() + runs, [](std::int8_t v) { return v == 0; })) return false;
  entries_ = list_runs(out, runs);
  if (entries_ == 0) return false;
  verdict_.make_room(*scene_.scratch, entries_);
  normal_.make_room(*scene_.scratch, entries_ * scene_.dim);
  std::fill_n(verdict_.begin(), entries_, std::int8_t(cairn_seam_stays));
  in_slices(scene_.contactors->count, [&](std::int64_t first, std::int64_t last) {
    cairn_seam_contacts(&given, std::int32_t(first), std::int32_t(last), runs_start_.data(), runs_of_.data(),
                        runs_close_.data(), runs_speed_.data(), verdict_.data(), normal_.data());
  });
  return std::any_of(verdict_.begin(), verdict_.begin() + entries_, [](std::int8_t v) { return v != 0; });
}

void Seams::apply(DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out) {
  dropped.begin(out);
  if (!declared.pairs.empty()) declared.sort();
  const auto& body = scene_.contactors->body.values;
  for (std::int64_t e = 0; e < entries_; ++e) {
    if (verdict_[e] == cairn_seam_stays) continue;
    const std::int32_t r = runs_of_[e] / 2;
    if (!declared.pairs.empty() && declared.has(scene_, out, run_[r])) continue;
    if (body[out.contactor_a[run_[r]]] < 0 || body[out.contactor_b[run_[r]]] < 0) continue;
    if (dropped[run_[r]]) continue; // seen from its other body
    for (std::int64_t i = run_[r]; i < run_[r + 1]; ++i) {
      dropped[i] = seen_once;
      if (verdict_[e] == cairn_seam_turned) turn_contact(out, i, runs_of_[e] % 2 != 0, &normal_[e * scene_.dim]);
      const double limit = scene_.share(out.contactor_a[i]) + scene_.share(out.contactor_b[i]);
      dropped[i] |= verdict_[e] == cairn_seam_none || !(out.gap[i] <= limit);
    }
  }
  for (std::int64_t i = 0; i < out.count; ++i) dropped[i] &= 1;
  dropped.remove(out, scene_.dim);
}

void Seams::drop(DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out) {
  if (may_have_seams() && out.count >= 2 && judge(out)) apply(declared, dropped, out);
}

} // namespace cairn::detection
