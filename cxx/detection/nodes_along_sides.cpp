// A body with corners under the nodes of a mesh meets the next node in front of its side, where the mesh has sunk into
// it by rounding or by the fall of a step: its side is then nearer than its bottom, and would stop the mesh. So a
// surface permits there only normals between those of the sides around a node.
#include "nodes_along_sides.hpp"

#include <algorithm>
#include <cmath>

#include "../base/vectors.hpp"
#include "edge_limits.hpp"

namespace cairn::detection {

namespace {

constexpr double nearly_flat = 0.25; // sine to the mean normal up to which sides around a node are no valley
constexpr double shallow = 1.0 / 16; // of a side: deeper nodes are pushed to where they are nearest

} // namespace

// visit(way, length, normal) for the edges of the sides of a node that begin at it: unit vector, length [m], normal of
// the side, whose places are along each axis.
template <class Visit>
void NodesAlongSides::each_way(std::int32_t node, Visit&& visit) const {
  const auto k = std::size_t(scene_.mapped->place[std::size_t(node)]);
  const double* x = &scene_.centre[std::int64_t(scene_.dim) * node];
  for (std::int64_t s = scene_.mapped->sides_start[k]; s < scene_.mapped->sides_start[k + 1]; ++s) {
    const std::int64_t side = scene_.mapped->sides[std::size_t(s)];
    const double *at = &scene_.centre[scene_.dim * side], *e = &scene_.direction[(scene_.dim + 1) * side];
    if (scene_.dim == 2) { // the body on its left; the bar is inside it
      const double t = (x[0] - at[0]) * e[0] + (x[1] - at[1]) * e[1], sign = t > 0 ? -1 : 1;
      const double way[2] = {sign * e[0], sign * e[1]}, normal[2] = {e[1], -e[0]};
      visit(way, 2 * e[2], normal);
      continue;
    }
    const double* v = scene_.turned.data() + scene_.hull_place[side]; // places along each axis, its own three first
    const std::int64_t vertices = scene_.contactors->hulls.vertices(scene_.contactors->hull.values[side]);
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
}

// True if a contact of a node would push it along a side of its own, on a surface without a valley there.
bool NodesAlongSides::points_along_a_side(const Candidates& out, std::int64_t i, bool first) const {
  const std::int32_t node = (first ? out.contactor_a : out.contactor_b)[i];
  double outward[3] = {0, 0, 0}, mean[3] = {0, 0, 0}, most = -1, longest = 0, valley = 0;
  for (int c = 0; c < scene_.dim; ++c) outward[c] = (first ? -1 : 1) * out.normal[scene_.dim * i + c];
  each_way(node, [&](const double* way, double length, const double* normal) {
    const double part = dot(outward, way, scene_.dim);
    if (part > most) most = part, longest = length;
    for (int c = 0; c < scene_.dim; ++c) mean[c] += normal[c];
  });
  if (!(most > along_it) || -out.gap[i] > shallow * longest) return false;
  const double size = std::sqrt(dot(mean, mean, scene_.dim));
  each_way(node,
           [&](const double* way, double, const double*) { valley = std::max(valley, dot(mean, way, scene_.dim)); });
  return size > 0 && valley <= nearly_flat * size;
}

void NodesAlongSides::drop(DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out,
                           std::vector<HeldNode>& met) {
  met.clear();
  if (!scene_.mapped || scene_.mapped->sides.empty() || scene_.for_bonds || out.count == 0) return;
  bool any = false;
  dropped.begin(out);
  joined_.clear(); // to other sides than these, too
  for (const DeclaredPair& pair : declared.pairs) joined_.insert(joined_.end(), pair.begin(), pair.end());
  std::sort(joined_.begin(), joined_.end());
  const auto is_joined = [&](std::int64_t id) { return std::binary_search(joined_.begin(), joined_.end(), id); };
  for (std::int64_t i = 0; i < out.count; ++i)
    for (const bool first : {true, false}) {
      const std::int32_t node = (first ? out.contactor_a : out.contactor_b)[i];
      const std::int32_t other = (first ? out.contactor_b : out.contactor_a)[i];
      if (!scene_.shape(node).ball() || !scene_.is_node_with_sides(node) || !scene_.shape(other).bounded) continue;
      if (scene_.same_mesh(node, other)) continue; // self-contact keeps its nodes
      if (is_joined(scene_.contactors->id.values[node]) || !points_along_a_side(out, i, first)) continue;
      dropped[i] = 1, any = true;
      if (first && sides_.count(other) > 0) met.push_back(met_node(out, scene_.dim, i));
    }
  if (!any) return;
  dropped.spare(declared, scene_, out);
  dropped.remove(out, scene_.dim);
}

} // namespace cairn::detection
