#include "nodes_on_sides.hpp"

#include <cmath>

#include "../base/vectors.hpp"

namespace cairn::detection {

namespace {

constexpr double flush = 1e-3; // of how far a node is held past a rim: steps up to a side that are none

} // namespace

HeldNode met_node(const Candidates& out, int dim, std::int64_t i) {
  HeldNode met{out.contactor_a[i], out.contactor_b[i], 0, 0, out.image[i], out.gap[i], {}, {}};
  std::copy_n(&out.normal[dim * i], dim, met.normal);
  return met;
}

// From a node to the sum of the nodes that it has cells with: where its body lies; whether it has any.
bool NodesOnSides::way_inward(std::int32_t node, double* inward) const {
  const auto k = std::size_t(scene_.mapped->place[std::size_t(node)]);
  std::fill_n(inward, 3, 0);
  if (scene_.mapped->beside_start[k] == scene_.mapped->beside_start[k + 1]) return false;
  for (std::int64_t n = scene_.mapped->beside_start[k]; n < scene_.mapped->beside_start[k + 1]; ++n)
    for (int c = 0; c < scene_.dim; ++c)
      inward[c] += scene_.mapped->node_position[std::int64_t(scene_.dim) * scene_.mapped->beside[std::size_t(n)] + c] -
                   scene_.centre[std::int64_t(scene_.dim) * node + c];
  return true;
}

// Moves a contact at the edge or corner between two sides to the side on which the cells of the node lie. Detection
// takes the first of both, or the nearer one, past which the body has come: where the node's cells lie behind that
// side, the nearest side under them is taken.
bool NodesOnSides::lies_on_another(const OrderedPairs& pairs, const HeldNode& met, HeldNode& held) const {
  const std::int32_t node = met.node;
  const double hair = scene_.mapped->hair[std::size_t(scene_.mapped->place[std::size_t(node)])], slack = on_rim * hair;
  if (!(std::abs(met.gap) <= hair)) return false;
  double inward[3], x[3] = {0, 0, 0}, way[3] = {0, 0, 0};
  if (!way_inward(node, inward)) return false;
  const double own = dot(met.normal, inward, scene_.dim);
  const bool behind = own < -slack;
  if (!behind && !(std::abs(met.gap) <= slack)) return false;
  FlatSide& side = seen_side_;
  double most = std::max(own, 0.0) + slack, highest = -hair;
  if (!behind) most = own + slack, highest = -slack;
  bool rim = false, found = false;
  each_pair_of(pairs, node, [&](std::int64_t p, int kind) {
    const std::int32_t b = pairs.b[p], image_of = pairs.image[p] & image_bits;
    if (scene_.carrier[b] != scene_.carrier[met.side] || image_of != met.image || (pairs.image[p] & declared_bit))
      return true;
    scene_.from_centre(node, b, image_of, x);
    for (int face = 0; face < sides_.count(b); ++face) {
      sides_.view(b, face, side);
      const double height = dot(side.normal, x, scene_.dim) - side.offset,
                   facing = dot(side.normal, inward, scene_.dim);
      if (!(height >= highest) || !(height <= (behind ? scene_.share(node) + scene_.share(b) : slack))) continue;
      if (!(dot(side.normal, met.normal, scene_.dim) < alike) || !(facing > most)) continue;
      const double far = sides_.beyond(side, x, rim, way);
      if (!(far <= slack) && !(behind && rim && far < hair && reaches_back(node, side.normal, way, far))) continue;
      (behind ? highest : most) = behind ? height : facing;
      found = true;
      held = {node, b, face, kind, image_of, height, {}, {}};
      std::copy_n(side.normal, 3, held.normal);
      std::copy_n(met.normal, scene_.dim, held.way);
    }
    return true;
  });
  return found;
}

// True if a side of the node's mesh that faces against a normal reaches from the node back over a rim, `far` behind it
// against `way`; for a node without sides: an edge of its cells along the side, where the cells lie on it.
bool NodesOnSides::reaches_back(std::int32_t node, const double* normal, const double* way, double far) const {
  const auto k = std::size_t(scene_.mapped->place[std::size_t(node)]);
  const double* x = &scene_.centre[std::int64_t(scene_.dim) * node];
  if (scene_.mapped->sides.empty() || !scene_.is_node_with_sides(node)) {
    double to[3] = {0, 0, 0};
    if (!way_inward(node, to) || !(dot(to, normal, scene_.dim) > 0)) return false;
    for (std::int64_t n = scene_.mapped->beside_start[k]; n < scene_.mapped->beside_start[k + 1]; ++n) {
      for (int c = 0; c < scene_.dim; ++c)
        to[c] =
            scene_.mapped->node_position[std::int64_t(scene_.dim) * scene_.mapped->beside[std::size_t(n)] + c] - x[c];
      const double height = dot(to, normal, scene_.dim);
      if (dot(to, way, scene_.dim) < -far && height * height <= (1 - alike) * dot(to, to, scene_.dim)) return true;
    }
    return false;
  }
  FlatSide& side = own_side_;
  for (std::int64_t s = scene_.mapped->sides_start[k]; s < scene_.mapped->sides_start[k + 1]; ++s) {
    const std::int32_t own = scene_.mapped->sides[std::size_t(s)];
    sides_.view(own, 0, side);
    if (!(dot(side.normal, normal, scene_.dim) < -unlike_side)) continue;
    for (const FlatSide::Corner& corner : side.corner) {
      double along = 0;
      for (int c = 0; c < scene_.dim; ++c)
        along += (scene_.centre[std::int64_t(scene_.dim) * own + c] + corner.x[c] - x[c]) * way[c];
      if (along < -far) return true;
    }
  }
  return false;
}

// True if a node that lies on side j cannot meet side i: both are of one body, and the cells of the node lie behind i;
// or the body of side i has another side which continues j where the two bodies meet, flush or turning away from it.
bool NodesOnSides::hides(const OrderedPairs& pairs, const Candidates& out, std::int64_t j, std::int64_t i) const {
  const std::int32_t node = out.contactor_a[i], met = out.contactor_b[i], on = out.contactor_b[j];
  const double *normal = &out.normal[scene_.dim * i], *lies = &out.normal[scene_.dim * j];
  const double hair = scene_.mapped->hair[std::size_t(scene_.mapped->place[std::size_t(node)])];
  if (i == j || !(dot(normal, lies, scene_.dim) < alike) || sides_.count(met) == 0 || sides_.count(on) == 0)
    return false;
  if (!(std::abs(out.gap[j]) <= hair)) return false;
  if (scene_.carrier[met] == scene_.carrier[on] && out.image[i] == out.image[j]) {
    double inward[3];
    if (way_inward(node, inward) && std::abs(out.gap[i]) <= hair && dot(normal, inward, scene_.dim) < -on_rim * hair)
      return dot(lies, inward, scene_.dim) > on_rim * hair;
    if (met == on || scene_.shape(met).bar() || scene_.shape(met).facet()) return false; // of one surface
  }
  double x[3] = {0, 0, 0}, at[3] = {0, 0, 0}, way[3] = {0, 0, 0}, height = out.gap[j];
  for (int c = 0; c < scene_.dim; ++c) height -= lies[c] * out.gap[i] * normal[c];
  FlatSide& side = seen_side_;
  bool hidden = false, rim = false;
  each_pair_of(pairs, node, [&](std::int64_t p, int) {
    const std::int32_t b = pairs.b[p];
    if (scene_.carrier[b] != scene_.carrier[met] || (pairs.image[p] & image_bits) != out.image[i]) return true;
    scene_.from_centre(node, b, out.image[i], x);
    for (int c = 0; c < scene_.dim; ++c)
      at[c] = x[c] - out.gap[i] * normal[c] - height * lies[c]; // on the plane of j, above i
    for (int face = 0; face < sides_.count(b) && !hidden; ++face) {
      sides_.view(b, face, side);
      if (!(dot(side.normal, lies, scene_.dim) > alike) || !(sides_.beyond(side, at, rim, way) <= flush * hair))
        continue;
      hidden = dot(side.normal, at, scene_.dim) - side.offset >= -flush * hair;
    }
    return !hidden;
  });
  return hidden;
}

} // namespace cairn::detection
