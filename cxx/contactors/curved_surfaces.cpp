#include "curved_surfaces.hpp"

#include <algorithm>
#include <cmath>

#include "../base/vectors.hpp"

namespace cairn::surface {

namespace {

// The unit vector across a direction, in the plane across the normal.
void find_across(const CurvatureView& view, const double* along, double across[2]) {
  const double x = dot(along, view.t), y = dot(along, view.s), length = std::hypot(x, y);
  across[0] = length > 0 ? -y / length : 1;
  across[1] = length > 0 ? x / length : 0;
}

} // namespace

void add(double curvature, const double along[2], double k[3]) {
  k[0] += curvature * along[0] * along[0];
  k[1] += curvature * along[0] * along[1];
  k[2] += curvature * along[1] * along[1];
}

void make_even(double curvature, SurfaceCurvature& out) { out.k[0] = out.k[2] = curvature; }
void make_corner(SurfaceCurvature& out) { out.sharp = 2; }

void bend_across(const CurvatureView& view, const double* along, double curvature, SurfaceCurvature& out) {
  double across[2];
  find_across(view, along, across);
  add(curvature, across, out.k);
}

void make_edge(const CurvatureView& view, const double* along, SurfaceCurvature& out) {
  out.sharp = 1;
  find_across(view, along, out.across);
}

void mark_off(const CurvatureView& view, const double lowest[3], const double* line, SurfaceCurvature& out) {
  const double off[3] = {view.at[0] - lowest[0], view.at[1] - lowest[1], view.at[2] - lowest[2]};
  const double x = dot(off, view.t), y = dot(off, view.s), length = std::hypot(x, y);
  if (!(length > 1e-6 * view.size)) return;
  out.sharp = line && std::abs(line[0] * y - line[1] * x) < 1e-3 * length ? 1 : 2;
  for (int i = 0; i < 2 && out.sharp == 1; ++i) out.across[i] = line[i];
}

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

bool ball(const ShapeData& shape, const CurvatureView&, SurfaceCurvature& out) {
  make_even(1 / shape.radius, out);
  return true;
}

bool half_space(const ShapeData&, const CurvatureView&, SurfaceCurvature&) { return true; }

bool corners(const ShapeData& shape, const CurvatureView& view, SurfaceCurvature& out) {
  const double* vertex = shape.vertex();
  const int count = shape.hulls->vertices(shape.hull), dim = shape.dim;
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
  if (!(square > 0)) {
    make_corner(out);
    return true;
  }
  if (dim == 2) return true; // a side
  for (int i = 0; i < count; ++i) {
    double d[3];
    if (!is_level(i)) continue;
    const double way = apart(i, d), along = dot(d, e);
    if (way - along * along / square > flatness * view.size * std::sqrt(square)) return true; // a face
  }
  make_edge(view, e, out);
  return true;
}

} // namespace cairn::surface
