#include "flat_sides.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/vectors.hpp"

namespace cairn::detection {

int FlatSides::count(std::int32_t c) const {
  const ShapeInfo& shape = scene_.shape(c);
  if (shape.bar()) return scene_.mapped->place[std::size_t(c)] >= 0 ? 1 : 0; // others have round ends
  if (shape.facet()) return 1;
  return shape.corners() ? scene_.contactors->hulls.faces(scene_.contactors->hull.values[c]) : 0;
}

// An edge of a mesh in the plane, whose bar lies inside the body by its thickness.
void FlatSides::view_edge(std::int32_t c, FlatSide& s) const {
  const double* e = &scene_.direction[3 * std::int64_t(c)];
  const auto k = std::size_t(scene_.mapped->place[std::size_t(c)]);
  s.normal[0] = e[1], s.normal[1] = -e[0];
  s.offset = scene_.contactors->radius.values[c];
  for (const int way : {-1, 1}) {
    const std::int32_t next = way < 0 ? scene_.mapped->before[k] : scene_.mapped->after[k];
    bool rim = next < 0;
    if (!rim) {
      const double* f = &scene_.direction[3 * std::int64_t(next)];
      rim = dot(e, f, 2) < alike && way * (e[0] * f[1] - e[1] * f[0]) > 0;
    }
    s.corner.push_back(
        {{way * e[2] * e[0] + s.offset * s.normal[0], way * e[2] * e[1] + s.offset * s.normal[1], 0}, rim});
  }
}

// A triangle of a surface: its edges, and the vertex beyond each, if there is one.
void FlatSides::view_facet(std::int32_t c, FlatSide& s) const {
  const Hulls& h = scene_.contactors->hulls;
  const std::int32_t* edge = &h.edge[4 * std::size_t(h.first_edge[scene_.contactors->hull.values[c]])];
  for (int k = 0; k < 3; ++k) {
    const std::int32_t beyond = edge[4 * k + 3];
    FlatSide::Corner corner{};
    scene_.vertex_of(c, k, corner.x);
    corner.rim = beyond == 0;
    if (beyond > 0) {
      double e[3] = {0, 0, 0}, w[3] = {0, 0, 0}, next[3];
      scene_.vertex_of(c, (k + 1) % 3, e);
      scene_.vertex_of(c, beyond - 1, w);
      for (int i = 0; i < 3; ++i) e[i] -= corner.x[i], w[i] -= corner.x[i];
      cross(w, e, next);
      corner.rim = dot(s.normal, w, 3) < 0 && dot(s.normal, next, 3) < alike * std::sqrt(dot(next, next, 3));
    }
    s.corner.push_back(corner);
  }
}

// A side of a polygon, or a face of a polyhedron.
void FlatSides::view_face(std::int32_t c, int face, FlatSide& s) const {
  const Hulls& h = scene_.contactors->hulls;
  const std::int32_t hull = scene_.contactors->hull.values[c];
  double other[3] = {0, 0, 0};
  FlatSide::Corner corner{};
  const auto put = [&](int vertex, int beside) {
    scene_.normal_of(c, beside, other);
    scene_.vertex_of(c, vertex, corner.x);
    corner.rim = dot(s.normal, other, scene_.dim) < alike;
    s.corner.push_back(corner);
  };
  if (scene_.dim == 2) {
    const int sides = h.faces(hull), end = (face + 1) % sides;
    put(face, (face + sides - 1) % sides);
    put(end, end);
    return;
  }
  const std::int32_t at = h.first_face[hull] + face;
  for (std::int32_t k = h.first_corner[at]; k < h.first_corner[at + 1]; ++k) {
    const std::int32_t* edge = &h.edge[4 * std::size_t(h.first_edge[hull] + h.corner_edge[k] - 1)];
    put(h.corner_vertex[k] - 1, (edge[2] == face + 1 ? edge[3] : edge[2]) - 1);
  }
}

void FlatSides::view(std::int32_t c, int face, FlatSide& s) const {
  s.corner.clear();
  if (scene_.shape(c).bar()) return view_edge(c, s);
  scene_.normal_of(c, face, s.normal);
  if (scene_.shape(c).facet())
    view_facet(c, s);
  else
    view_face(c, face, s);
  s.offset = dot(s.normal, s.corner.front().x, scene_.dim);
}

double FlatSides::beyond(const FlatSide& s, const double* x, bool& rim, double* way) const {
  const double height = dot(s.normal, x, scene_.dim) - s.offset;
  double foot[3] = {0, 0, 0}, least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < scene_.dim; ++k) foot[k] = x[k] - height * s.normal[k];
  bool inside = true;
  rim = false;
  const std::size_t n = s.corner.size();
  const auto take = [&](const double* d, bool at_rim) {
    const double square = dot(d, d, scene_.dim);
    if (square > least || (square == least && !at_rim)) return;
    least = square;
    rim = at_rim;
    std::copy_n(d, scene_.dim, way);
  };
  for (std::size_t i = 0; i < n; ++i) {
    const FlatSide::Corner &from = s.corner[i], &to = s.corner[(i + 1) % n];
    double e[3] = {0, 0, 0}, w[3] = {0, 0, 0}, out[3];
    for (int k = 0; k < scene_.dim; ++k) e[k] = to.x[k] - from.x[k], w[k] = foot[k] - from.x[k];
    const double along = dot(w, e, scene_.dim) / dot(e, e, scene_.dim);
    if (scene_.dim == 2) {
      if (along >= 0) continue;
      inside = false;
      take(w, from.rim);
      continue;
    }
    cross(e, s.normal, out);
    if (dot(out, w, 3) <= 0) continue;
    inside = false;
    const double t = std::clamp(along, 0.0, 1.0);
    for (int k = 0; k < 3; ++k) w[k] -= t * e[k];
    // at a corner one of its two edges is enough
    take(w, from.rim || (along < 0 && s.corner[(i + n - 1) % n].rim) || (along > 1 && to.rim));
  }
  const double distance = inside ? 0 : std::sqrt(least);
  for (int k = 0; k < scene_.dim && distance > 0; ++k) way[k] /= distance;
  return distance;
}

} // namespace cairn::detection
