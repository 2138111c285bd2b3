// A body with corners that slides over a mesh meets the next edge of a row in front of its side, where it has sunk into
// the row by rounding or by the fall of a step, by less than its overlap along it: its side is then nearer than its
// bottom, and would be stopped. So a surface permits there only normals between those of the sides around a node, like
// surfaces of triangles (polyhedron_facet.f90).
#include "corners_on_edges.hpp"

#include <algorithm>
#include <cmath>

#include "../base/vectors.hpp"
#include "edge_limits.hpp"

namespace cairn::detection {

namespace {

constexpr double level = 8e-4; // share of a side within which the side of a body is flush with it

} // namespace

// True if a body with corners meets the end of an edge along the edge that continues there.
bool CornersOnEdges::points_along_the_row(const Candidates& out, std::int64_t i) const {
  const std::int32_t edge = out.contactor_b[i];
  const auto k = std::size_t(scene_.mapped->place[std::size_t(edge)]);
  const double* normal = &out.normal[2 * i];
  const double part = dot(normal, &scene_.direction[3 * std::int64_t(edge)], 2);
  if (!(std::abs(part) > along_it)) return false;
  const std::int32_t next = part > 0 ? scene_.mapped->after[k] : scene_.mapped->before[k];
  return next >= 0 && (part > 0 ? 1 : -1) * dot(normal, &scene_.direction[3 * std::int64_t(next)], 2) > along_it;
}

// True if the contact point of such a body is beyond the edge, over the next edge in the row, which has a contact.
bool CornersOnEdges::is_beyond_its_edge(const Candidates& out, std::int64_t i, const DroppedContacts& dropped) const {
  const std::int32_t body = out.contactor_a[i], edge = out.contactor_b[i];
  const auto k = std::size_t(scene_.mapped->place[std::size_t(edge)]);
  const double *e = &scene_.direction[3 * std::int64_t(edge)], *at = &scene_.centre[2 * std::int64_t(edge)];
  double shift[3] = {0, 0, 0}, x[2];
  if (scene_.any_periodic) image_shift(*scene_.cell, out.image[i], shift);
  for (int c = 0; c < 2; ++c) x[c] = out.point[2 * i + c] + out.gap[i] / 2 * out.normal[2 * i + c] - shift[c] - at[c];
  const double t = dot(x, e, 2);
  if (!(std::abs(t) > (1 + on_end) * e[2])) return false;
  const std::int32_t next = t > 0 ? scene_.mapped->after[k] : scene_.mapped->before[k];
  if (next < 0 || !(dot(e, &scene_.direction[3 * std::int64_t(next)], 2) > nearly_one)) return false;
  for (const int way : {-1, 1})
    for (std::int64_t j = i + way; j >= 0 && j < out.count && out.contactor_a[j] == body; j += way)
      if (out.contactor_b[j] == next && out.image[j] == out.image[i] && !dropped[j]) return true;
  return false;
}

// True if a side of the body lies in the plane through the corner with this normal of the mesh, which it faces.
bool CornersOnEdges::is_flush(std::int32_t body, const double* corner, const double* normal, double slack) const {
  double other[2], v[2];
  for (int side = 0; side < scene_.contactors->hulls.faces(scene_.contactors->hull.values[body]); ++side) {
    scene_.normal_of(body, side, other);
    if (dot(other, normal, 2) > -nearly_one) continue;
    scene_.vertex_of(body, side, v);
    if (std::abs(dot(other, corner, 2) - dot(other, v, 2)) <= slack) return true;
  }
  return false;
}

// True if a body with corners does not meet the round end of an edge's bar, where a row of edges ends or turns by a
// corner of the mesh, which itself has no round end: if the body is beyond the end with a side flush with the edge or
// the next one, like the next body of a floor under a sliding mesh, or if it lies on the edge around the corner. Other
// contacts there get the gap of the corner of the mesh.
bool CornersOnEdges::is_past_its_end(Candidates& out, std::int64_t i, const DroppedContacts& dropped) const {
  const std::int32_t body = out.contactor_a[i], edge = out.contactor_b[i];
  const double* e = &scene_.direction[3 * std::int64_t(edge)];
  const double looks[2] = {e[1], -e[0]}, radius = scene_.contactors->radius.values[edge], slack = level * 2 * e[2];
  const double* normal = &out.normal[2 * i];
  const double across = dot(normal, looks, 2), part = dot(normal, e, 2);
  double x[3] = {0, 0, 0}, met[2], corner[2];
  scene_.from_centre(body, edge, out.image[i], x);
  for (int c = 0; c < 2; ++c) // the point of the body, from the centre of the edge
    met[c] = x[c] + out.point[2 * i + c] - scene_.centre[2 * std::int64_t(body) + c] + out.gap[i] / 2 * normal[c];
  const bool flat = across >= 1 - on_end;
  const int way = (flat ? dot(met, e, 2) : part) > 0 ? 1 : -1;
  for (int c = 0; c < 2; ++c) corner[c] = way * e[2] * e[c] + radius * looks[c] - x[c];
  const double past = way * dot(met, e, 2) - e[2];
  const auto k = std::size_t(scene_.mapped->place[std::size_t(edge)]);
  const std::int32_t next = way > 0 ? scene_.mapped->after[k] : scene_.mapped->before[k];
  if (next >= 0) {
    const double* f = &scene_.direction[3 * std::int64_t(next)];
    const double next_looks[2] = {f[1], -f[0]};
    if (!(dot(e, f, 2) < nearly_one) || !(way * (e[0] * f[1] - e[1] * f[0]) > 0)) return false;
    if (past >= -slack && dot(normal, next_looks, 2) < nearly_one && is_flush(body, corner, next_looks, slack))
      return true;
    for (const int to_it : {-1, 1})
      for (std::int64_t j = i + to_it; j >= 0 && j < out.count && out.contactor_a[j] == body; j += to_it)
        if (out.contactor_b[j] == next && out.image[j] == out.image[i] && !dropped[j] && way * part > along_it &&
            dot(normal, &out.normal[2 * j], 2) > nearly_one)
          return true;
  }
  if (flat) return false;
  if (past >= (across > nearly_one ? slack : -slack) && is_flush(body, corner, looks, slack)) return true;
  const double round = radius * (1 - std::max(across, 0.0));
  out.gap[i] += round;
  for (int c = 0; c < 2; ++c) out.point[2 * i + c] -= round / 2 * normal[c];
  return false;
}

void CornersOnEdges::drop(DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out) const {
  if (scene_.dim != 2 || !scene_.mapped || scene_.for_bonds || out.count == 0) return;
  bool any = false;
  dropped.begin(out);
  const auto each = [&](auto&& leaves) {
    for (std::int64_t i = 0; i < out.count; ++i) {
      const std::int32_t edge = out.contactor_b[i];
      if (scene_.mapped->place[std::size_t(edge)] < 0 || !scene_.shape(edge).bar()) continue;
      if (!scene_.shape(out.contactor_a[i]).corners() || dropped[i] || !leaves(i)) continue;
      dropped[i] = 1, any = true;
    }
  };
  each([&](std::int64_t i) { return points_along_the_row(out, i); });
  each([&](std::int64_t i) { return is_beyond_its_edge(out, i, dropped); });
  each([&](std::int64_t i) { return is_past_its_end(out, i, dropped); });
  if (!any) return;
  dropped.spare(declared, scene_, out);
  dropped.remove(out, scene_.dim);
}

} // namespace cairn::detection
