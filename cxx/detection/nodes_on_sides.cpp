// A node of a mesh at the edge between two sides of a body, or between two bodies, lies on one side of these.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "../base/cell.hpp"
#include "../base/vectors.hpp"
#include "flat_sides.hpp"

namespace cairn {

using namespace detection;

namespace {

constexpr double flush = 1e-3; // of how far a node is held past a rim: steps up to a side that are none

} // namespace

// From a node to the sum of the nodes that it has cells with: where its body lies; whether it has any.
bool InteractionHandler::Workspace::way_inward(std::int32_t node, double* inward) const {
  const auto k = std::size_t(mapped->place[std::size_t(node)]);
  std::fill_n(inward, 3, 0);
  if (mapped->beside_start[k] == mapped->beside_start[k + 1]) return false;
  for (std::int64_t n = mapped->beside_start[k]; n < mapped->beside_start[k + 1]; ++n)
    for (int c = 0; c < dim; ++c)
      inward[c] += mapped->node_position[std::int64_t(dim) * mapped->beside[std::size_t(n)] + c] -
                   centre[std::int64_t(dim) * node + c];
  return true;
}

// The contact as a record of its node.
void InteractionHandler::Workspace::note_met(const Candidates& out, std::int64_t i, HeldNode& met) const {
  met = {out.contactor_a[i], out.contactor_b[i], 0, 0, out.image[i], out.gap[i], {}, {}};
  std::copy_n(&out.normal[dim * i], dim, met.normal);
}

// Moves a contact at the edge or corner between two sides to the side on which the cells of the node lie. Detection
// takes the first of both, or the nearer one, past which the body has come: where the node's cells lie behind that
// side, the nearest side under them is taken.
bool InteractionHandler::Workspace::lies_on_another(const OrderedPairs& pairs, const HeldNode& met,
                                                    HeldNode& held) const {
  const std::int32_t node = met.node;
  const double hair = mapped->hair[std::size_t(mapped->place[std::size_t(node)])], slack = on_rim * hair;
  if (!(std::abs(met.gap) <= hair)) return false;
  double inward[3], x[3] = {0, 0, 0}, way[3] = {0, 0, 0};
  if (!way_inward(node, inward)) return false;
  const double own = dot(met.normal, inward, dim);
  const bool behind = own < -slack;
  if (!behind && !(std::abs(met.gap) <= slack)) return false;
  FlatSide& side = seen_side;
  double most = std::max(own, 0.0) + slack, highest = -hair;
  if (!behind) most = own + slack, highest = -slack;
  bool rim = false, found = false;
  each_pair_of(pairs, node, [&](std::int64_t p, int kind) {
    const std::int32_t b = pairs.b[p], image_of = pairs.image[p] & image_bits;
    if (carrier[b] != carrier[met.side] || image_of != met.image || (pairs.image[p] & declared_bit)) return true;
    from_centre(node, b, image_of, x);
    for (int face = 0; face < flat_sides(b); ++face) {
      view_side(b, face, side);
      const double height = dot(side.normal, x, dim) - side.offset, facing = dot(side.normal, inward, dim);
      if (!(height >= highest) || !(height <= (behind ? share(node) + share(b) : slack))) continue;
      if (!(dot(side.normal, met.normal, dim) < alike) || !(facing > most)) continue;
      const double far = beyond(side, x, rim, way);
      if (!(far <= slack) && !(behind && rim && far < hair && reaches_back(node, side.normal, way, far))) continue;
      (behind ? highest : most) = behind ? height : facing;
      found = true;
      held = {node, b, face, kind, image_of, height, {}, {}};
      std::copy_n(side.normal, 3, held.normal);
      std::copy_n(met.normal, dim, held.way);
    }
    return true;
  });
  return found;
}

// True if a side of the node's mesh that faces against a normal reaches from the node back over a rim, `far` behind it
// against `way`; for a node without sides: an edge of its cells along the side, where the cells lie on it.
bool InteractionHandler::Workspace::reaches_back(std::int32_t node, const double* normal, const double* way,
                                                 double far) const {
  const auto k = std::size_t(mapped->place[std::size_t(node)]);
  const double* x = &centre[std::int64_t(dim) * node];
  if (mapped->sides.empty() || !is_node_with_sides(node)) {
    double to[3] = {0, 0, 0};
    if (!way_inward(node, to) || !(dot(to, normal, dim) > 0)) return false;
    for (std::int64_t n = mapped->beside_start[k]; n < mapped->beside_start[k + 1]; ++n) {
      for (int c = 0; c < dim; ++c)
        to[c] = mapped->node_position[std::int64_t(dim) * mapped->beside[std::size_t(n)] + c] - x[c];
      const double height = dot(to, normal, dim);
      if (dot(to, way, dim) < -far && height * height <= (1 - alike) * dot(to, to, dim)) return true;
    }
    return false;
  }
  FlatSide& side = own_side;
  for (std::int64_t s = mapped->sides_start[k]; s < mapped->sides_start[k + 1]; ++s) {
    const std::int32_t own = mapped->sides[std::size_t(s)];
    view_side(own, 0, side);
    if (!(dot(side.normal, normal, dim) < -unlike_side)) continue;
    for (const FlatSide::Corner& corner : side.corner) {
      double along = 0;
      for (int c = 0; c < dim; ++c) along += (centre[std::int64_t(dim) * own + c] + corner.x[c] - x[c]) * way[c];
      if (along < -far) return true;
    }
  }
  return false;
}

// Contacts of nodes with sides of a body that others hide, where the node lies on one of these.
void InteractionHandler::Workspace::leave_hidden_sides(const OrderedPairs& pairs, Candidates& out) {
  if (contacts_of_nodes.empty()) index_nodes(out);
  left.assign(std::size_t(out.count), 0);
  bool any = false;
  for (std::size_t from = 0, to = 0; from < contacts_of_nodes.size(); from = to) {
    const std::int32_t node = contacts_of_nodes[from].first;
    for (to = from; to < contacts_of_nodes.size() && contacts_of_nodes[to].first == node; ++to) {}
    for (std::size_t k = from; k < to && to - from > 1; ++k)
      for (std::size_t other = from; other < to; ++other) {
        const std::int64_t i = contacts_of_nodes[k].second, j = contacts_of_nodes[other].second;
        if (left[std::size_t(i)] || left[std::size_t(j)] || !hides(pairs, out, j, i)) continue;
        left[std::size_t(i)] = 1;
        any = true;
      }
  }
  if (!any) return;
  if (!declared.empty()) {
    put_declared_in_order();
    for (std::int64_t i = 0; i < out.count; ++i)
      if (left[std::size_t(i)] && is_declared(out, i)) left[std::size_t(i)] = 0;
  }
  leave_out(out);
}

// True if a node that lies on side j cannot meet side i: both are of one body, and the cells of the node lie behind i;
// or the body of side i has another side which continues j where the two bodies meet, flush or turning away from it.
bool InteractionHandler::Workspace::hides(const OrderedPairs& pairs, const Candidates& out, std::int64_t j,
                                          std::int64_t i) const {
  const std::int32_t node = out.contactor_a[i], met = out.contactor_b[i], on = out.contactor_b[j];
  const double *normal = &out.normal[dim * i], *lies = &out.normal[dim * j];
  const double hair = mapped->hair[std::size_t(mapped->place[std::size_t(node)])];
  if (i == j || !(dot(normal, lies, dim) < alike) || flat_sides(met) == 0 || flat_sides(on) == 0) return false;
  if (!(std::abs(out.gap[j]) <= hair)) return false;
  if (carrier[met] == carrier[on] && out.image[i] == out.image[j]) {
    double inward[3];
    if (way_inward(node, inward) && std::abs(out.gap[i]) <= hair && dot(normal, inward, dim) < -on_rim * hair)
      return dot(lies, inward, dim) > on_rim * hair;
    const auto shape = Shape(contactors->shape.values[met]);
    if (met == on || shape == Shape::segment || shape == Shape::facet) return false; // of one surface
  }
  double x[3] = {0, 0, 0}, at[3] = {0, 0, 0}, way[3] = {0, 0, 0}, height = out.gap[j];
  for (int c = 0; c < dim; ++c) height -= lies[c] * out.gap[i] * normal[c];
  FlatSide& side = seen_side;
  bool hidden = false, rim = false;
  each_pair_of(pairs, node, [&](std::int64_t p, int) {
    const std::int32_t b = pairs.b[p];
    if (carrier[b] != carrier[met] || (pairs.image[p] & image_bits) != out.image[i]) return true;
    from_centre(node, b, out.image[i], x);
    for (int c = 0; c < dim; ++c)
      at[c] = x[c] - out.gap[i] * normal[c] - height * lies[c]; // on the plane of j, above i
    for (int face = 0; face < flat_sides(b) && !hidden; ++face) {
      view_side(b, face, side);
      if (!(dot(side.normal, lies, dim) > alike) || !(beyond(side, at, rim, way) <= flush * hair)) continue;
      hidden = dot(side.normal, at, dim) - side.offset >= -flush * hair;
    }
    return !hidden;
  });
  return hidden;
}

} // namespace cairn
