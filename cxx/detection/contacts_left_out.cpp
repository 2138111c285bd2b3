// Contacts that are left to other sides, or to none.
//
// Edges of a mesh in the plane that follow each other along its boundary. Each is a bar with round ends inside the
// body, and the end of one lies under the next: a node that slides over the next edge would meet it at an angle. A
// point beside the one edge and beyond the other is the former's alone, as in space (facet_view.f90). In a valley it is
// beside both; and at a corner that stands out, beyond both, both ends are near.
//
// Surfaces of meshes under sliding bodies with corners. Such a body meets the next edge of a row, or the next node, in
// front of its side, where it has sunk into them by rounding or by the fall of a step, by less than its overlap along
// them: its side is then nearer than its bottom, and would be stopped. So a surface permits there only normals between
// those of the sides around a node, like surfaces of triangles (polyhedron_facet.f90).
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "../base/cell.hpp"
#include "../base/vectors.hpp"
#include "detection_workspace.hpp"

namespace cairn {

using namespace detection;

namespace {

constexpr double over_it = 1 - 5e-5;    // cosine of a contact over a triangle and that triangle
constexpr double on_end = 1e-9;         // of the edges: distance to their common node within which a point lies over it
constexpr double nearly_one = 0.75;     // cosine between edges over whose common node one of them has a point
constexpr double clearly = 16;          // times as deep behind one edge as behind the other
constexpr double straight = 1.0 / 1024; // sine between edges that are in a row as loads bend them, and have no valley
constexpr double along_it = 0.5;        // cosine to a side from which on a normal points along it
constexpr double nearly_flat = 0.25;    // sine to the mean normal up to which sides around a node are no valley
constexpr double level = 8e-4;          // share of a side within which the side of a body is flush with it
constexpr double shallow = 1.0 / 16;    // of a side: deeper nodes are pushed to where they are nearest

} // namespace

InteractionHandler::Workspace::EdgeOwner
InteractionHandler::Workspace::owner_at_corner(std::int32_t first, std::int32_t second, const double* x) const {
  const double *e = &direction[3 * std::int64_t(first)], *f = &direction[3 * std::int64_t(second)];
  const double *at_e = &centre[2 * std::int64_t(first)], *at_f = &centre[2 * std::int64_t(second)];
  double beyond_first = (x[0] - at_e[0]) * e[0] + (x[1] - at_e[1]) * e[1] - e[2];
  double along_second = (x[0] - at_f[0]) * f[0] + (x[1] - at_f[1]) * f[1] + f[2];
  const double slack = on_end * (e[2] + f[2]), cosine = e[0] * f[0] + e[1] * f[1];
  const double sine = e[0] * f[1] - e[1] * f[0];
  const bool in_a_row = cosine > 0 && std::abs(sine) <= straight, turns = cosine < nearly_one;
  if (turns && sine < 0) return EdgeOwner::both;                  // a valley
  if (in_a_row || std::abs(beyond_first - along_second) <= slack) // one of them, by the line between
    beyond_first = along_second = (beyond_first + along_second) / 2;
  // a corner that stands out has both within a hair of it, so that corners that meet do not pass each other
  const double hair = turns ? std::min(contactors->radius.values[first], contactors->radius.values[second]) / 64 : 0;
  const double least = std::min(beyond_first, along_second), most = std::max(beyond_first, along_second);
  if (most <= slack) return !turns || least < -hair ? EdgeOwner::first : EdgeOwner::both;
  if (least > (turns ? -slack : slack)) return most > hair ? EdgeOwner::second : EdgeOwner::both;
  if (beyond_first > 0 || !(sine > 0)) return EdgeOwner::both;
  // behind an edge or both, where the boundary turns away: the nearer edge, if clearly nearer
  const auto depth = [&](std::int32_t edge, const double* at, const double* along) {
    return std::max(contactors->radius.values[edge] - (x[0] - at[0]) * along[1] + (x[1] - at[1]) * along[0], 0.0);
  };
  const double behind_first = depth(first, at_e, e), behind_second = depth(second, at_f, f);
  if (behind_second > std::max(clearly * behind_first, hair)) return EdgeOwner::first;
  if (behind_first > std::max(clearly * behind_second, hair)) return EdgeOwner::second;
  return EdgeOwner::both;
}

std::int32_t InteractionHandler::Workspace::edge_that_has_it(const Candidates& out, std::int64_t i) const {
  const std::int32_t a = out.contactor_a[i], b = out.contactor_b[i];
  if (!info(Shape(contactors->shape.values[a])).ball() || mapped->place[std::size_t(b)] < 0) return b;
  const auto k = std::size_t(mapped->place[std::size_t(b)]);
  double x[2], shift[3] = {0, 0, 0};
  if (any_periodic) image_shift(*cell, out.image[i], shift);
  for (int c = 0; c < 2; ++c) x[c] = centre[2 * std::int64_t(a) + c] - shift[c];
  std::int32_t after = mapped->after[k], before = mapped->before[k];
  // A body with a radius touches several edges around it, and all of them carry it, unless they are in a straight row.
  const auto bent = [&](std::int32_t next) {
    const double *e = &direction[3 * std::int64_t(b)], *f = &direction[3 * std::int64_t(next)];
    return e[0] * f[0] + e[1] * f[1] > nearly_one && std::abs(e[0] * f[1] - e[1] * f[0]) > on_end;
  };
  if (*contactors->radius[a] > 0) {
    if (after >= 0 && bent(after)) after = -1;
    if (before >= 0 && bent(before)) before = -1;
  }
  if (after >= 0 && owner_at_corner(b, after, x) == EdgeOwner::second) return after;
  return before >= 0 && owner_at_corner(before, b, x) == EdgeOwner::first ? before : b;
}

// True if a contact is left to the next edge, which has a contact, too: points of a self-contacting body have none with
// adjacent edges.
bool InteractionHandler::Workspace::is_on_next_edge(const Candidates& out, std::int64_t i) const {
  const std::int32_t owner = edge_that_has_it(out, i);
  if (owner == out.contactor_b[i]) return false;
  for (const int way : {-1, 1})
    for (std::int64_t j = i + way; j >= 0 && j < out.count && out.contactor_a[j] == out.contactor_a[i]; j += way)
      if (out.contactor_b[j] == owner && out.image[j] == out.image[i]) return true;
  return false;
}

void InteractionHandler::Workspace::put_declared_in_order() {
  declared_in_order = declared;
  for (DeclaredPair& pair : declared_in_order) std::sort(pair.begin(), pair.end());
  std::sort(declared_in_order.begin(), declared_in_order.end());
}

bool InteractionHandler::Workspace::is_declared(const Candidates& out, std::int64_t i) const {
  DeclaredPair pair{contactors->id.values[out.contactor_a[i]], contactors->id.values[out.contactor_b[i]]};
  std::sort(pair.begin(), pair.end());
  return std::binary_search(declared_in_order.begin(), declared_in_order.end(), pair);
}

// A pair that is declared goes on with the edge that has the point now, if that looks about the same way.
void InteractionHandler::Workspace::leave_to_next_edges(Candidates& out) {
  if (dim != 2 || !mapped) return;
  left.assign(std::size_t(out.count), 0);
  for (std::int64_t i = 0; i < out.count; ++i) left[std::size_t(i)] = is_on_next_edge(out, i);
  if (std::find(left.begin(), left.end(), 1) == left.end()) return;
  put_declared_in_order();
  const auto goes_on = [&](std::int64_t i, std::int64_t j) {
    const std::int64_t b = out.contactor_b[i], other = out.contactor_b[j];
    if (left[std::size_t(j)] || out.image[j] != out.image[i] || mapped->place[std::size_t(other)] < 0) return false;
    if (carrier[b] != carrier[other] || is_declared(out, j)) return false;
    const double *e = &direction[3 * b], *f = &direction[3 * other];
    return e[0] * f[0] + e[1] * f[1] > 0.5; // as follow_bonds_across_sides
  };
  const auto has_heir = [&](std::int64_t i) {
    for (const int way : {-1, 1})
      for (std::int64_t j = i + way; j >= 0 && j < out.count && out.contactor_a[j] == out.contactor_a[i]; j += way)
        if (goes_on(i, j)) return true;
    return false;
  };
  if (!declared.empty()) {
    held.clear();
    for (std::int64_t i = 0; i < out.count; ++i)
      if (left[std::size_t(i)] && is_declared(out, i) && !has_heir(i)) held.push_back(i);
    for (const std::int64_t i : held) left[std::size_t(i)] = 0;
  }
  leave_out(out);
}

bool InteractionHandler::Workspace::is_node_with_sides(std::int32_t contactor) const {
  const std::int32_t place = mapped->place[std::size_t(contactor)];
  return place >= 0 && mapped->sides_start[std::size_t(place)] < mapped->sides_start[std::size_t(place) + 1];
}

// True if a body with corners meets the end of an edge along the edge that continues there.
bool InteractionHandler::Workspace::points_along_the_row(const Candidates& out, std::int64_t i) const {
  const std::int32_t edge = out.contactor_b[i];
  const auto k = std::size_t(mapped->place[std::size_t(edge)]);
  const double* normal = &out.normal[2 * i];
  const double part = dot(normal, &direction[3 * std::int64_t(edge)], 2);
  if (!(std::abs(part) > along_it)) return false;
  const std::int32_t next = part > 0 ? mapped->after[k] : mapped->before[k];
  return next >= 0 && (part > 0 ? 1 : -1) * dot(normal, &direction[3 * std::int64_t(next)], 2) > along_it;
}

// True if the contact point of such a body is beyond the edge, over the next edge in the row, which has a contact.
bool InteractionHandler::Workspace::is_beyond_its_edge(const Candidates& out, std::int64_t i) const {
  const std::int32_t body = out.contactor_a[i], edge = out.contactor_b[i];
  const auto k = std::size_t(mapped->place[std::size_t(edge)]);
  const double *e = &direction[3 * std::int64_t(edge)], *at = &centre[2 * std::int64_t(edge)];
  double shift[3] = {0, 0, 0}, x[2];
  if (any_periodic) image_shift(*cell, out.image[i], shift);
  for (int c = 0; c < 2; ++c) x[c] = out.point[2 * i + c] + out.gap[i] / 2 * out.normal[2 * i + c] - shift[c] - at[c];
  const double t = dot(x, e, 2);
  if (!(std::abs(t) > (1 + on_end) * e[2])) return false;
  const std::int32_t next = t > 0 ? mapped->after[k] : mapped->before[k];
  if (next < 0 || !(dot(e, &direction[3 * std::int64_t(next)], 2) > nearly_one)) return false;
  for (const int way : {-1, 1})
    for (std::int64_t j = i + way; j >= 0 && j < out.count && out.contactor_a[j] == body; j += way)
      if (out.contactor_b[j] == next && out.image[j] == out.image[i] && !left[std::size_t(j)]) return true;
  return false;
}

// True if a body with corners does not meet the round end of an edge's bar, where a row of edges ends or turns by a
// corner of the mesh, which itself has no round end: if the body is beyond the end with a side flush with the edge or
// the next one, like the next body of a floor under a sliding mesh, or if it lies on the edge around the corner. Other
// contacts there get the gap of the corner of the mesh.
bool InteractionHandler::Workspace::is_past_its_end(Candidates& out, std::int64_t i) const {
  const std::int32_t body = out.contactor_a[i], edge = out.contactor_b[i];
  const double* e = &direction[3 * std::int64_t(edge)];
  const double looks[2] = {e[1], -e[0]}, radius = contactors->radius.values[edge], slack = level * 2 * e[2];
  const double* normal = &out.normal[2 * i];
  const double across = dot(normal, looks, 2), part = dot(normal, e, 2);
  double x[3] = {0, 0, 0}, met[2], corner[2], other[2];
  from_centre(body, edge, out.image[i], x);
  for (int c = 0; c < 2; ++c) // the point of the body, from the centre of the edge
    met[c] = x[c] + out.point[2 * i + c] - centre[2 * std::int64_t(body) + c] + out.gap[i] / 2 * normal[c];
  const bool flat = across >= 1 - on_end;
  const int way = (flat ? dot(met, e, 2) : part) > 0 ? 1 : -1;
  for (int c = 0; c < 2; ++c) corner[c] = way * e[2] * e[c] + radius * looks[c] - x[c];
  const auto is_flush = [&](const double* m) {
    for (int side = 0; side < contactors->hulls.faces(contactors->hull.values[body]); ++side) {
      looks_of(body, side, other);
      if (dot(other, m, 2) > -nearly_one) continue;
      double v[2];
      vertex_of(body, side, v);
      if (std::abs(dot(other, corner, 2) - dot(other, v, 2)) <= slack) return true;
    }
    return false;
  };
  const double past = way * dot(met, e, 2) - e[2];
  const auto k = std::size_t(mapped->place[std::size_t(edge)]);
  const std::int32_t next = way > 0 ? mapped->after[k] : mapped->before[k];
  if (next >= 0) {
    const double* f = &direction[3 * std::int64_t(next)];
    const double next_looks[2] = {f[1], -f[0]};
    if (!(dot(e, f, 2) < nearly_one) || !(way * (e[0] * f[1] - e[1] * f[0]) > 0)) return false;
    if (past >= -slack && dot(normal, next_looks, 2) < nearly_one && is_flush(next_looks)) return true;
    for (const int to_it : {-1, 1})
      for (std::int64_t j = i + to_it; j >= 0 && j < out.count && out.contactor_a[j] == body; j += to_it)
        if (out.contactor_b[j] == next && out.image[j] == out.image[i] && !left[std::size_t(j)] &&
            way * part > along_it && dot(normal, &out.normal[2 * j], 2) > nearly_one)
          return true;
  }
  if (flat) return false;
  if (past >= (across > nearly_one ? slack : -slack) && is_flush(looks)) return true;
  const double round = radius * (1 - std::max(across, 0.0));
  out.gap[i] += round;
  for (int c = 0; c < 2; ++c) out.point[2 * i + c] -= round / 2 * normal[c];
  return false;
}

// True if a contact of a node would push it along a side of its own, on a surface without a valley there.
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
        length[j] = std::sqrt(dot(ways[j], ways[j], 3));
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
    const double part = dot(outward, way, dim);
    if (part > most) most = part, longest = length;
    for (int c = 0; c < dim; ++c) mean[c] += normal[c];
  });
  if (!(most > along_it) || -out.gap[i] > shallow * longest) return false;
  const double size = std::sqrt(dot(mean, mean, dim));
  each([&](const double* way, double, const double*) { valley = std::max(valley, dot(mean, way, dim)); });
  return size > 0 && valley <= nearly_flat * size;
}

void InteractionHandler::Workspace::leave_to_sides(Candidates& out) {
  left_nodes.clear();
  if (!mapped || for_bonds || out.count == 0) return;
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
  for (std::int64_t i = 0; i < out.count && dim == 2; ++i)
    if (is_edge(i) && shape(out.contactor_a[i]) == Shape::polygon && !left[std::size_t(i)] && is_past_its_end(out, i))
      leave(i);
  std::vector<std::int64_t>& joined = held; // contactors, to other sides than these, too
  joined.clear();
  if (nodes)
    for (const DeclaredPair& pair : declared) joined.insert(joined.end(), pair.begin(), pair.end());
  std::sort(joined.begin(), joined.end());
  const auto is_joined = [&](std::int64_t id) { return std::binary_search(joined.begin(), joined.end(), id); };
  for (std::int64_t i = 0; i < out.count && nodes; ++i)
    for (const bool first : {true, false}) {
      const std::int32_t node = (first ? out.contactor_a : out.contactor_b)[i];
      const std::int32_t other = (first ? out.contactor_b : out.contactor_a)[i];
      if (!info(shape(node)).ball() || !is_node_with_sides(node) || !info(shape(other)).bounded) continue;
      if (same_mesh(node, other) || is_joined(contactors->id.values[node])) continue; // self-contact keeps its nodes
      if (!points_along_a_side(out, i, first)) continue;
      leave(i);
      if (first && flat_sides(other) > 0) note_met(out, i, left_nodes.emplace_back());
    }
  if (any && !declared.empty()) {
    put_declared_in_order();
    for (std::int64_t i = 0; i < out.count; ++i)
      if (left[std::size_t(i)] && is_declared(out, i)) left[std::size_t(i)] = 0;
  }
  if (any) leave_out(out);
}

// Declared pairs of a round body or a node and a triangle have a contact wherever they are (sphere_facet.f90). Where
// the point passed to another triangle of the surface, that one goes on with the pair, and the contact here is left
// out; where no other has it, as a hair behind the rim of a surface, it stays.
void InteractionHandler::Workspace::leave_out_spares(Candidates& out) {
  if (declared.empty() || dim != 3 || !contactors->hull.active) return;
  const auto on_facet = [&](std::int64_t i) {
    return Shape(contactors->shape.values[out.contactor_b[i]]) == Shape::facet;
  };
  const auto looks = [&](std::int64_t i) { // its normal stands behind its vertices
    const std::int32_t facet = out.contactor_b[i], hull = contactors->hull.values[facet];
    return turned.data() + hull_place[facet] + 3 * contactors->hulls.vertices(hull);
  };
  const auto alike = [](const double* x, const double* y) { return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]; };
  // one that is declared itself goes on with itself alone
  const auto may_go_on = [&](std::int64_t i, std::int64_t j) {
    return out.feature[j] >= 0 && out.image[j] == out.image[i] && on_facet(j) &&
           carrier[out.contactor_b[j]] == carrier[out.contactor_b[i]] &&
           alike(looks(i), looks(j)) > 0.5; // as follow_bonds_across_sides
  };
  // beyond a rim the triangle beside has a node no more than its own
  const auto is_beyond = [&](std::int64_t j) {
    return !(contactors->radius.values[out.contactor_a[j]] > 0) && !(alike(&out.normal[3 * j], looks(j)) > over_it);
  };
  left.assign(std::size_t(out.count), 0);
  const auto leave_one = [&](std::int64_t i) {
    bool heir = false;
    const auto each_other = [&](auto&& take) {
      for (const int way : {-1, 1})
        for (std::int64_t j = i + way; j >= 0 && j < out.count && out.contactor_a[j] == out.contactor_a[i]; j += way)
          if (may_go_on(i, j)) take(j);
    };
    each_other([&](std::int64_t j) { heir = heir || !is_beyond(j); });
    left[std::size_t(i)] = heir;
    if (!heir) each_other([&](std::int64_t j) { left[std::size_t(j)] = 1; });
  };
  for (std::int64_t i = 0; i < out.count; ++i)
    if (out.feature[i] == cairn_spare) leave_one(i);
  for (std::int64_t i = 0; i < out.count; ++i)
    if (out.feature[i] < 0) out.feature[i] = 0;
  leave_out(out);
}

void InteractionHandler::Workspace::leave_out(Candidates& out) const {
  std::int64_t to = 0;
  for (std::int64_t i = 0; i < out.count; ++i) {
    if (left[std::size_t(i)]) continue;
    if (to != i) move_contacts(i, 1, to, out);
    ++to;
  }
  trim(out, to);
}

} // namespace cairn
