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
  // Neighbours of edges: contactors of the edge that ends at an edge's begin, and of the edge that begins at its
  // end, -1: none.
  std::vector<std::int32_t> before, after;
  // Sides at nodes, by place in `contactor`: contactors of the edges or facets of their mesh at the node. Empty where
  // no mesh has both.
  std::vector<std::int64_t> sides_start;
  std::vector<std::int32_t> sides;
  std::vector<double> hair; // of nodes and points: how far past the rim of a flat side they stay on it [m]; 0 of sides
  // Neighbours of nodes, by place in `contactor`: nodes of the scene in the same cells; positions of all nodes (dim,
  // nodes).
  std::vector<std::int64_t> beside_start;
  std::vector<std::int32_t> beside;
  const double* node_position = nullptr;
  std::vector<std::int32_t> place; // of all contactors in `contactor`, -1: a rigid body carries it
  std::int32_t bodies = 0;         // contactors.body goes down to -bodies
  // Self-contact: sides of self-contacting bodies are carried, for the search of pairs, by bodies of their own with
  // numbers from `bodies` on; apart_depth: depth behind a side beyond which a point of the same body is no longer in
  // contact [m]; near: sides adjacent to each contactor, rising, by its place in `contactor`.
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
