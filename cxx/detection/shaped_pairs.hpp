// Pairs of shapes for many steps, and their contacts in each: detection for smooth DEM.
#pragma once
#include <cstdint>
#include <memory>

#include "../base/cell.hpp"
#include "../bodies/body.hpp"
#include "../contactors/contactor.hpp"
#include "../laws/law_rules.hpp"
#include "candidates.hpp"

namespace cairn::detection {

class ShapedPairs {
public:
  ShapedPairs();
  ~ShapedPairs();

  // Finds the pairs within a margin [m], and the contacts within it of those that have no hull; those of the others
  // come by contacts(). surfaces_known: contactors and their hulls are those of the last search.
  void search(const Bodies&, const Contactors&, const Cell&, double margin, const LawRules&, bool surfaces_known,
              Candidates& out);
  // Contacts of the pairs with hulls of the last search, within a margin at most as wide as bodies have come nearer
  // since than its own.
  void contacts(const Bodies&, const Contactors&, const Cell&, double margin, const LawRules&, Candidates& out);
  std::size_t bytes() const;

private:
  struct Workspace;
  std::unique_ptr<Workspace> work_;
};

} // namespace cairn::detection
