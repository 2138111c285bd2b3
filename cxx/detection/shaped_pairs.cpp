#include "shaped_pairs.hpp"

#include "broad_phase.hpp"
#include "far_sides.hpp"
#include "interaction_handler.hpp"
#include "narrow_phase.hpp"
#include "near_facets.hpp"

namespace cairn::detection {

struct ShapedPairs::Workspace {
  Scratch scratch;
  PlacedScene scene;
  DeclaredPairs declared; // none
  BroadPhase broad{scene};
  OrderedPairs found;
  NearFacets near_facets{scene};
  NarrowPhase narrow{scene, declared};
  DroppedContacts dropped;
  FarSides far_sides{scene};
};

ShapedPairs::ShapedPairs() : work_(std::make_unique<Workspace>()) {}
ShapedPairs::~ShapedPairs() = default;

void ShapedPairs::search(const Bodies& bodies, const Contactors& contactors, const Cell& cell, double reach,
                         const LawRules& rules, bool surfaces_known, Candidates& out) {
  Workspace& w = *work_;
  out.count = 0;
  Margin margin;
  margin.constant = reach;
  w.scene.begin(bodies, contactors, cell, margin, {}, &rules, w.scratch);
  w.scene.seek_hulls_later(surfaces_known);
  w.broad.begin();
  w.scene.place(w.found);
  w.broad.search(w.declared, 0, w.found);
  w.near_facets.take(w.found, surfaces_known);
  w.narrow.find(w.found, out);
}

void ShapedPairs::contacts(const Bodies& bodies, const Contactors& contactors, const Cell& cell, double reach,
                           const LawRules& rules, Candidates& out) {
  Workspace& w = *work_;
  out.count = 0;
  Margin margin;
  margin.constant = reach;
  Configuration again;
  again.hulls_again = true;
  w.scene.begin(bodies, contactors, cell, margin, again, &rules, w.scratch);
  if (bodies.stretch.active) w.near_facets.place_anew(w.found); // bodies grow in each step
  w.near_facets.find(w.found);
  w.scene.place(w.near_facets.pairs());
  w.narrow.find(w.near_facets.pairs(), out);
  w.far_sides.drop(w.declared, w.dropped, out);
}

std::size_t ShapedPairs::bytes() const {
  const Workspace& w = *work_;
  return std::size_t(w.scratch.bytes()) + w.broad.bytes() + w.found.bytes() + w.near_facets.bytes() + w.narrow.bytes();
}

} // namespace cairn::detection
