#include <algorithm>
#include <cmath>

#include "../curved_surfaces.hpp"

namespace cairn {

namespace {

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
bool curve_of_superquadric(const ShapeData& data, const CurvatureView& view, SurfaceCurvature& out) {
  const double* shape = data.offset();
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
  surface::principal(radii, value, first);
  const double second[2] = {-first[1], first[0]};
  bool flat[2];
  for (int i = 0; i < 2; ++i) {
    flat[i] = !(value[i] < 2 * longest * longest / shortest);
    if (!flat[i]) surface::add(1 / std::max(value[i], pointed * shortest), i ? second : first, out.k);
  }
  const double reached[3] = {g.slope[0] * h.slope[0], g.slope[1] * h.slope[0], h.slope[1]};
  double lowest[3];
  for (int l = 0; l < 3; ++l) lowest[l] = std::copysign(shape[l] * reached[l], view.outward[l]);
  const double middle = 0x1p-7 * shortest;
  const auto is_middle = [&](int l) { return shape[l] * (1 - reached[l]) < middle; };
  out.rocks = (shape[3] < 1 && is_middle(2)) || (shape[4] < 1 && (is_middle(0) || is_middle(1)));
  surface::mark_off(view, lowest, flat[0] != flat[1] ? (flat[0] ? first : second) : nullptr, out);
  return true;
}

// Of an ellipsoid, by its Gaussian curvature; others are flat or sharp where their box has sides and edges.
double end_of_superquadric(const ShapeData& shape, const double* normal) {
  const double* size = shape.offset();
  if (size[3] != 1 || size[4] != 1) return 0;
  double square = 0;
  for (int k = 0; k < 3; ++k) square += size[k] * size[k] * normal[k] * normal[k];
  return size[0] * size[1] * size[2] / square;
}

} // namespace

extern const ShapeSurface surface_of_superquadric{curve_of_superquadric, nullptr, end_of_superquadric};

} // namespace cairn
