// Data of detection between its stages, and the lists of shapes and pairs.
#pragma once
#include <string>

#include "../contactors/shapes.hpp"
#include "cairn/rows/pair.h"
#include "detection_grid.hpp"
#include "interaction_handler.hpp"
#include "kept_pairs.hpp"
#include "recalled_pairs.hpp"

namespace cairn {
namespace detection {

struct PairKind {
  const char* name;
  Shape a, b;
  int most;                    // contacts of one pair
  cairn_pair_contact* contact; // null: see hull_contact
  cairn_hull_contact* hull_contact;
  cairn_pair_contact* built_in; // contact may come from a user's library
};
inline PairKind pair_kinds[] = {
#define CAIRN_PAIR(name, a, b, most) {#name, Shape::a, Shape::b, most, cairn_pair_##name, nullptr, cairn_pair_##name},
#define CAIRN_HULL_PAIR(name, a, b, most) {#name, Shape::a, Shape::b, most, nullptr, cairn_pair_##name, nullptr},
#define CAIRN_CONVEX_PAIR(a, b, most) {#a "_" #b, Shape::a, Shape::b, most, nullptr, cairn_pair_convex, nullptr},
#include "../../core_f90/detection/pairs.def"
};
inline constexpr int kinds = int(std::size(pair_kinds));
// True for kinds whose kernel starts from its last result.
inline bool recalls(const PairKind& kind) { return kind.hull_contact == cairn_pair_polyhedron_polyhedron; }

inline constexpr std::int32_t declared_bit = 1 << 30; // beside an image
inline constexpr std::int32_t image_bits = declared_bit - 1;
inline constexpr int batch = 256, hull_batch = 64; // pairs of a call of the narrow phase

// Which kind two shapes make, and how they are turned to be A and B: 0 as they come, 1 the other way, 2 by id.
struct KindTable {
  std::int32_t kind[shapes * shapes], turn[shapes * shapes];
  KindTable() {
    std::fill(std::begin(kind), std::end(kind), -1);
    std::fill(std::begin(turn), std::end(turn), 0);
    for (int k = 0; k < kinds; ++k) {
      const int a = int(pair_kinds[k].a), b = int(pair_kinds[k].b);
      kind[a + shapes * b] = kind[b + shapes * a] = k;
      turn[b + shapes * a] = 1;
      if (a == b) turn[a + shapes * a] = 2;
    }
  }
};
inline const KindTable kind_table;

template <class T>
std::size_t bytes_of(const Array<T>& array) {
  return array.capacity() * sizeof(T);
}

// Pairs that one thread found, before they are ordered.
struct alignas(128) PairList {
  std::int64_t count = 0, room = 0;
  std::int32_t *a = nullptr, *b = nullptr, *image = nullptr, *kind = nullptr;
  Array<std::int32_t> hits;
  void reserve(std::int64_t n, Scratch& scratch) {
    needed = std::max(needed, n);
    if (room >= n) return;
    room = std::max(n + n / 2, last); // as much as the last time, unless that is too little
#pragma omp critical(cairn_scratch)
    for (std::int32_t** column : {&a, &b, &image, &kind}) {
      auto* wider = scratch.take<std::int32_t>(room);
      std::copy_n(*column, count, wider);
      *column = wider;
    }
  }
  void begin() {
    last = needed + needed / 16;
    count = room = needed = 0;
  }

private:
  std::int64_t needed = 0, last = 0;
};

// For messages.
std::string name_of(const Contactors&, const Bodies&, std::int64_t contactor);

} // namespace detection

struct InteractionHandler::Workspace {
  std::int64_t spoilt = -1; // a pair to which a user's routine gave no number
  std::vector<DeclaredPair> declared;
  std::vector<DeclaredPair> declared_in_order; // as contacts that are left to others ask for them
  std::vector<std::uint8_t> left;              // of each contact, whether it is left to another side
  std::vector<std::int64_t> held;

  // the scene of this call
  const Bodies* bodies = nullptr;
  const Contactors* contactors = nullptr;
  const Cell* cell = nullptr;
  const Margin* margin = nullptr;
  const LawRules* rules = nullptr; // null: all may meet
  const double *position = nullptr, *rotation = nullptr;
  const MappedContactors* mapped = nullptr; // null: none
  bool for_bonds = false, hulls_again = false;
  double step = 0; // [s] in which bodies move by their velocities; 0: they do not move
  int dim = 2;
  std::int32_t periodic[3] = {0, 0, 0};
  bool any_periodic = false;

  Scratch own;
  Scratch* scratch = nullptr;

  // per contactor
  ScratchArray<double> centre, direction, reach;
  // of hulls: see cairn_hulls in cairn/core.h; boxes of all contactors
  ScratchArray<std::int64_t> hull_place;
  ScratchArray<std::int8_t> movable; // per carrier
  // per contactor: its carrier, deformable bodies after the rigid ones; and the same with body 0 for deformable bodies,
  // whose position is not used. Without deformable bodies both are the contactors' own.
  const std::int32_t *carrier = nullptr, *placed_on = nullptr;
  ScratchArray<std::int32_t> carrier_of, placed_on_of;
  ScratchArray<double> turned, box;
  std::vector<std::int32_t> walls;
  ScratchArray<std::int32_t> bounded;
  // per item: a bounded contactor, or a ghost of one
  std::int64_t items = 0, real_items = 0;
  ScratchArray<double> item_x, item_reach;
  ScratchArray<std::int32_t> item_contactor, item_lattice, ghost_of;
  DetectionGrid grid;
  std::vector<detection::PairList> lists;
  double wall_skin = 0; // by which the search at walls reaches farther than their margin [m]
  // ordering and narrow phase
  detection::OrderedPairs found; // of calls that keep none
  detection::KeptPairs kept;
  std::int64_t searches = 0;
  const std::int32_t *a = nullptr, *b = nullptr, *image = nullptr; // of the pairs
  ScratchArray<std::int32_t> place;
  Array<std::int32_t> number_of_id;
  struct Piece {                      // contacts that one thread found, from their first slot on
    std::int64_t slot, kept, refused; // refused: the first pair that cannot be, if any
  };
  Array<Piece> pieces;
  detection::RecalledPairs recalled;
  std::int64_t first_recalled = 0; // among the pairs
  std::int32_t slot_of_kind[detection::kinds] = {};

  void begin(Scratch& in);
  double share(std::int64_t i) const { return margin->per_contactor ? margin->per_contactor[i] : margin->constant / 2; }
  void check() const;
  void check_cell() const;
  bool same_mesh(std::int32_t a, std::int32_t b) const {
    return contactors->body.values[a] < 0 && contactors->body.values[a] == contactors->body.values[b];
  }
  void name_carriers();
  void place_contactors();
  void place_mapped();
  void place_hulls();
  void place_hulls_again();
  std::vector<std::int32_t> placed_again; // contactors, and whether they are among them
  std::vector<std::int8_t> mark_again;
  // Pairs that may touch now, among those of the last search: see near_facets.cpp.
  detection::OrderedPairs again;
  std::vector<double> facet_number, facet_pose; // triangles where they stand; poses of their bodies then
  std::vector<std::int32_t> near_facets, facet_bodies;
  std::vector<std::uint8_t> facet_moved, near_now;
  std::int64_t facets_seen_at = -1; // number of searches then
  void place_of(std::int32_t contactor, double* x) const;
  void see_facets(std::int64_t first, std::int64_t last);
  void leave_far_facets(int kind, std::int64_t first, std::int64_t last);
  void find_near_again();
  void make_items();
  void search_grid();
  void search_walls();
  void add_declared();
  std::int32_t nearest_image(std::int64_t a, std::int64_t b) const;
  bool may_keep() const;
  detection::SearchedScene searched() const;
  const detection::OrderedPairs& seek(bool keeps);
  void order_pairs(detection::OrderedPairs& out);
  void narrow(const detection::OrderedPairs& pairs, Candidates& out);
  void narrow_piece(int kind, std::int64_t first, std::int64_t last, Piece& piece, Candidates& out);
  // Pairs from first to last - 1 of a kind, whose contacts go from `slot` on; returns how many count.
  std::int64_t narrow_batch(int kind, std::int64_t first, std::int64_t last, std::int64_t slot, Piece& piece,
                            Candidates& out);
  std::int64_t narrow_hulls(int kind, std::int64_t first, std::int64_t last, std::int64_t slot, Candidates& out);
  bool repeated(std::int64_t pair) const; // as the one before it: declared, and found too
  std::int64_t drop_own_insides(std::int64_t first, std::int64_t count, Candidates& out) const;
  void move_contacts(std::int64_t from, std::int64_t count, std::int64_t to, Candidates& out) const;
  void close_ranks(Candidates& out);
  void trim(Candidates& out, std::int64_t count) const; // to as many
  void leave_out(Candidates& out) const;                // those that are marked
  void leave_out_spares(Candidates& out);
  void leave_far_sides(Candidates& out); // see far_sides.cpp
  double round_layer(std::int32_t contactor) const;
  double along_its_edge(const Candidates& out, std::int64_t i) const;
  bool is_far_side_of(const Candidates& out, std::int64_t i, std::int64_t j, double layer) const;
  // Which of two edges in a row has a point.
  enum class EdgeOwner { first, second, both };
  EdgeOwner owner_at_corner(std::int32_t first, std::int32_t second, const double* x) const;
  std::int32_t edge_that_has_it(const Candidates& out, std::int64_t i) const; // of the contact, or the next one
  bool is_on_next_edge(const Candidates& out, std::int64_t i) const;
  void leave_to_next_edges(Candidates& out);
  void leave_to_sides(Candidates& out);
  // Contacts with sides of bodies that others, flush with them, cover: see seams.cpp.
  ScratchArray<std::int64_t> run;
  ScratchArray<std::int32_t> runs_of, runs_start;
  ScratchArray<std::int8_t> seam_verdict, runs_close, seam_mark;
  ScratchArray<double> seam_normal, runs_speed;
  bool may_have_seams() const;
  std::int32_t find_runs(const Candidates& out);
  std::int32_t list_runs(const Candidates& out, std::int32_t runs);
  void leave_seams(Candidates& out);
  void turn_contact(Candidates& out, std::int64_t i, bool of_b, const double* normal) const;
  void put_declared_in_order();
  bool is_declared(const Candidates& out, std::int64_t i) const; // after this
  bool points_along_the_row(const Candidates& out, std::int64_t i) const;
  bool is_beyond_its_edge(const Candidates& out, std::int64_t i) const;
  bool is_past_its_end(Candidates& out, std::int64_t i) const; // else with the gap that the mesh has there
  bool points_along_a_side(const Candidates& out, std::int64_t i, bool first) const;
  bool is_node_with_sides(std::int32_t contactor) const;
  // Nodes that slide past the rim of a flat side, see rims.cpp.
  // A flat face: how it looks, and its corners one after the other with whether the edge from each is a rim.
  struct FlatSide {
    double normal[3] = {0, 0, 0}, offset = 0; // from the centre of the contactor
    struct Corner {
      double x[3];
      bool rim; // of the edge from here; in 2D of this end
    };
    std::vector<Corner> corner; // two in 2D
  };
  struct HeldNode {
    std::int32_t node = -1, side = -1, face = 0, kind = 0, image = 0;
    double gap = 0, normal[3] = {}, way[3] = {}; // past the rim
  };
  mutable FlatSide seen_side, seen_before, own_side; // as large as was needed so far, as the next three
  std::vector<HeldNode> held_nodes, left_nodes;      // left_nodes: what nodes met along sides of their own
  std::vector<std::uint8_t> hinders_held;
  Candidates with_held;
  int flat_sides(std::int32_t contactor) const; // how many it has
  void view_side(std::int32_t contactor, int face, FlatSide& side) const;
  void view_edge(std::int32_t contactor, FlatSide& side) const;
  void view_facet(std::int32_t contactor, FlatSide& side) const;
  void view_face(std::int32_t contactor, int face, FlatSide& side) const;
  void vertex_of(std::int32_t contactor, int i, double* x) const;
  void looks_of(std::int32_t contactor, int i, double* normal) const;
  double beyond(const FlatSide& side, const double* x, bool& rim, double* way) const;
  bool is_mapped_point(std::int32_t contactor) const;
  void from_centre(std::int32_t a, std::int32_t b, std::int32_t which, double* x) const;
  void note_seats(Candidates& out);
  bool past_its_rim(const detection::OrderedPairs& pairs, const RimSeat& seat, HeldNode& held) const;
  void note_met(const Candidates& out, std::int64_t contact, HeldNode& met) const;
  bool lies_on_another(const detection::OrderedPairs& pairs, const HeldNode& met, HeldNode& held) const;
  bool way_inward(std::int32_t node, double* inward) const;
  void leave_hidden_sides(const detection::OrderedPairs& pairs, Candidates& out);
  bool hides(const detection::OrderedPairs& pairs, const Candidates& out, std::int64_t j, std::int64_t i) const;
  bool reaches_back(std::int32_t node, const double* normal, const double* way, double far) const;
  bool comes_past_a_rim(const detection::OrderedPairs& pairs, int kind, std::int64_t first, std::int64_t last,
                        HeldNode& held) const;
  void hold_at_rims(const detection::OrderedPairs& pairs, std::span<const RimSeat> before, Candidates& out);
  template <class Hold>
  void hold_what_slid(const detection::OrderedPairs& pairs, std::span<const RimSeat> before,
                      std::span<const RimSeat> over, Hold&& hold);
  bool bears_as_high(const Candidates& out, const HeldNode& h) const;
  void put_held(std::span<const HeldNode> held, Candidates& out);
  void index_nodes(const Candidates& out);
  std::span<const std::pair<std::int32_t, std::int64_t>> contacts_of(std::int32_t node) const; // after this
  std::vector<std::pair<std::int32_t, std::int64_t>> contacts_of_nodes, contacts_on_sides;
  bool is_met_there(const Candidates& out, const HeldNode& h) const;
  void admit(detection::PairList& list, std::int64_t added) const;
};

} // namespace cairn
