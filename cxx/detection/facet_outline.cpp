#include "facet_outline.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::detection {

namespace {

// Unit vector in the plane of the triangle (from, to, third), across its edge, away from the third vertex.
void away_from(const double* from, const double* to, const double* third, double* out) {
  double e[3], w[3];
  for (int k = 0; k < 3; ++k) e[k] = to[k] - from[k], w[k] = from[k] - third[k];
  const double share = dot(w, e) / dot(e, e);
  for (int k = 0; k < 3; ++k) w[k] -= share * e[k];
  const double size = std::sqrt(dot(w, w));
  for (int k = 0; k < 3; ++k) out[k] = w[k] / size;
}

} // namespace

FacetOutline::FacetOutline(const Contactors& contactors, std::int32_t facet) {
  const Hulls& hulls = contactors.hulls;
  const auto hull = std::size_t(contactors.hull.values[std::size_t(facet)]);
  const auto face = std::size_t(hulls.first_face[hull]);
  const double* vertex = &hulls.vertex[3 * std::size_t(hulls.first_vertex[hull])];
  const std::int32_t* of_edge = &hulls.edge[4 * std::size_t(hulls.first_edge[hull])]; // see facet_view.f90
  for (int d = 0; d < 3; ++d) centre[d] = contactors.offset.active ? contactors.offset[facet][d] : 0;
  std::copy_n(&hulls.normal[3 * face], 3, normal);
  offset = hulls.offset[face];
  size = hulls.radius[hull];
  for (int k = 0; k < 3; ++k) {
    Edge& e = edge[k];
    const double *from = vertex + 3 * k, *to = vertex + 3 * ((k + 1) % 3), *third = vertex + 3 * ((k + 2) % 3);
    away_from(from, to, third, out[k]);
    end[k] = dot(out[k], from);
    std::fill_n(e.out_next, 3, 0.0);
    e.end_next = 0;
    if (const std::int32_t beyond = of_edge[4 * k + 3]) {
      away_from(from, to, vertex + 3 * (beyond - 1), e.out_next);
      e.end_next = dot(e.out_next, from);
    }
    for (int d = 0; d < 3; ++d) e.along[d] = to[d] - from[d];
    e.length = std::sqrt(dot(e.along, e.along));
    for (double& one : e.along) one /= e.length;
    e.begin = dot(e.along, from);
    e.owned = of_edge[4 * k + 2] != 0;
    e.owns_first = of_edge[4 * (3 + k) + 2] != 0;
  }
}

bool FacetOutline::is_elsewhere(const double x[3], double reach, double slack) const {
  double past[3], along[3];
  for (int k = 0; k < 3; ++k) past[k] = dot(x, out[k]) - end[k];
  if (std::max({past[0], past[1], past[2]}) <= slack) return false; // over the triangle
  for (int k = 0; k < 3; ++k) {
    const Edge& e = edge[k];
    along[k] = dot(x, e.along) - e.begin;
    if (!e.owned || past[k] < -slack || along[k] < -slack || along[k] > e.length + slack) continue;
    if (dot(x, e.out_next) - e.end_next >= -slack) return false; // beyond this edge of both its triangles
  }
  const double height = dot(x, normal) - offset, far = reach + slack;
  for (int k = 0; k < 3; ++k) {
    const Edge &e = edge[k], &before = edge[(k + 2) % 3];
    if (!e.owns_first || along[k] > slack || along[(k + 2) % 3] < before.length - slack) continue;
    const double across = past[k], beside = along[k]; // from the first vertex of the edge
    if (height * height + across * across + beside * beside <= far * far) return false;
  }
  return true;
}

} // namespace cairn::detection
