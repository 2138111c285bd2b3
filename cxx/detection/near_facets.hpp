// Pairs of balls and triangles that can touch now, among those of the last search.
#pragma once
#include <cstdint>
#include <vector>

#include "kept_pairs.hpp"
#include "placed_scene.hpp"

namespace cairn::detection {

// A search reaches farther than most of its pairs ever come; a triangle whose plane meets the ball beside it costs a
// few numbers here instead of a narrow phase. No pair is left out that the narrow phase would count.
class NearFacets {
public:
  explicit NearFacets(const PlacedScene& scene) : scene_(scene) {}

  // Keeps the pairs of hulls of the last search (`searches`: its number) that may touch where bodies are now.
  void find(const OrderedPairs& found, std::int64_t searches);
  const OrderedPairs& pairs() const { return near_; }
  std::size_t bytes() const { return near_.bytes() + facet_.capacity() * sizeof(double); }

private:
  void place_of(std::int32_t contactor, double* x) const;
  void list_facets(const OrderedPairs& found, std::int64_t first, std::int64_t last);
  bool mark_moved(bool all);
  void place_facets(const OrderedPairs& found, std::int64_t first, std::int64_t last, std::int64_t searches);
  void drop_far(const OrderedPairs& found, int kind, std::int64_t first, std::int64_t last);

  const PlacedScene& scene_;
  OrderedPairs near_;
  std::vector<double> facet_, pose_;            // triangles where they are; poses of their bodies then
  std::vector<std::int32_t> facets_, bodies_;   // contactors, and the bodies that carry them
  std::vector<std::uint8_t> moved_, may_touch_; // bodies since then; pairs
  std::int64_t placed_in_ = -1;                 // number of the search
};

} // namespace cairn::detection
