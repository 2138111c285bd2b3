// Contactors that no rigid body carries: they are mapped from nodes of deformable bodies, and stand where these are.
#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

#include "../bodies/body.hpp"
#include "contactor.hpp"

namespace cairn {

struct MappedContactors {
  std::vector<std::int32_t> contactor; // internal numbers, rising
  std::vector<double> centre;          // (dim, n) [m]
  std::vector<double> direction;       // (dim, n) of edges, unit, in space; zero of others
  std::vector<double> half_length;     // of edges as their nodes stand; 0 of others [m]
  // Of edges: the contactors of the edge that ends where this one begins, and of the one that begins where it ends, -1:
  // none.
  std::vector<std::int32_t> before, after;
  // Of nodes, by place in `contactor`: the contactors of the edges or facets of their mesh that have them. Empty where
  // no mesh has both.
  std::vector<std::int64_t> sides_start;
  std::vector<std::int32_t> sides;
  std::vector<double> hair; // of nodes and points: how far past the rim of a flat side they stay on it [m]; 0 of sides
  // Of nodes, by place in `contactor`: nodes of the scene that they have cells with; where all nodes are (dim, nodes).
  std::vector<std::int64_t> beside_start;
  std::vector<std::int32_t> beside;
  const double* node_position = nullptr;
  std::vector<std::int32_t> place; // of all contactors in `contactor`, -1: a rigid body carries it
  std::int32_t bodies = 0;         // contactors.body goes down to -bodies
  // Of bodies that touch themselves: their sides are carried by bodies of their own, as far as pairs are sought, with
  // numbers from `bodies` on; how far behind a side a point of the same body is no longer in contact with it [m]. Sides
  // that each contactor is next to, rising, by its place in `contactor`.
  std::vector<std::int32_t> apart, apart_carrier, near;
  std::vector<std::int64_t> near_start;
  std::vector<double> apart_depth; // of each of `contactor`, 0 of those that are not apart
  std::int32_t carriers() const { return bodies + (apart_carrier.empty() ? 0 : apart_carrier.back() + 1 - bodies); }
  bool are_near(std::int32_t a, std::int32_t b) const {
    const auto of = [&](std::int32_t point, std::int32_t side) {
      const std::int32_t k = place[std::size_t(point)];
      return k >= 0 && std::binary_search(near.begin() + near_start[std::size_t(k)],
                                          near.begin() + near_start[std::size_t(k) + 1], side);
    };
    return of(a, b) || of(b, a);
  }
};

// Number by which users know what carries a contactor: a rigid body, or a part of a deformable one.
inline std::int64_t carrier_id(const Bodies& bodies, const Contactors& contactors, std::int64_t contactor) {
  const std::int32_t body = contactors.body.values[contactor];
  return body < 0 ? contactors.part.values[contactor] : bodies.id.values[body];
}

} // namespace cairn
