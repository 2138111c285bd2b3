// Data of contacts that the next step inherits, and by which a run restarts with the same bits.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "../detection/candidates.hpp"
#include "../solvers/refinement_memory.hpp"

namespace cairn {

// Where a bond of bodies with sides, or a joint, holds on to them: points that they carry, from their centres of mass.
struct Anchor {
  double a[3] = {}, shape_a[3] = {}; // of A in its axes, now and as its shape came in [m]
  double b[3] = {}, shape_b[3] = {}; // of B in its axes
  double normal[3] = {};             // in the axes of B
  double turn[4] = {};               // of A against B when a joint, or a bond, was made: a quaternion, in 2D an angle
  double length = 0;                 // between the points of a joint then [m]; of a bond held fast 1
  double siblings = 0;               // anchors that the pair began with
  double reach = -1; // what detection finds nearer than this is the anchored contact itself [m]; below 0: no anchor
};

// Contact data for a bit-identical restart.
struct ContactMemory {
  double h = 0;                           // step that the impulses belong to [s]; 0 before the first
  std::int64_t contactors_seen = 0;       // contactor ids below this one can no longer bond on first sight
  std::vector<std::int64_t> seen_besides; // nor can these, rising: they took the place of others that were seen
  bool has_seen(std::int64_t contactor) const {
    return contactor < contactors_seen || std::binary_search(seen_besides.begin(), seen_besides.end(), contactor);
  }
  int impulse_components = 0, state_components = 0;
  bool joints_came = false;     // since joints were projected, see joint_projection.hpp
  bool gaps_of_bonds = false;   // states of pairs that are held are their gap alone, as files had it once
  std::vector<ContactKey> keys; // contacts with an impulse or a state
  std::vector<double>
      impulses; // (impulse_components, keys) 2D: n, t [, moment]; 3D: x y z in space axes [, moment x y z]
  std::vector<double> states;  // (state_components, keys), vectors in space axes, of anchored ones in those of B
  std::vector<Anchor> anchors; // (keys), empty where no contact is anchored
  RefinementMemory refinement;
  RestMemory rest;
  std::vector<RimSeat> seats; // by ids: nodes of meshes that lie on flat sides, see detection/rims.cpp
  std::vector<double> forces; // (dim, keys) at the end of the step, as impulses; empty where no strategy needs them
};

// State of contacts of laws that have none.
inline constexpr double no_state = std::numeric_limits<double>::max();

// Widens a table of the memory: (has, keys) becomes (wants, keys).
void widen(std::vector<double>& values, int& has, int wants, std::size_t keys, double fill);

} // namespace cairn
