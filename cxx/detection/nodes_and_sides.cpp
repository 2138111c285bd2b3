// Surfaces of meshes that bodies with corners slide over. Such a body meets the next edge of a row, or the next node,
// in front of its side, where it has sunk into them by rounding or by a step's fall, less than what it reaches over
// them: its side is then nearer than its bottom, and would be stopped by it. What a surface allows there are normals
// between those of the sides around a node alone, as on surfaces of triangles (polyhedron_facet.f90). And a node whose
// sides are there, too, is met by these.
#include <algorithm>
#include <cmath>

#include "../base/cell.hpp"
#include "detection_workspace.hpp"

namespace cairn {

using namespace detection;

namespace {

constexpr double along = 0.5;        // cosine to a side from which on a normal points along it
constexpr double in_a_row = 0.75;    // cosine between edges that go on from each other
constexpr double on_end = 1e-9;      // of an edge: what lies so near to its end lies over it
constexpr double nearly_flat = 0.25; // sine to the mean normal up to which sides around a node are no valley
constexpr double shallow = 1.0 / 16; // of a side: deeper nodes are pushed to where they are nearest

double dot(int dim, const double* x, const double* y) {
  double sum = 0;
  for (int k = 0; k < dim; ++k) sum += x[k] * y[k];
  return sum;
}

} // namespace

bool InteractionHandler::Workspace::is_node_with_sides(std::int32_t contactor) const {
  const std::int32_t place = mapped->place[std::size_t(contactor)];
  return place >= 0 && mapped->sides_start[std::size_t(place)] < mapped->sides_start[std::size_t(place) + 1];
}

// Of a body with corners and an edge of a mesh: whether the end of the edge is met along the edge that goes on there.
bool InteractionHandler::Workspace::points_along_the_row(const Candidates& out, std::int64_t i) const {
  const std::int32_t edge = out.contactor_b[i];
  const auto k = std::size_t(mapped->place[std::size_t(edge)]);
  const double* normal = &out.normal[2 * i];
  const double part = dot(2, normal, &direction[3 * std::int64_t(edge)]);
  if (!(std::abs(part) > along)) return false;
  const std::int32_t next = part > 0 ? mapped->after[k] : mapped->before[k];
  return next >= 0 && (part > 0 ? 1 : -1) * dot(2, normal, &direction[3 * std::int64_t(next)]) > along;
}

// Of the same: whether the point of the body is beyond the edge, over the next one in the row, which has a contact.
bool InteractionHandler::Workspace::is_beyond_its_edge(const Candidates& out, std::int64_t i) const {
  const std::int32_t body = out.contactor_a[i], edge = out.contactor_b[i];
  const auto k = std::size_t(mapped->place[std::size_t(edge)]);
  const double *e = &direction[3 * std::int64_t(edge)], *at = &centre[2 * std::int64_t(edge)];
  double shift[3] = {0, 0, 0}, x[2];
  if (any_periodic) image_shift(*cell, out.image[i], shift);
  for (int c = 0; c < 2; ++c) x[c] = out.point[2 * i + c] + out.gap[i] / 2 * out.normal[2 * i + c] - shift[c] - at[c];
  const double t = dot(2, x, e);
  if (!(std::abs(t) > (1 + on_end) * e[2])) return false;
  const std::int32_t next = t > 0 ? mapped->after[k] : mapped->before[k];
  if (next < 0 || !(dot(2, e, &direction[3 * std::int64_t(next)]) > in_a_row)) return false;
  for (const int way : {-1, 1})
    for (std::int64_t j = i + way; j >= 0 && j < out.count && out.contactor_a[j] == body; j += way)
      if (out.contactor_b[j] == next && out.image[j] == out.image[i] && !left[std::size_t(j)]) return true;
  return false;
}

// Whether what meets a node would push it along a side that it has, on a surface that is no valley there.
bool InteractionHandler::Workspace::points_along_a_side(const Candidates& out, std::int64_t i, bool first) const {
  const std::int32_t node = (first ? out.contactor_a : out.contactor_b)[i];
  const auto k = std::size_t(mapped->place[std::size_t(node)]);
  const double* x = &centre[std::int64_t(dim) * node];
  double outward[3] = {0, 0, 0}, mean[3] = {0, 0, 0}, most = -1, longest = 0, valley = 0;
  for (int c = 0; c < dim; ++c) outward[c] = (first ? -1 : 1) * out.normal[dim * i + c];
  const auto each = [&](const auto& visit) { // ways (dim) along the sides from the node, of unit length, and how long
    for (std::int64_t s = mapped->sides_start[k]; s < mapped->sides_start[k + 1]; ++s) {
      const std::int64_t side = mapped->sides[std::size_t(s)];
      const double *at = &centre[dim * side], *e = &direction[(dim + 1) * side];
      if (dim == 2) { // the body on its left; the bar is inside it
        const double t = (x[0] - at[0]) * e[0] + (x[1] - at[1]) * e[1], sign = t > 0 ? -1 : 1;
        const double way[2] = {sign * e[0], sign * e[1]}, normal[2] = {e[1], -e[0]};
        visit(way, 2 * e[2], normal);
        continue;
      }
      const double* v = turned.data() + hull_place[side]; // places along each axis, its own three first
      const std::int64_t vertices = contactors->hulls.vertices(contactors->hull.values[side]);
      const double* normal = v + 3 * vertices;
      int own = 0;
      double ways[3][3], length[3];
      for (int j = 0; j < 3; ++j) {
        for (int c = 0; c < 3; ++c) ways[j][c] = at[c] + v[vertices * c + j] - x[c];
        length[j] = std::sqrt(dot(3, ways[j], ways[j]));
        if (length[j] < length[own]) own = j;
      }
      for (int j = 0; j < 3; ++j) {
        if (j == own || !(length[j] > 0)) continue;
        for (double& c : ways[j]) c /= length[j];
        visit(ways[j], length[j], normal);
      }
    }
  };
  each([&](const double* way, double length, const double* normal) {
    const double part = dot(dim, outward, way);
    if (part > most) most = part, longest = length;
    for (int c = 0; c < dim; ++c) mean[c] += normal[c];
  });
  if (!(most > along) || -out.gap[i] > shallow * longest) return false;
  const double size = std::sqrt(dot(dim, mean, mean));
  each([&](const double* way, double, const double*) { valley = std::max(valley, dot(dim, mean, way)); });
  return size > 0 && valley <= nearly_flat * size;
}

void InteractionHandler::Workspace::leave_to_sides(Candidates& out) {
  if (!mapped || out.count == 0) return;
  const auto shape = [&](std::int32_t c) { return Shape(contactors->shape.values[c]); };
  const auto is_edge = [&](std::int64_t i) {
    return dim == 2 && mapped->place[std::size_t(out.contactor_b[i])] >= 0 &&
           shape(out.contactor_b[i]) == Shape::segment;
  };
  const bool nodes = !mapped->sides.empty();
  left.assign(std::size_t(out.count), 0);
  bool any = false;
  const auto leave = [&](std::int64_t i) { left[std::size_t(i)] = 1, any = true; };
  for (std::int64_t i = 0; i < out.count && dim == 2; ++i)
    if (is_edge(i) && shape(out.contactor_a[i]) == Shape::polygon && points_along_the_row(out, i)) leave(i);
  for (std::int64_t i = 0; i < out.count && dim == 2; ++i)
    if (is_edge(i) && shape(out.contactor_a[i]) == Shape::polygon && !left[std::size_t(i)] &&
        is_beyond_its_edge(out, i))
      leave(i);
  for (std::int64_t i = 0; i < out.count && nodes; ++i)
    for (const bool first : {true, false}) {
      const std::int32_t node = (first ? out.contactor_a : out.contactor_b)[i];
      const std::int32_t other = (first ? out.contactor_b : out.contactor_a)[i];
      if (!info(shape(node)).ball() || !is_node_with_sides(node) || !info(shape(other)).bounded) continue;
      if (same_mesh(node, other)) continue; // what folds slides on itself by its own nodes
      if (points_along_a_side(out, i, first)) leave(i);
    }
  if (any && !declared.empty()) {
    put_declared_in_order();
    for (std::int64_t i = 0; i < out.count; ++i)
      if (left[std::size_t(i)] && is_declared(out, i)) left[std::size_t(i)] = 0;
  }
  if (any) leave_out(out);
}

} // namespace cairn
