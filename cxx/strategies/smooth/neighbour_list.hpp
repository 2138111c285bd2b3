// The list of neighbours of smooth DEM, and the order of its pairs, which is that of the sums of forces on bodies.
#pragma once
#include <algorithm>
#include <cstdint>
#include <functional>
#include <vector>

#include "../../base/cell.hpp"
#include "../../base/field.hpp"
#include "../../detection/candidates.hpp"

namespace cairn {

class Simulation;

// Bodies of a rank among those of a scene that ranks share.
struct SharedBodies {
  std::vector<std::int64_t> tile_first; // (tiles + 1) bodies, by the tiles that they have in the whole scene
  std::vector<std::int32_t> tile_of;    // (bodies)
  std::vector<std::uint8_t> everywhere; // (bodies) 1: every rank has it, and forces on it are added up over ranks
  bool alone = false;                   // there is one rank
  // Pairs of contactors that lists hold.
  std::function<bool(std::int32_t, std::int32_t)> keeps_pair;
};

// Tiles of bodies, each of which one thread serves at a time. A rank has those of the whole scene, with its own share
// of their bodies, so that sums run in the same order on each.
class BodyTiles {
public:
  static constexpr std::int64_t size = 2048; // bodies
  BodyTiles(std::int64_t bodies, const SharedBodies* shared) : bodies_(bodies), shared_(shared) {}
  std::int64_t count() const {
    return shared_ ? std::int64_t(shared_->tile_first.size()) - 1 : (bodies_ + size - 1) / size;
  }
  std::int64_t first(std::int64_t tile) const {
    return shared_ ? shared_->tile_first[std::size_t(tile)] : std::min(tile * size, bodies_);
  }
  std::int64_t last(std::int64_t tile) const { return first(tile + 1); }
  std::int64_t of(std::int64_t body) const { return shared_ ? shared_->tile_of[std::size_t(body)] : body / size; }
  bool everywhere(std::int64_t body) const { return shared_ && shared_->everywhere[std::size_t(body)] != 0; }
  const SharedBodies* shared() const { return shared_; }

private:
  std::int64_t bodies_;
  const SharedBodies* shared_;
};

// Numbers that each pair of a list has.
struct PairNumbers {
  int dim = 0, dofs = 0, states = 0;
  bool moments = false, losses = false, across = false;
};

// Pairs that may act until bodies have moved by the skin, in batches of one tile, pair of shapes and law.
struct NeighbourList {
  static constexpr int lanes = 128; // pairs of a batch at most
  struct Batch {
    std::int64_t first = 0;
    std::int32_t count = 0, kind = 0, entry = 0;
    bool spheres = false;    // two spheres
    std::int64_t other = -1; // place of what acts on B, when B is of another tile
    std::int64_t kept = -1;  // place of what acts on both, when one of them is on every rank
  };
  std::int64_t pairs = 0, others = 0, kept_pairs = 0;
  bool twins = false; // two bodies meet more than once, by images
  Array<std::int32_t> a, b, body_a, body_b, image;
  Array<double> state;  // (states, pairs), vectors in space axes
  Array<double> force;  // (dim, pairs) on A [N]
  Array<double> loss;   // (pairs) to damping and friction in the step, if anyone asks for it [J]
  Array<double> moment; // (1 | 3, pairs) on A, where laws have one [N m]
  Array<double> kept;   // (dofs, 2 kept_pairs) of a batch on all A, then on all B [N, N m]
  Array<double> across; // (pairs) effective masses of those across the sides of a cell that ranks share [kg]
  Array<std::int8_t> active;
  Array<std::int32_t> source;             // of contacts of shapes: their numbers among those that were found
  std::vector<std::int64_t> start, begin; // of groups of pairs, as they are laid out
  std::vector<std::int32_t> slot;         // group of each pair that was found, -1: of none
  std::vector<Batch> batches;
  std::vector<std::int64_t> tile_batches, tile_incoming; // first of each tile
  Array<std::int32_t> incoming_body, incoming_place;     // what other tiles exert, in their order
  Array<double> other;                                   // (dofs, others) [N, N m]
  // state of the scene when the list was built
  Array<std::int64_t> contactor_id;
  std::int64_t order_version = -1, bodies = 0, contactors = 0;
  bool valid = false;

  // Pairs by tile of A, or of the body that is not on every rank; what stays in the tile comes first, then what goes to
  // another one, then what acts on bodies that are on every rank; within that by pair of shapes and law, then in the
  // order of detection. shaped: contacts of shapes, which are laid out alike, for one step.
  void lay_out(const Simulation& s, const Candidates& found, bool shaped, const BodyTiles& tiles,
               const PairNumbers& numbers);
  std::int64_t bytes() const;

private:
  void count_pairs(const Simulation& s, const Candidates& found, bool shaped, const BodyTiles& tiles);
  void place_pairs(const Simulation& s, const Candidates& found, bool shaped);
  void cut_batches(const Simulation& s, bool shaped, std::int64_t tiles);
  void list_incoming(const BodyTiles& tiles);
};

} // namespace cairn
