#include "hull_shapes.hpp"

#include <algorithm>
#include <cmath>

#include "../base/call.hpp"

namespace cairn {
namespace {

constexpr double rounding = 1 + 1e-14; // a ball that holds a shape may not miss it by a rounding

// The largest u s + v t with s^(1/e) + t^(1/e) = 1.
double joined(double u, double v, double e) {
  if (e >= 1) return std::max(u, v);
  const double power = 1 / (1 - e), high = std::max(u, v);
  return high * std::pow(std::pow(u / high, power) + std::pow(v / high, power), 1 - e);
}

// The farthest point of a superquadric from its centre: of x^2 within a norm of exponent 2/e, that of x within 2/(2 e).
double farthest(const double* s) {
  return std::sqrt(joined(joined(s[0] * s[0], s[1] * s[1], s[4]), s[2] * s[2], s[3])) * rounding;
}

struct RoundBatch {
  std::vector<double> vertex, plane, ball;
  std::vector<std::int64_t> first_vertex{0}, first_face{0};
  void close() {
    first_vertex.push_back(std::int64_t(vertex.size()) / 3);
    first_face.push_back(std::int64_t(plane.size()) / 4);
  }
};

void add_axial(RoundBatch& out, double radius, double length, bool flat) {
  for (const double z : {-length / 2, length / 2}) out.vertex.insert(out.vertex.end(), {0, 0, z});
  out.plane.insert(out.plane.end(), {0, 0, 1, radius});
  out.ball.push_back((flat ? std::hypot(length / 2, radius) : length / 2 + radius) * rounding);
  out.close();
}

void add_superquadric(RoundBatch& out, const double* s) {
  for (int x = -1; x < 2; x += 2)
    for (int y = -1; y < 2; y += 2)
      for (int z = -1; z < 2; z += 2) out.vertex.insert(out.vertex.end(), {x * s[0], y * s[1], z * s[2]});
  for (int k = 0; k < 5; ++k)
    out.plane.insert(out.plane.end(), {k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0, s[k]});
  out.ball.push_back(farthest(s));
  out.close();
}

} // namespace

std::int32_t add_round_hulls(Hulls& hulls, const std::string& shape, std::int64_t n, const double* sizes) {
  const bool super = shape == "superquadric";
  if (!super && shape != "capsule" && shape != "cylinder")
    throw Error("'" + shape + "' is no round hull; give capsule, cylinder or superquadric");
  const int numbers = super ? 5 : 2;
  RoundBatch out;
  for (std::int64_t i = 0; i < n; ++i) {
    const double* s = sizes + numbers * i;
    for (int k = 0; k < numbers; ++k) {
      const bool exponent = k > 2, may_be_0 = shape == "capsule" && k == 1;
      const bool right = exponent ? s[k] >= 0.05 && s[k] <= 1.95 : (s[k] > 0 || (may_be_0 && s[k] >= 0));
      if (!right || !std::isfinite(s[k]))
        throw Error("sizes of " + shape + " " + std::to_string(i) + ": number " + std::to_string(k) + " is " +
                    std::to_string(s[k]) + "; give " +
                    (exponent ? "an exponent from 0.05 to 1.95" : "a finite length > 0 [m]"));
    }
    super ? add_superquadric(out, s) : add_axial(out, s[0], s[1], shape == "cylinder");
  }
  HullBatch batch;
  batch.vertex = out.vertex;
  batch.first_vertex = out.first_vertex;
  batch.first_face = out.first_face;
  batch.plane = out.plane;
  batch.ball = out.ball;
  return hulls.add(batch);
}

SurfaceFacets add_facets(Hulls& hulls, std::span<const double> vertex, std::span<const std::int32_t> triangle) {
  const std::int64_t n = std::int64_t(vertex.size()) / 3, m = std::int64_t(triangle.size()) / 3;
  std::vector<std::vector<std::int32_t>> of(static_cast<std::size_t>(n)); // triangles of each vertex
  for (std::int64_t c = 0; c < 3 * m; ++c) {
    if (triangle[c] < 0 || triangle[c] >= n)
      throw Error("triangle " + std::to_string(c / 3) + " names vertex " + std::to_string(triangle[c]) + " of " +
                  std::to_string(n) + "; number vertices from 0");
    of[std::size_t(triangle[c])].push_back(std::int32_t(c / 3));
  }
  SurfaceFacets out;
  out.around_start.push_back(0);
  std::vector<double> x;
  std::vector<std::int64_t> first_vertex{0}, first_face{0}, first_corner{0}, corner;
  for (std::int64_t t = 0; t < m; ++t) {
    const std::int32_t* own = &triangle[3 * t];
    std::vector<std::int32_t> near, used(own, own + 3), others;
    for (int k = 0; k < 3; ++k) near.insert(near.end(), of[own[k]].begin(), of[own[k]].end());
    std::sort(near.begin(), near.end());
    near.erase(std::unique(near.begin(), near.end()), near.end());
    for (const std::int32_t f : near) others.insert(others.end(), &triangle[3 * f], &triangle[3 * f] + 3);
    std::sort(others.begin(), others.end());
    others.erase(std::unique(others.begin(), others.end()), others.end());
    for (const std::int32_t v : others)
      if (std::find(own, own + 3, v) == own + 3) used.push_back(v);
    for (int k = 0; k < 3; ++k)
      out.centre.push_back((vertex[3 * own[0] + k] + vertex[3 * own[1] + k] + vertex[3 * own[2] + k]) / 3);
    for (const std::int32_t v : used)
      for (int k = 0; k < 3; ++k) x.push_back(vertex[3 * v + k] - out.centre[3 * t + k]);
    for (const std::int32_t f : near)
      for (int k = 0; k < 3; ++k) {
        corner.push_back(std::find(used.begin(), used.end(), triangle[3 * f + k]) - used.begin());
        if (k == 2) first_corner.push_back(std::int64_t(corner.size()));
      }
    first_vertex.push_back(std::int64_t(x.size()) / 3);
    first_face.push_back(std::int64_t(first_corner.size()) - 1);
    out.around.insert(out.around.end(), used.begin(), used.end());
    out.around_start.push_back(std::int32_t(out.around.size()));
  }
  HullBatch batch;
  batch.vertex = x;
  batch.first_vertex = first_vertex;
  batch.first_face = first_face;
  batch.first_corner = first_corner;
  batch.corner = corner;
  batch.facets = true;
  out.first = hulls.add(batch);
  return out;
}

} // namespace cairn
