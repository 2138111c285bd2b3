// Scratch of mortar searches, kept between steps so that later steps allocate nothing.
#pragma once
#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "mortar_contacts.hpp"
#include "mortar_pair.hpp"
#include "mortar_surface.hpp"

namespace cairn {

struct MortarBox { // bounding box
  double low[3], high[3];
  std::int32_t index; // a mesh; or a whole side, and -1 less a piece of the other mesh
};

struct MortarContacts::Met {     // a node that asks, and a side of another mesh that detection saw it in front of
  std::int32_t own, other, node; // meshes, node of the first
  std::int32_t piece, edge, feature, image; // of the other; its contactor, and the candidate's
  double gap;
};

// Mortar of one mesh with another, sorted: its whole sides with a common part, sides of the other mesh in front of
// them, and its nodes with a row.
struct MortarContacts::Taken {
  std::int32_t own = -1, other = -1;
  std::vector<std::int32_t> covered, front, nodes;
  void clear(std::int32_t one, std::int32_t two) {
    own = one;
    other = two;
    for (auto* of : {&covered, &front, &nodes}) of->clear();
  }
  void sort() {
    for (auto* of : {&covered, &front, &nodes}) std::sort(of->begin(), of->end());
  }
};

struct MortarWork {
  std::vector<std::int32_t> seeds, nodes;
  std::vector<double> weights;
  std::vector<const MeshBody*> meshes;
  std::vector<MortarSurface> surfaces;                       // of each mesh
  std::vector<std::vector<std::int32_t>> contactor;          // of each node of each mesh, -1: none
  std::vector<std::vector<std::int32_t>> contactor_of_piece; // the first of its sides, of each piece of each mesh
  std::vector<std::vector<std::uint8_t>> asks;               // of each whole side of each mesh
  std::vector<MortarContacts::Met> met;
  std::vector<MortarContacts::Taken> taken; // in the order of meshes; those that count now come first
  std::size_t used = 0;
  std::vector<MortarBox> of_meshes, boxes;
  std::vector<std::int32_t> open_meshes, open; // boxes that sweeps are in
  struct Covered {
    std::int32_t whole;
    std::int64_t seen; // nearest candidate of its nodes
  };
  std::vector<std::uint8_t> added; // of each whole side
  std::vector<Covered> covered;    // those with a part in common
  std::vector<std::int32_t> front; // pieces of the other mesh in front of these
  std::vector<std::size_t> front_start;
  MortarPair pair;
  std::optional<Nodes> shifted; // as a pair sees them across the ends of a periodic cell
};

} // namespace cairn
