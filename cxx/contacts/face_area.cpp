// Area of the face between two bodies with sides, its part for each contact point, and the radius of round ends.
#include "contact_areas.hpp"

#include <algorithm>
#include <cmath>

#include "../base/vectors.hpp"
#include "../contactors/shape_surface.hpp"
#include "../contactors/shapes.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "body_axes.hpp"
#include "face_overlap.hpp"

namespace cairn {

// Radius at the contact of bodies with round ends: that of an equally curved ball [m], 0 where no side is round, or one
// is flat or sharp there.
double ContactAreas::cap_radius(std::int64_t i) const {
  const Candidates& c = *in_.candidates;
  double radius[2] = {0, 0};
  bool round = false, hollow = false;
  double wide = 0;
  for (int side = 0; side < 2; ++side) {
    const std::int32_t contactor = side ? c.contactor_b[i] : c.contactor_a[i];
    if (info(Shape(*in_.contactors->shape[contactor])).hollow())
      hollow = true, wide = *in_.contactors->radius[contactor];
    const ShapeSurface& surface = surface_of(Shape(*in_.contactors->shape[contactor]));
    if (!surface.round_end) continue;
    double normal[3];
    to_body_axes(*in_.bodies, 3, in_.body(contactor), &c.normal[3 * i], normal);
    radius[side] = surface.round_end(data_of(*in_.contactors, contactor), normal);
    if (!(radius[side] > 0)) return 0;
    round = true;
  }
  if (!round) return 0;
  const double one = std::max(radius[0], radius[1]), other = std::min(radius[0], radius[1]);
  if (other > 0) return one * other / (one + other);
  return hollow && wide > one ? one * wide / (wide - one) : one;
}

// The part of the face of a pair that a point stands for. Detection keeps four of the corners of a face, and those on a
// surface triangle by triangle, so that the faces themselves are asked where they lie flat on each other.
double ContactAreas::face_area(std::int64_t i) const {
  const Candidates& c = *in_.candidates;
  const std::int32_t ca = c.contactor_a[i], cb = c.contactor_b[i];
  const bool surface = info(Shape(*in_.contactors->shape[cb])).facet();
  const double* normal = &c.normal[3 * i];
  const auto of_same_face = [&](std::int64_t j) {
    if (c.contactor_b[j] == cb) return !surface || dot(&c.normal[3 * j], normal) > flat_faces;
    return surface && in_.body(c.contactor_b[j]) == in_.body(cb) &&
           *in_.contactors->material[c.contactor_b[j]] == *in_.contactors->material[cb] &&
           dot(&c.normal[3 * j], normal) > flat_faces;
  };
  const auto may_be = [&](std::int64_t j) { // of the same pair, or of the same body and triangles of a surface
    return j >= 0 && j < c.count && c.contactor_a[j] == ca && c.image[j] == c.image[i] &&
           (c.contactor_b[j] == cb || (surface && info(Shape(*in_.contactors->shape[c.contactor_b[j]])).facet()));
  };
  std::int64_t first = i;
  while (may_be(first - 1)) --first;
  double point[3 * most_face_points];
  int count = 0;
  for (std::int64_t j = first; may_be(j) && count < most_face_points; ++j)
    if (of_same_face(j)) std::copy_n(&c.point[3 * j], 3, point + 3 * count++);
  const double spanned = area_of_points(point, count, normal);
  if (!(spanned > 0) || anchors_.is_anchored(i)) return spanned / count; // the law knows what an old bond began with
  const double whole = shared_face(i);
  return (whole > 0 && std::abs(whole - spanned) > area_rounding * whole ? whole : spanned) / count;
}

// Area that the faces of both bodies of a contact share [m2], all triangles of a surface taken together; 0 where they
// do not lie flat on each other.
double ContactAreas::shared_face(std::int64_t i) const {
  const Candidates& c = *in_.candidates;
  const std::int32_t ca = c.contactor_a[i], cb = c.contactor_b[i];
  thread_local FaceOutline one, other; // assembly asks in every step
  double shift[3] = {0, 0, 0};
  if (in_.cell->any()) image_shift(*in_.cell, c.image[i], shift);
  const double unshifted[3] = {0, 0, 0};
  const FaceView view{&c.normal[3 * i], &c.point[3 * i], *in_.contactors->radius[ca], c.gap[i]};
  if (!see_face(in_, view, ca, -1, unshifted, one) || !see_face(in_, view, cb, 1, shift, other)) return 0;
  double sum = shared_area(one, other);
  if (!info(Shape(*in_.contactors->shape[cb])).facet()) return sum;
  const double whole = one.area(); // triangles with numbers near its own are near it: they are asked first
  const double size = *in_.contactors->radius[ca];
  double at[3];
  for (int k = 0; k < 3; ++k) at[k] = c.point[3 * i + k] - shift[k] - in_.bodies->position[in_.body(cb)][k];
  to_body_axes(*in_.bodies, 3, in_.body(cb), at, at);
  const auto is_near = [&](std::int64_t k) { // most of a large surface is not
    const double *x = in_.contactors->offset[k], from[3] = {x[0] - at[0], x[1] - at[1], x[2] - at[2]};
    const double reach = *in_.contactors->radius[k] + 2 * size;
    return dot(from, from) <= reach * reach;
  };
  const auto add = [&](std::int64_t k) {
    if (is_near(k) && *in_.contactors->material[k] == *in_.contactors->material[cb] &&
        see_face(in_, view, std::int32_t(k), 1, shift, other))
      sum += shared_area(one, other);
  };
  const auto is_next = [&](std::int64_t k) {
    return k >= 0 && k < in_.contactors->count && in_.body(std::int32_t(k)) == in_.body(cb) &&
           info(Shape(*in_.contactors->shape[k])).facet();
  };
  bool more = in_.contactors->offset.active;
  for (std::int64_t step = 1; more && sum < whole * (1 - area_rounding); ++step) {
    more = false;
    for (const std::int64_t k : {cb - step, cb + step})
      if (is_next(k)) add(k), more = true;
  }
  return sum;
}

// Outline of the face of a contactor that looks along sense times a normal, projected across it; false where no face
// lies flat there.
bool see_face(const AssemblyInput& in, const FaceView& from, std::int32_t contactor, int sense, const double* shift,
              FaceOutline& face) {
  const ShapeSurface& surface = surface_of(Shape(*in.contactors->shape[contactor]));
  face.clear();
  if (!surface.face) return false;
  const std::int32_t carrier = in.body(contactor);
  FaceSight view;
  view.size = from.size;
  view.gap = from.gap;
  double* const n = view.normal;
  double* const t = view.tangents[0];
  tangent_of(from.normal, t);
  to_body_axes(*in.bodies, 3, carrier, from.normal, n);
  to_body_axes(*in.bodies, 3, carrier, t, t);
  cross(n, t, view.tangents[1]);
  for (int k = 0; k < 3; ++k) view.centre[k] = in.bodies->position[carrier][k] + shift[k] - from.point[k];
  to_body_axes(*in.bodies, 3, carrier, view.centre, view.centre);
  for (int k = 0; k < 3 && in.contactors->offset.active; ++k) view.centre[k] += in.contactors->offset[contactor][k];
  return surface.face(data_of(*in.contactors, contactor), view, sense, face);
}

} // namespace cairn
