// Pairs that a caller declares: they have a contact whatever their gap.
#pragma once
#include <algorithm>
#include <vector>

#include "pair_list.hpp"
#include "placed_scene.hpp"

namespace cairn::detection {

class DeclaredPairs {
public:
  std::vector<DeclaredPair> pairs; // the caller's to fill

  // Adds those whose contactors exist, joined at their nearest images.
  void add_to(PairList& list, const PlacedScene& scene);
  // Sorts them for has().
  void sort();
  bool has(const PlacedScene& scene, const Candidates& out, std::int64_t i) const;
  std::size_t bytes() const { return number_of_id_.capacity() * sizeof(std::int32_t); }

private:
  std::vector<DeclaredPair> sorted_;
  Array<std::int32_t> number_of_id_;
};

} // namespace cairn::detection
