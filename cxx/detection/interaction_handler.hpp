// Finds which contactors may touch within the step: the stage detect_contacts.
#pragma once
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "../base/cell.hpp"
#include "../base/scratch.hpp"
#include "../bodies/body.hpp"
#include "../contactors/contactor.hpp"
#include "../contactors/mapped_contactors.hpp"
#include "../laws/law_rules.hpp"
#include "candidates.hpp"

namespace cairn {

// How far apart a pair may be and still be a candidate ("alert distance"). It depends on the configuration alone.
struct Margin {
  double constant = 0; // [m] of every pair, used when per_contactor is null
  const double* per_contactor =
      nullptr; // (contactors) [m], in internal order; the margin of a pair is the sum of its two
};

// Where the bodies stand when contacts are sought; null stands for the bodies' own arrays.
struct Configuration {
  const double* position = nullptr;         // (dim, bodies) [m]
  const double* rotation = nullptr;         // (1 | 4, bodies) [rad | -]
  const MappedContactors* mapped = nullptr; // null: rigid bodies carry all contactors
  bool for_bonds = false; // for joining bodies in contact: no contact is left out as an obstacle to sliding
  // Seats of the step before, by internal numbers: nodes that stay where they slid past the rim of a side.
  std::span<const RimSeat> seats{};
  double step = 0;         // [s] in which bodies move by their velocities until the next call; 0: they do not move
  bool soon_again = false; // a call like this follows in the next step: pairs are kept for it, which changes no result
  // Contacts of hulls alone, among the pairs of the last search, which reached so far that none is missing.
  bool hulls_again = false;
};

// A pair that is a candidate whatever its gap (a bond, a wire), by the ids of its contactors in any order.
// In a periodic cell it joins the images that are nearest.
using DeclaredPair = std::array<std::int64_t, 2>;

class InteractionHandler {
public:
  InteractionHandler();
  ~InteractionHandler();
  InteractionHandler(InteractionHandler&&) noexcept;
  InteractionHandler& operator=(InteractionHandler&&) noexcept;

  // Finds all pairs of contactors of different bodies (deformable ones included), not both immovable (inverse_mass 0 in
  // every dof), with a row of pairs.def, not excluded by the rules, if given, and with gap <= margin; and the declared
  // pairs. Order: row of pairs.def, then internal number of A, of B, image. It depends on nothing but the arguments:
  // not on earlier calls, not on the number of threads. For equal shapes A is the contactor with the smaller id;
  // otherwise as in pairs.def. Throws std::invalid_argument, with the body's id, when a position is not finite; `out`
  // is then empty. Works in `scratch`, which the caller may use for something else afterwards; without one, in its own.
  void detect(const Bodies&, const Contactors&, const Cell&, const Margin&, Candidates& out, const Configuration& = {},
              Scratch* scratch = nullptr, const LawRules* rules = nullptr);

  // Numbers of contactors in the last search: those of the scene, which this process owns, and ghosts, their images in
  // a periodic cell: an image has the id of its contactor, and a contact with it counts for that contactor.
  struct Counts {
    std::int64_t owned = 0, ghosts = 0;
  };
  Counts counts() const;
  std::int64_t searches() const; // that calls took so far; others found their pairs among those that are kept

  // Pairs to keep whatever their gap, the caller's to fill. One whose contactors no longer exist is passed over.
  std::vector<DeclaredPair>& declared();

  std::size_t bytes() const; // kept between calls

private:
  struct Workspace;
  std::unique_ptr<Workspace> work;
};

// Numbering of points along a Hilbert curve (Hilbert 1891; Skilling 2004): item i of the new order is point result[i].
// position: (dim, count) [m]. The same for positions rescaled by a power of two; a few points far away do not coarsen
// it.
std::vector<std::int32_t> space_filling_order(int dim, std::int64_t count, const double* position);

} // namespace cairn
