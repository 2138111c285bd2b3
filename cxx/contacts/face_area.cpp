// Area of the face between two bodies with sides, its part for each contact point, and the radius of round ends.
#include "contact_areas.hpp"

#include <algorithm>
#include <cmath>

#include "../base/vectors.hpp"
#include "../contactors/shapes.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "body_axes.hpp"
#include "face_overlap.hpp"

namespace cairn {

// Radius at the contact of a capsule or an ellipsoid: that of an equally curved ball [m], 0 where neither side has a
// round end. Other superquadrics are flat or sharp where their box has sides and edges.
double ContactAreas::cap_radius(std::int64_t i) const {
  const Candidates& c = *in_.candidates;
  double radius[2] = {0, 0};
  bool round = false, hollow = false;
  double wide = 0;
  for (int side = 0; side < 2; ++side) {
    const std::int32_t contactor = side ? c.contactor_b[i] : c.contactor_a[i];
    const auto shape = Shape(*in_.contactors->shape[contactor]);
    if (info(shape).hollow()) hollow = true, wide = *in_.contactors->radius[contactor];
    if (shape != Shape::capsule && shape != Shape::superquadric) continue;
    const Hulls& hulls = in_.contactors->hulls;
    const double* size = &hulls.offset[std::size_t(hulls.first_face[*in_.contactors->hull[contactor]])];
    radius[side] = *size;
    round = true;
    if (shape == Shape::capsule) continue;
    if (size[3] != 1 || size[4] != 1) return 0;
    double normal[3], square = 0;
    to_body_axes(*in_.bodies, 3, in_.body(contactor), &c.normal[3 * i], normal);
    for (int k = 0; k < 3; ++k) square += size[k] * size[k] * normal[k] * normal[k];
    radius[side] = size[0] * size[1] * size[2] / square; // of Gauss's curvature
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
  const bool surface = Shape(*in_.contactors->shape[cb]) == Shape::facet;
  const double* normal = &c.normal[3 * i];
  const auto of_same_face = [&](std::int64_t j) {
    if (c.contactor_b[j] == cb) return !surface || dot(&c.normal[3 * j], normal) > flat_faces;
    return surface && in_.body(c.contactor_b[j]) == in_.body(cb) &&
           *in_.contactors->material[c.contactor_b[j]] == *in_.contactors->material[cb] &&
           dot(&c.normal[3 * j], normal) > flat_faces;
  };
  const auto may_be = [&](std::int64_t j) { // of the same pair, or of the same body and triangles of a surface
    return j >= 0 && j < c.count && c.contactor_a[j] == ca && c.image[j] == c.image[i] &&
           (c.contactor_b[j] == cb || (surface && Shape(*in_.contactors->shape[c.contactor_b[j]]) == Shape::facet));
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
  if (Shape(*in_.contactors->shape[cb]) != Shape::facet) return sum;
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
           Shape(*in_.contactors->shape[k]) == Shape::facet;
  };
  bool more = in_.contactors->offset.active;
  for (std::int64_t step = 1; more && sum < whole * (1 - area_rounding); ++step) {
    more = false;
    for (const std::int64_t k : {cb - step, cb + step})
      if (is_next(k)) add(k), more = true;
  }
  return sum;
}

namespace {

// The plane across the normal of a contact, from its point, in the axes of a body.
struct SeenFrom {
  double normal[3], tangents[2][3], centre[3]; // of the contactor
  std::array<double, 3> place(const double* vertex) const {
    return {centre[0] + vertex[0], centre[1] + vertex[1], centre[2] + vertex[2]};
  }
  std::array<double, 2> corner(const double* vertex) const {
    const auto x = place(vertex);
    return {dot(tangents[0], x.data()), dot(tangents[1], x.data())};
  }
};

// The face of a polyhedron that looks along sense times the normal.
bool see_polyhedron(const Hulls& hulls, std::int32_t hull, const SeenFrom& view, int sense, FaceOutline& face) {
  const double* vertex = &hulls.vertex[3 * std::size_t(hulls.first_vertex[hull])];
  double best = 0;
  std::int32_t which = -1;
  for (std::int32_t f = hulls.first_face[hull]; f < hulls.first_face[hull + 1]; ++f)
    if (const double look = sense * dot(&hulls.normal[3 * std::size_t(f)], view.normal); look > best)
      best = look, which = f;
  if (!(best > flat_faces)) return false;
  for (std::int32_t k = hulls.first_corner[which]; k < hulls.first_corner[which + 1]; ++k)
    face.corner.push_back(view.corner(vertex + 3 * (std::ptrdiff_t(hulls.corner_vertex[k]) - 1)));
  const std::ptrdiff_t first = hulls.corner_vertex[hulls.first_corner[which]] - 1;
  face.height = dot(view.normal, view.place(vertex + 3 * first).data());
  face.turn_left();
  return true;
}

} // namespace

// Outline of the face of a contactor that looks along sense times a normal, projected across it; false where no face
// lies flat there.
bool see_face(const AssemblyInput& in, const FaceView& from, std::int32_t contactor, int sense, const double* shift,
              FaceOutline& face) {
  const Hulls& hulls = in.contactors->hulls;
  const auto shape = Shape(*in.contactors->shape[contactor]);
  face.clear();
  face.endless = shape == Shape::plane;
  if (face.endless) return true;
  if (shape != Shape::polyhedron && shape != Shape::facet && shape != Shape::cylinder) return false;
  const std::int32_t carrier = in.body(contactor), hull = *in.contactors->hull[contactor];
  SeenFrom view;
  double* const n = view.normal;
  double* const t = view.tangents[0];
  tangent_of(from.normal, t);
  to_body_axes(*in.bodies, 3, carrier, from.normal, n);
  to_body_axes(*in.bodies, 3, carrier, t, t);
  cross(n, t, view.tangents[1]);
  for (int k = 0; k < 3; ++k) view.centre[k] = in.bodies->position[carrier][k] + shift[k] - from.point[k];
  to_body_axes(*in.bodies, 3, carrier, view.centre, view.centre);
  for (int k = 0; k < 3 && in.contactors->offset.active; ++k) view.centre[k] += in.contactors->offset[contactor][k];
  if (shape == Shape::polyhedron) return see_polyhedron(hulls, hull, view, sense, face);
  const double* vertex = &hulls.vertex[3 * std::size_t(hulls.first_vertex[hull])];
  const double* m = &hulls.normal[3 * std::size_t(hulls.first_face[hull])];
  const double along = sense * dot(m, n);
  if (shape == Shape::cylinder) { // its vertices are the ends of its axis
    if (!(std::abs(along) > flat_faces)) return false;
    face.centre = view.corner(vertex + (along > 0 ? 3 : 0));
    face.radius = hulls.offset[std::size_t(hulls.first_face[hull])];
    face.height = dot(n, view.place(vertex + (along > 0 ? 3 : 0)).data());
    return true;
  }
  if (!(along > flat_faces)) return false;
  if (std::abs(dot(m, view.place(vertex).data())) > as_high * from.size + std::abs(from.gap)) return false;
  for (int k = 0; k < 3; ++k) face.corner.push_back(view.corner(vertex + 3 * std::ptrdiff_t(k)));
  face.turn_left();
  return true;
}

} // namespace cairn
