// The share of a rank: a simulation of the bodies that it owns, of ghosts, and of bodies that are everywhere.
#pragma once
#include <memory>
#include <vector>

#include "../simulation/simulation.hpp"
#include "exchange.hpp"

namespace cairn {

struct Part {
  int rank = 0;
  std::unique_ptr<Simulation> simulation;
  Strategy* strategy = nullptr;      // its own
  std::vector<std::int32_t> bodies;  // internal numbers in the whole, rising: local body i is bodies[i]
  std::vector<std::uint8_t> own;     // (bodies)
  std::vector<std::int32_t> owner;   // (bodies) rank
  std::vector<std::uint8_t> fixed;   // (bodies) 1: contacts do not move it
  std::vector<double> position_then; // (dim, bodies) when bodies were given to ranks [m]
  bool has_joints = false;           // all that there are
  Array<double> velocity;            // (3 | 6, bodies) at the end of the step, as contacts leave it
};

// Part of the bodies of `whole`, which are named by internal numbers, with a strategy of the same settings.
Part make_part(const Simulation& whole, const Strategy& model, int rank, std::vector<std::int32_t> bodies);
// State, loads and drives of bodies of the whole to those of the part.
void bring(const Simulation& whole, Part& part);
// State of the bodies that the part owns to the whole.
void take(const Part& part, Simulation& whole);
// The same over processes: what take() would read, as bytes, and back.
void pack_own(const Part& part, Packer& packer);
void take_packed(const Bytes& bytes, Simulation& whole);

} // namespace cairn
