// A call of detection: the stages in their order.
#include "interaction_handler.hpp"

#include <algorithm>

#include "broad_phase.hpp"
#include "corners_on_edges.hpp"
#include "edge_rows.hpp"
#include "far_sides.hpp"
#include "narrow_phase.hpp"
#include "nodes_along_sides.hpp"
#include "rims.hpp"
#include "seams.hpp"
#include "spare_contacts.hpp"

namespace cairn {

using namespace detection;

// The stages by value, in the order of a call; each refers to those above it alone.
struct InteractionHandler::Workspace {
  Scratch own; // where the caller gives none
  PlacedScene scene;
  DeclaredPairs declared;
  BroadPhase broad{scene};
  OrderedPairs found; // of calls that keep none
  KeptPairs kept;
  std::int64_t searches = 0;
  NarrowPhase narrow{scene, declared};
  DroppedContacts dropped; // marks, of each stage in turn
  FarSides far_sides{scene};
  SpareContacts spares{scene};
  EdgeRows edge_rows{scene};
  CornersOnEdges corners{scene};
  NodesAlongSides nodes{scene};
  std::vector<HeldNode> met; // nodes that these dropped
  Seams seams{scene};
  RimContacts rims{scene};

  bool may_keep() const;
  const OrderedPairs& seek(bool keeps);
};

InteractionHandler::InteractionHandler() : work(std::make_unique<Workspace>()) {}
InteractionHandler::~InteractionHandler() = default;
InteractionHandler::InteractionHandler(InteractionHandler&&) noexcept = default;
InteractionHandler& InteractionHandler::operator=(InteractionHandler&&) noexcept = default;

InteractionHandler::Counts InteractionHandler::counts() const { return {work->broad.owned(), work->broad.ghosts()}; }

std::int64_t InteractionHandler::searches() const { return work->searches; }

std::vector<DeclaredPair>& InteractionHandler::declared() { return work->declared.pairs; }

void InteractionHandler::detect(const Bodies& bodies, const Contactors& contactors, const Cell& cell,
                                const Margin& margin, Candidates& out, const Configuration& configuration,
                                Scratch* scratch, const LawRules* rules) {
  Workspace& w = *work;
  out.count = 0;
  w.scene.begin(bodies, contactors, cell, margin, configuration, rules, scratch ? *scratch : w.own);
  w.broad.begin();
  w.seams.begin();
  w.scene.place(w.found);
  const OrderedPairs& pairs = w.seek(configuration.soon_again && w.may_keep());
  w.narrow.find(pairs, out);
  w.far_sides.drop(w.declared, w.dropped, out);
  w.spares.drop(w.declared, w.dropped, out);
  w.edge_rows.drop(w.declared, w.dropped, out);
  w.corners.drop(w.declared, w.dropped, out);
  w.nodes.drop(w.declared, w.dropped, out, w.met);
  w.seams.drop(w.declared, w.dropped, out);
  w.rims.hold(pairs, configuration.seats, w.met, w.declared, w.dropped, out);
}

// True if pairs can be kept: results depend only on positions, which change by no more than contactors move. So for
// balls, and for walls and bars at constant direction; a user's routine may depend on anything.
bool InteractionHandler::Workspace::may_keep() const {
  return declared.pairs.empty() && !scene.mapped && !scene.any_periodic && !scene.contactors->hull.active &&
         std::all_of(std::begin(pair_kinds), std::end(pair_kinds),
                     [](const PairKind& kind) { return kind.contact == kind.built_in; });
}

// The pairs that may count, of this search or kept from an earlier one.
const OrderedPairs& InteractionHandler::Workspace::seek(bool keeps) {
  if (keeps && kept.hold(scene.searched())) {
    kept.used();
    return kept.pairs;
  }
  ++searches;
  keeps = keeps && kept.pays();
  const double wall_skin = keeps ? kept.widen(scene.searched(), scene.reach.data()) : 0;
  OrderedPairs& pairs = keeps ? kept.pairs : found;
  broad.search(declared, wall_skin, pairs);
  if (keeps) kept.keep();
  return pairs;
}

std::size_t InteractionHandler::bytes() const {
  const Workspace& w = *work;
  return w.own.bytes() + w.declared.bytes() + w.broad.bytes() + w.found.bytes() + w.kept.bytes() + w.narrow.bytes();
}

} // namespace cairn
