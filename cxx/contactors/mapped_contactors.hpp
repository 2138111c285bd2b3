// Contactors that no rigid body carries: they are mapped from nodes of deformable bodies, and stand where these are.
#pragma once
#include <cstdint>
#include <vector>

#include "../bodies/body.hpp"
#include "contactor.hpp"

namespace cairn {

struct MappedContactors {
  std::vector<std::int32_t> contactor; // internal numbers, rising
  std::vector<double> centre;          // (dim, n) [m]
  std::vector<double> direction;       // (dim, n) of edges, unit, in space; zero of others
  std::int32_t bodies = 0;             // contactors.body goes down to -bodies
};

// Number by which users know what carries a contactor: a rigid body, or a part of a deformable one.
inline std::int64_t carrier_id(const Bodies& bodies, const Contactors& contactors, std::int64_t contactor) {
  const std::int32_t body = contactors.body.values[contactor];
  return body < 0 ? contactors.part.values[contactor] : bodies.id.values[body];
}

} // namespace cairn
