// What the searches of mortars keep between contacts, so that a step allocates nothing once it has gone on for a while.
#pragma once
#include <cstdint>
#include <vector>

#include "mesh_set.hpp"
#include "mortar_pair.hpp"
#include "mortar_surface.hpp"

namespace cairn {

struct MortarSegment { // of a side, from low to high of its length, on which it faces a side of another mesh
  double low, high;
  std::int32_t side;
  double eta_low, eta_high; // where that is on the other one
};

struct MeshSet::MetMortar {      // a node that asks, and a side of another mesh that detection saw it in front of
  std::int32_t own, other, node; // meshes, node of the first
  std::int32_t piece, edge, feature, image; // of the other; its contactor, and the candidate's
  double gap;
};

struct MortarWork {
  std::vector<std::int32_t> seeds, seen, nodes;
  std::vector<MortarSegment> segments;
  std::vector<double> weights;
  std::vector<MortarSurface> surfaces;              // of each mesh
  std::vector<std::vector<std::int32_t>> contactor; // of each node of each mesh, -1: none
  std::vector<MeshSet::MetMortar> met;
  struct Covered {
    std::int32_t whole;
    std::int64_t seen; // the nearest of what was seen of its nodes
  };
  std::vector<std::uint8_t> added; // of each whole side
  std::vector<Covered> covered;    // those with a part in common
  std::vector<std::int32_t> front; // pieces of the other mesh in front of these
  std::vector<std::size_t> front_start;
  MortarPair pair;
};

// Candidate i in the place of `to`, which is not behind it.
void keep_candidate(Candidates& c, std::int64_t& to, std::int64_t i, int dim);

} // namespace cairn
