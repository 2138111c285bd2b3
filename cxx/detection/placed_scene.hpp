// Contactors of a scene at the positions of one call of detection.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "../base/scratch.hpp"
#include "interaction_handler.hpp"
#include "kept_pairs.hpp"

namespace cairn::detection {

// For messages.
std::string name_of(const Contactors&, const Bodies&, std::int64_t contactor);

// Arguments of a call of InteractionHandler::detect, and where its contactors are. Arrays are valid up to the next
// call; the stages of detection read them.
class PlacedScene {
public:
  // arguments
  const Bodies* bodies = nullptr;
  const Contactors* contactors = nullptr;
  const Cell* cell = nullptr;
  const Margin* margin = nullptr;
  const LawRules* rules = nullptr; // null: all may meet
  const double *position = nullptr, *rotation = nullptr;
  const MappedContactors* mapped = nullptr; // null: none
  bool for_bonds = false, hulls_again = false, hulls_later = false, surfaces_known = false;
  bool facets_apart = false; // triangles are sought by trees in the axes of their bodies, and are not placed
  double step = 0;           // [s] in which bodies move by their velocities; 0: they do not move
  int dim = 2;
  std::int32_t periodic[3] = {0, 0, 0};
  bool any_periodic = false;
  Scratch* scratch = nullptr; // memory of the stages

  // (dim | dim + 1 | 1, contactors) [m]; direction: unit vector, then half length
  ScratchArray<double> centre, direction, reach;
  // hulls: see cairn_hulls in cairn/core.h; boxes (2 dim) of all contactors
  ScratchArray<std::int64_t> hull_place;
  ScratchArray<double> turned, box;
  // carriers: rigid bodies, then deformable ones. placed_on: with body 0 for deformable bodies, whose position is not
  // used.
  ScratchArray<std::int8_t> movable; // (carriers)
  const std::int32_t *carrier = nullptr, *placed_on = nullptr;

  void begin(const Bodies&, const Contactors&, const Cell&, const Margin&, const Configuration&, const LawRules*,
             Scratch&);
  // Pairs with hulls are sought for calls of hulls_again alone, and have no contacts in this one. surfaces_known:
  // contactors and their hulls are those of the last call.
  void seek_hulls_later(bool surfaces_known);
  // Checks the scene and places its contactors; in hulls_again those of the hulls of these pairs alone.
  void place(const OrderedPairs& last);
  SearchedScene searched() const;

  // Share of a contactor in the margin of its pairs [m].
  double share(std::int64_t i) const { return margin->per_contactor ? margin->per_contactor[i] : margin->constant / 2; }
  bool same_mesh(std::int32_t a, std::int32_t b) const {
    return contactors->body.values[a] < 0 && contactors->body.values[a] == contactors->body.values[b];
  }
  const ShapeInfo& shape(std::int32_t contactor) const { return shape_table[contactors->shape.values[contactor]]; }
  bool is_mapped_point(std::int32_t contactor) const {
    return mapped->place[std::size_t(contactor)] >= 0 && shape(contactor).ball();
  }
  bool is_node_with_sides(std::int32_t contactor) const {
    const std::int32_t place = mapped->place[std::size_t(contactor)];
    return place >= 0 && mapped->sides_start[std::size_t(place)] < mapped->sides_start[std::size_t(place) + 1];
  }
  // Calls f(first, last) for the runs of contactors that are placed.
  template <class F>
  void each_placed(F&& f) const {
    for (const auto& [first, last] : placed_runs_) f(first, last);
  }
  // Gives the place of a point in space in the axes of a body of three dimensions [m]. Returns a bound on its rounding.
  double into_body(std::int64_t body, const double* at, double* x) const;
  // Vector from the image of B that A sees to A [m].
  void from_centre(std::int32_t a, std::int32_t b, std::int32_t image, double* x) const;
  // From the centre of a contactor, turned: a vertex of its hull [m], and the normal of a face.
  void vertex_of(std::int32_t contactor, int i, double* x) const;
  void normal_of(std::int32_t contactor, int face, double* normal) const;

private:
  void list_placed();
  void check() const;
  void check_cell() const;
  void name_carriers();
  void place_contactors();
  void check_placed(std::int64_t bad_centre, std::int64_t bad_reach) const;
  void place_mapped();
  void place_hulls();
  void begin_again();
  void place_hulls_again(const OrderedPairs& last);
  bool place_again(std::int64_t contactor);
  std::int64_t pose_number(std::int32_t body);

  std::vector<std::pair<std::int64_t, std::int64_t>> placed_runs_;
  ScratchArray<std::int32_t> carrier_of_, placed_on_of_;
  // Places that last from call to call of hulls_again: those of bodies that do not move are not made anew.
  struct Again {
    bool known = false;
    std::int64_t calls = 0;
    Scratch memory;
    ScratchArray<double> centre, direction, reach, turned, box;
    ScratchArray<std::int64_t> hull_place;
    std::vector<std::int64_t> seen, body_seen;     // number of the last call that had a contactor, a body
    std::vector<std::int64_t> placed, pose_number; // the pose of its body when a contactor was placed; the last pose
    std::vector<double> pose;
  } again_;
};

} // namespace cairn::detection
