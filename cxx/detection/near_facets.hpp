// Pairs of balls and triangles that can touch now, among those of the last search.
#pragma once
#include <cstdint>
#include <vector>

#include "facet_outline.hpp"
#include "kept_pairs.hpp"
#include "placed_scene.hpp"

namespace cairn::detection {

// A search reaches farther than most of its pairs ever come; a triangle whose plane meets the ball beside it, or
// beside which another triangle is nearer, costs a few numbers here instead of a narrow phase, and none as long as the
// ball stays where it was, seen from the body of the triangle. No pair is left out that the narrow phase would count.
class NearFacets {
public:
  explicit NearFacets(const PlacedScene& scene) : scene_(scene) {}

  // Takes the pairs of a search, where bodies are and with its margin. surfaces_known: contactors and their hulls are
  // those of the last one.
  void take(const OrderedPairs& found, bool surfaces_known);
  // Keeps those of hulls that may touch where bodies are now.
  void find(const OrderedPairs& found);
  // Triangles have other places in the axes of their bodies than when pairs were taken.
  void place_anew(const OrderedPairs& found);
  const OrderedPairs& pairs() const { return near_; }
  std::size_t bytes() const {
    return near_.bytes() + facets_.capacity() * sizeof(FacetOutline) + close_.capacity() * sizeof(std::int64_t) +
           listed_.capacity() * sizeof(std::int64_t) + groups_.capacity() * sizeof(Group);
  }

private:
  // A longer way lasts longer, and every step tests more triangles.
  static constexpr double least_skin = 0x1p-9, most_skin = 0x1p-5;
  // Pairs of a ball with triangles of one body, and those of them that were close when the ball was last at `at`.
  struct Group {
    std::int64_t first = 0, last = 0, close = 0; // of listed_; how many are close, from `first` of close_
    std::int32_t ball = 0, body = 0, image = 0;
    bool known = false;
    std::int32_t age = 0;                // calls since close ones were sought
    double skin = least_skin;            // way of the ball in parts of its reach until they are sought again
    double at[3] = {0, 0, 0}, reach = 0; // in axes of the body; of the ball then [m]
  };
  struct Seen { // a ball in the axes of a body [m]
    double at[3], rounding;
  };
  void place_of(std::int32_t contactor, double* x) const;
  void list_groups(const OrderedPairs& found, std::int64_t first, std::int64_t last);
  void place_facet(std::int32_t facet);
  Seen see_ball(const Group& group) const;
  bool is_far(const OrderedPairs& found, std::int64_t p, const Seen& ball, double reach, bool exactly) const;
  void look_at(const OrderedPairs& found, Group& group);

  const PlacedScene& scene_;
  OrderedPairs near_;
  std::vector<FacetOutline> facets_;
  std::vector<std::int32_t> facet_of_; // of the contactors; -1: none so far
  std::vector<std::uint8_t> may_touch_;
  std::vector<std::int64_t> listed_, close_; // pairs within the margin of the search, and of the next steps
  std::vector<Group> groups_;
  std::vector<std::size_t> kind_groups_; // end of the groups of each kind
};

} // namespace cairn::detection
