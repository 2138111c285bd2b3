// Curvatures of surfaces at a contact, and the radii by which one rolls on the other: those of the sum of both, along
// the principal directions of that (Johnson 1985, Contact Mechanics, 4.1).
#include "contact_curvature.hpp"

#include <algorithm>
#include <cmath>

#include "../base/vectors.hpp"
#include "../contactors/shapes.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "body_axes.hpp"

namespace cairn {

namespace {

// A contact seen from one of its contactors, in the axes of the body that carries it.
struct CurvatureView {
  double outward[3], t[3], s[3], at[3]; // from the centre of the contactor [m]
  double size;
};

using Surface = SurfaceCurvature;

void add(double curvature, const double along[2], double k[3]) {
  k[0] += curvature * along[0] * along[0];
  k[1] += curvature * along[0] * along[1];
  k[2] += curvature * along[1] * along[1];
}

void make_even(double curvature, Surface& out) { out.k[0] = out.k[2] = curvature; }
void make_corner(Surface& out) { out.sharp = 2; }

// The unit vector across a direction, in the plane across the normal.
void find_across(const CurvatureView& view, const double* along, double across[2]) {
  const double x = dot(along, view.t), y = dot(along, view.s), length = std::hypot(x, y);
  across[0] = length > 0 ? -y / length : 1;
  across[1] = length > 0 ? x / length : 0;
}

// Curved across a direction alone, `along` itself being straight.
void bend_across(const CurvatureView& view, const double* along, double curvature, Surface& out) {
  double across[2];
  find_across(view, along, across);
  add(curvature, across, out.k);
}

void make_edge(const CurvatureView& view, const double* along, Surface& out) {
  out.sharp = 1;
  find_across(view, along, out.across);
}

// Marks a contact point apart from the lowest point of a round body as sharp, since it lies on a rim or a face: an edge
// (1) if it is displaced along the direction `line` in which the surface is straight, a corner (2) otherwise.
void mark_off(const CurvatureView& view, const double lowest[3], const double* line, Surface& out) {
  const double off[3] = {view.at[0] - lowest[0], view.at[1] - lowest[1], view.at[2] - lowest[2]};
  const double x = dot(off, view.t), y = dot(off, view.s), length = std::hypot(x, y);
  if (!(length > 1e-6 * view.size)) return;
  out.sharp = line && std::abs(line[0] * y - line[1] * x) < 1e-3 * length ? 1 : 2;
  for (int i = 0; i < 2 && out.sharp == 1; ++i) out.across[i] = line[i];
}

constexpr double flatness = 1e-7; // of the size: vertices so near are as far out, as hull_flatness has it

// Curvature of bodies with vertices, by the vertices farthest out: a corner, an edge or a face.
void curve_of_vertices(const CurvatureView& view, const double* vertex, int count, int dim, Surface& out) {
  const auto place = [&](int i, double* x) {
    for (int l = 0; l < 3; ++l) x[l] = l < dim ? vertex[dim * i + l] : 0;
  };
  const auto far_out = [&](int i) {
    const double* x = vertex + std::ptrdiff_t(dim) * i;
    return x[0] * view.outward[0] + x[1] * view.outward[1] + (dim == 3 ? x[2] * view.outward[2] : 0);
  };
  int first = 0;
  double most = far_out(0);
  for (int i = 1; i < count; ++i)
    if (const double far = far_out(i); far > most) most = far, first = i;
  double from[3], e[3] = {0, 0, 0}, square = 0;
  place(first, from);
  const auto apart = [&](int i, double* d) {
    place(i, d);
    for (int l = 0; l < 3; ++l) d[l] -= from[l];
    return dot(d, d);
  };
  const auto is_level = [&](int i) { return i != first && most - far_out(i) <= flatness * view.size; };
  for (int i = 0; i < count; ++i) {
    double d[3];
    if (!is_level(i)) continue;
    if (const double far = apart(i, d); far > square) square = far, std::copy_n(d, 3, e);
  }
  if (!(square > 0)) return make_corner(out);
  if (dim == 2) return; // a side
  for (int i = 0; i < count; ++i) {
    double d[3];
    if (!is_level(i)) continue;
    const double way = apart(i, d), along = dot(d, e);
    if (way - along * along / square > flatness * view.size * std::sqrt(square)) return; // a face
  }
  make_edge(view, e, out);
}

// A triangle of a surface: flat along its normal, else an edge, or a corner if the contact is there.
void curve_of_facet(const CurvatureView& view, const double* vertex, const double* normal, Surface& out) {
  double lean = 0, least = 0;
  for (int l = 0; l < 3; ++l) lean += (view.outward[l] - normal[l]) * (view.outward[l] - normal[l]);
  if (lean < 1e-12) return;
  int nearest = -1;
  double edge[3] = {0, 0, 0};
  for (int i = 0; i < 3; ++i) {
    const double *from = vertex + std::ptrdiff_t(3) * i, *to = vertex + std::ptrdiff_t(3) * ((i + 1) % 3);
    double e[3], d[3];
    for (int l = 0; l < 3; ++l) e[l] = to[l] - from[l], d[l] = view.at[l] - from[l];
    const double way = dot(d, d), along = dot(d, e), square = way - along * along / dot(e, e);
    if (way < flatness * flatness * view.size * view.size) return make_corner(out);
    if (nearest >= 0 && square >= least) continue;
    nearest = i;
    least = square;
    std::copy_n(e, 3, edge);
  }
  make_edge(view, edge, out);
}

// The side of a cylinder is straight along its axis, its rim sharp across and round along, its end flat.
void curve_of_cylinder(const CurvatureView& view, const double* axis, double radius, double half, Surface& out) {
  constexpr double flat = 1e-4, upright = 1e-9; // sine, cosine: as convex_contact.f90 has them
  const double high = dot(axis, view.outward);
  double w[3], around[3];
  for (int l = 0; l < 3; ++l) w[l] = view.outward[l] - high * axis[l];
  const double length = std::sqrt(dot(w, w));
  if (length < flat) return;
  if (std::abs(high) <= upright) return bend_across(view, axis, 1 / radius, out);
  cross(axis, w, around);
  make_edge(view, around, out);
  const double along[2] = {dot(around, view.t) / length, dot(around, view.s) / length};
  add(length / radius, along, out.k);
  double lowest[3];
  const double end = std::copysign(half, dot(axis, view.at)); // of a line that leans both ends are listed
  for (int l = 0; l < 3; ++l) lowest[l] = radius / length * w[l] + end * axis[l];
  mark_off(view, lowest, nullptr, out);
}

// A norm of exponent p with its slope and second derivatives, see convex_shape.f90.
struct Bent {
  double norm = 0, slope[2] = {0, 0}, second[3] = {0, 0, 0};
};

Bent bend_norm(double a, double b, double p) {
  Bent out;
  const double large = std::max(a, b), part = std::min(a, b) / large, power = std::pow(part, p);
  const double root = std::pow(1 + power, 1 / p);
  out.norm = large * root;
  out.slope[0] = root / (1 + power);
  const double bent = (p - 1) * out.slope[0] / ((1 + power) * large), rate = power / part;
  out.slope[1] = out.slope[0] * rate;
  out.second[0] = bent * power;
  out.second[1] = -bent * rate;
  out.second[2] = bent * rate / part;
  if (b > a) std::swap(out.slope[0], out.slope[1]), std::swap(out.second[0], out.second[2]);
  return out;
}

// Inverse of the second derivatives of how far it reaches; flat where that is twice what an ellipsoid of the same half
// axes has anywhere: corners stand for its faces there (flat_faces.f90).
void curve_of_superquadric(const CurvatureView& view, const double* shape, Surface& out) {
  constexpr double least = 1e-12, pointed = 0x1p-26;
  double u[3], v[2][3], along[2][2], radii[3];
  for (int l = 0; l < 3; ++l) u[l] = std::abs(shape[l] * view.outward[l]);
  const double most = std::max({u[0], u[1], u[2]});
  for (double& x : u) x = std::max(x, least * most);
  const Bent g = bend_norm(u[0], u[1], 2 / (2 - shape[4])), h = bend_norm(g.norm, u[2], 2 / (2 - shape[3]));
  for (int i = 0; i < 2; ++i) {
    for (int l = 0; l < 3; ++l) v[i][l] = std::copysign(shape[l], view.outward[l]) * (i ? view.s : view.t)[l];
    along[i][0] = g.slope[0] * v[i][0] + g.slope[1] * v[i][1];
    along[i][1] = v[i][2];
  }
  const auto product = [](const double* m, const double* p, const double* q) {
    return m[0] * p[0] * q[0] + m[1] * (p[0] * q[1] + p[1] * q[0]) + m[2] * p[1] * q[1];
  };
  for (int m = 0; m < 3; ++m) {
    const int i = m == 2 ? 1 : 0, j = m == 0 ? 0 : 1;
    radii[m] = h.slope[0] * product(g.second, v[i], v[j]) + product(h.second, along[i], along[j]);
  }
  const double longest = std::max({shape[0], shape[1], shape[2]}), shortest = std::min({shape[0], shape[1], shape[2]});
  double value[2], first[2];
  principal(radii, value, first);
  const double second[2] = {-first[1], first[0]};
  bool flat[2];
  for (int i = 0; i < 2; ++i) {
    flat[i] = !(value[i] < 2 * longest * longest / shortest);
    if (!flat[i]) add(1 / std::max(value[i], pointed * shortest), i ? second : first, out.k);
  }
  const double reached[3] = {g.slope[0] * h.slope[0], g.slope[1] * h.slope[0], h.slope[1]};
  double lowest[3];
  for (int l = 0; l < 3; ++l) lowest[l] = std::copysign(shape[l] * reached[l], view.outward[l]);
  const double middle = 0x1p-7 * shortest;
  const auto is_middle = [&](int l) { return shape[l] * (1 - reached[l]) < middle; };
  out.rocks = (shape[3] < 1 && is_middle(2)) || (shape[4] < 1 && (is_middle(0) || is_middle(1)));
  mark_off(view, lowest, flat[0] != flat[1] ? (flat[0] ? first : second) : nullptr, out);
}

} // namespace

void principal(const double m[3], double value[2], double along[2]) {
  const double middle = (m[0] + m[2]) / 2, half = (m[0] - m[2]) / 2, off = m[1];
  const double apart = std::hypot(half, off);
  value[0] = middle + apart;
  value[1] = middle - apart;
  if (middle > 0 && apart > 0) value[1] = (m[0] * m[2] - off * off) / value[0]; // of one that is sharp: with all digits
  const double angle = apart > 0 ? std::atan2(off, half) / 2 : 0;
  along[0] = std::cos(angle);
  along[1] = std::sin(angle);
}

// Finds the curvature of the surface of A (side 0) or B; false where the shape does not tell.
bool ContactCurvature::surface_at(std::int64_t i, int side, const double axes[3][3], SurfaceCurvature& out) const {
  const Candidates& c = *in_.candidates;
  const std::int32_t contactor = side ? c.contactor_b[i] : c.contactor_a[i], carrier = in_.body(contactor);
  if (carrier < 0) return true; // a side of a mesh is flat
  const auto shape = Shape(*in_.contactors->shape[contactor]);
  const double radius = *in_.contactors->radius[contactor], sense = side ? 1 : -1;
  const int d = in_.dim();
  CurvatureView view{};
  view.size = radius;
  double shift[3] = {0, 0, 0}, n[3] = {0, 0, 0}, direction[3] = {0, 0, 0};
  if (in_.cell->any() && side) image_shift(*in_.cell, c.image[i], shift);
  for (int l = 0; l < d; ++l) {
    n[l] = sense * axes[0][l];
    view.at[l] = c.point[d * i + l] - c.gap[i] / 2 * n[l] - shift[l] - in_.bodies->position[carrier][l];
  }
  to_body_axes(*in_.bodies, d, carrier, n, view.outward);
  to_body_axes(*in_.bodies, d, carrier, axes[1], view.t);
  to_body_axes(*in_.bodies, d, carrier, axes[2], view.s);
  to_body_axes(*in_.bodies, d, carrier, view.at, view.at);
  for (int l = 0; l < d && in_.contactors->offset.active; ++l) view.at[l] -= in_.contactors->offset[contactor][l];
  if (info(shape).directed) std::copy_n(in_.contactors->direction[contactor], d, direction);
  const Hulls& hulls = in_.contactors->hulls;
  const std::int32_t hull = info(shape).is_hull() ? *in_.contactors->hull[contactor] : 0;
  const auto face = [&] { return std::size_t(hulls.first_face[hull]); };
  const auto vertex = [&] { return &hulls.vertex[std::size_t(d * hulls.first_vertex[hull])]; };
  switch (shape) {
  case Shape::disk:
  case Shape::sphere: make_even(1 / radius, out); return true;
  case Shape::ring: make_even(-1 / radius, out); return true;
  case Shape::half_plane:
  case Shape::plane: return true;
  case Shape::segment:
    if (std::abs(direction[0] * view.outward[0] + direction[1] * view.outward[1]) > 1e-6)
      radius > 0 ? make_even(1 / radius, out) : make_corner(out);
    return true;
  case Shape::tube:
    if (std::abs(dot(direction, view.outward)) > 1e-6) return false; // the rim of an open end
    bend_across(view, direction, -1 / radius, out);
    return true;
  case Shape::polygon:
  case Shape::polyhedron: curve_of_vertices(view, vertex(), hulls.vertices(hull), d, out); return true;
  case Shape::facet: curve_of_facet(view, vertex(), &hulls.normal[3 * face()], out); return true;
  case Shape::capsule: {
    const double *axis = &hulls.normal[3 * face()], half = std::abs(dot(axis, vertex() + 3));
    if (std::abs(dot(axis, view.at)) < half * (1 - 1e-9))
      bend_across(view, axis, 1 / hulls.offset[face()], out);
    else
      make_even(1 / hulls.offset[face()], out);
    return true;
  }
  case Shape::cylinder: {
    const double *axis = &hulls.normal[3 * face()], half = std::abs(dot(axis, vertex() + 3));
    curve_of_cylinder(view, axis, hulls.offset[face()], half, out);
    return true;
  }
  case Shape::superquadric: curve_of_superquadric(view, &hulls.offset[face()], out); return true;
  default: return false;
  }
}

SurfacePair ContactCurvature::of(std::int64_t i, const double axes[3][3]) const {
  SurfacePair out;
  for (const std::int32_t contactor : {in_.candidates->contactor_a[i], in_.candidates->contactor_b[i]}) {
    const double radius = *in_.contactors->radius[contactor];
    if (!(radius > 0) || in_.body(contactor) < 0 || !info(Shape(*in_.contactors->shape[contactor])).mover) continue;
    out.size = out.size > 0 ? std::min(out.size, radius) : radius;
  }
  out.known = out.size > 0 && surface_at(i, 0, axes, out.a) && surface_at(i, 1, axes, out.b);
  return out;
}

bool SurfacePair::radii(double p[3]) const {
  constexpr double flat = 0x1p-30; // of the inverse of the size
  std::fill_n(p, 3, 0.0);
  const double sum[3] = {a.k[0] + b.k[0], a.k[1] + b.k[1], a.k[2] + b.k[2]};
  const double *one = a.across, *other = b.across;
  if (a.sharp + b.sharp > 0) {
    if (a.sharp == 2 || b.sharp == 2) return true;
    if (a.sharp && b.sharp && std::abs(one[0] * other[1] - one[1] * other[0]) > 1e-6) return true; // they cross
    const double* across = a.sharp ? one : other;
    const double along[2] = {-across[1], across[0]};
    const double curvature =
        sum[0] * along[0] * along[0] + 2 * sum[1] * along[0] * along[1] + sum[2] * along[1] * along[1];
    if (curvature * size > flat) add(1 / curvature, along, p);
    return curvature * size > -flat;
  }
  double value[2], first[2];
  principal(sum, value, first);
  const double second[2] = {-first[1], first[0]};
  for (int k = 0; k < 2; ++k)
    if (value[k] * size > flat) add(1 / value[k], k ? second : first, p);
  return value[1] * size > -flat;
}

// Effective radius and radii about the axes t and s of a rolling contact, in columns of its geometry. Contacts that are
// round in both directions keep the effective radius.
void ContactCurvature::rolling_radii(const cairn_batch& b, int lane, double* geometry) const {
  const std::int64_t i = system_.candidate[b.first + lane];
  const int n = b.count, d = in_.dim();
  const ShapeInfo& one = info(Shape(*in_.contactors->shape[in_.candidates->contactor_a[i]]));
  const ShapeInfo& other = info(Shape(*in_.contactors->shape[in_.candidates->contactor_b[i]]));
  double axes[3][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  axes_of(b, d, lane, axes);
  const SurfacePair c = of(i, axes);
  const auto meets_even = [&](const ShapeInfo& with, const Surface& surface) {
    return with.ball() || surface.is_flat() || (d == 2 && with.hollow());
  };
  double radii[3] = {geometry[n], 0, geometry[n]};
  if (c.known && !(one.ball() && meets_even(other, c.b)) && !(other.ball() && meets_even(one, c.a))) {
    double p[3], value[2], along[2];
    c.radii(p);
    if (d == 2) {
      geometry[n] = p[0];
    } else {
      principal(p, value, along);
      // what rolls along a direction turns about the one across it
      radii[0] = p[2];
      radii[1] = -p[1];
      radii[2] = p[0];
      geometry[n] = value[1] > 0 ? std::sqrt(value[0] * value[1]) : std::max(value[0], 0.0);
    }
  }
  for (int l = 0; l < 3; ++l) geometry[(3 + l) * n] = radii[l];
}

// Effective radius [m]: that of the ball against flat sides, more in a hollow. Bodies with corners count by the radius
// of their bounding ball, as a size where no ball is there.
double ContactCurvature::effective_radius(std::int64_t i) const {
  const std::int32_t ca = in_.candidates->contactor_a[i], cb = in_.candidates->contactor_b[i];
  const double ra = *in_.contactors->radius[ca], rb = *in_.contactors->radius[cb];
  const ShapeInfo &a = info(Shape(*in_.contactors->shape[ca])), &b = info(Shape(*in_.contactors->shape[cb]));
  if (a.ball() != b.ball()) {
    const double r = a.ball() ? ra : rb, other = a.ball() ? rb : ra;
    if (r > 0) return (a.ball() ? b : a).hollow() && other > r ? r * other / (other - r) : r;
  }
  if (ra > 0 && rb > 0) return ra * rb / (ra + rb);
  if (ra > 0 || rb > 0 || !in_.meshes) return std::max(ra, rb);
  for (const std::int32_t contactor : {ca, cb}) // a node has no size: the size of a cell counts instead
    if (classes_.is_mapped(contactor)) return in_.meshes->meshes[in_.meshes->mesh_of(contactor)].size();
  return 0;
}

} // namespace cairn
