// Unknowns of a network, one of each rigid body and each node of a mesh, by the order of the scene.
#pragma once
#include <cstdint>
#include <vector>

#include "network_input.hpp"

namespace cairn {

class Simulation;

struct NetworkUnknowns {
  std::int64_t order = -1;            // of the scene; -1: number them anew
  std::vector<std::int32_t> material; // -1: none, as of nodes, and of marks of joints in the world
  std::vector<double> capacity, mass; // lumped capacity of nodes, mass of rigid bodies; infinite: a reservoir
  std::vector<std::vector<std::int32_t>> source_body; // of each source
  std::vector<std::int32_t> fixed_a, fixed_b;         // ends of the branches that are given

  // Numbers them when the order of the scene changed; materials that the scene has got since are added to the input.
  void place(const Simulation& s, NetworkInput& in);
  std::int64_t bytes() const;
};

// Values of a source at the unknowns of its bodies, -1: none: those held, marked in `held`, or flows added to `flow`.
// An electrode gives its flow at the first of its bodies.
void take_source(const NetworkSource& from, const std::vector<std::int32_t>& body, std::uint8_t* held, double* value,
                 double* flow);

} // namespace cairn
