// Broad phase: pairs of contactors whose reaches meet.
#pragma once
#include <cstdint>
#include <vector>

#include "declared_pairs.hpp"
#include "detection_grid.hpp"
#include "facet_trees.hpp"
#include "pair_kinds.hpp"

namespace cairn::detection {

class BroadPhase {
public:
  explicit BroadPhase(const PlacedScene& scene) : scene_(scene) {}

  void begin(); // a call; nothing of the last one is left
  // Pairs of a search, in which walls reach farther by `wall_skin` [m]; and the declared ones.
  void search(DeclaredPairs& declared, double wall_skin, OrderedPairs& out);

  // Contactors of the last search: those of the scene, and their periodic images.
  std::int64_t owned() const { return real_items_ + std::int64_t(walls_.size()); }
  std::int64_t ghosts() const { return items_ - real_items_; }
  std::size_t bytes() const;

private:
  void make_items();
  void make_ghosts();
  void search_grid();
  const std::int8_t* triangles();
  void search_walls(double wall_skin);
  void search_surfaces();
  void search_surface(const FacetTrees::Tree& tree);
  void admit(PairList& list, std::int64_t added) const;
  void order_pairs(OrderedPairs& out);

  const PlacedScene& scene_;
  // items of the grid: bounded contactors, then ghosts of them
  std::vector<std::int32_t> walls_;
  ScratchArray<std::int32_t> bounded_;
  std::int64_t items_ = 0, real_items_ = 0;
  ScratchArray<double> item_x_, item_reach_;
  ScratchArray<std::int32_t> item_contactor_, item_lattice_, ghost_of_;
  ScratchArray<std::int8_t> triangle_;
  DetectionGrid grid_;
  FacetTrees trees_;
  bool trees_made_ = false;     // of the last search
  std::vector<PairList> lists_; // of the threads
  ScratchArray<std::int32_t> place_;
  std::int32_t slot_of_kind_[kinds] = {};
};

} // namespace cairn::detection
