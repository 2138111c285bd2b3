#include "near_facets.hpp"

#include <algorithm>
#include <cmath>

#include "../base/turning.hpp"
#include "detection_grid.hpp"
#include "pair_kinds.hpp"
#include "pair_list.hpp"

namespace cairn::detection {

namespace {

constexpr double on_the_safe_side = 1e-6; // of lengths, against rounding
// Calls for which close triangles should serve; results do not depend on it, time does.
constexpr std::int32_t often = 8, seldom = 64;

} // namespace

void NearFacets::place_of(std::int32_t contactor, double* x) const {
  const Contactors& k = *scene_.contactors;
  const std::int64_t body = k.body.values[std::size_t(contactor)];
  for (int d = 0; d < 3; ++d) x[d] = scene_.position[3 * body + d];
  if (!k.offset.active) return;
  double turned_offset[3];
  const double* offset = k.offset[contactor];
  if (scene_.rotation)
    turn_about(&scene_.rotation[4 * body], 1, offset, turned_offset);
  else
    std::copy_n(offset, 3, turned_offset);
  for (int d = 0; d < 3; ++d) x[d] += turned_offset[d];
}

void NearFacets::place_facet(std::int32_t facet) {
  std::int32_t& place = facet_of_[std::size_t(facet)];
  if (place >= 0) return;
  place = std::int32_t(facets_.size());
  facets_.emplace_back(*scene_.contactors, facet);
}

// Pairs of a kind by ball and body, which stand one after the other; of these the ones within the margin.
void NearFacets::list_groups(const OrderedPairs& found, std::int64_t first, std::int64_t last) {
  const Contactors& k = *scene_.contactors;
  Seen ball{};
  double reach = 0;
  for (std::int64_t p = first; p < last; ++p) {
    const std::int32_t body = k.body.values[std::size_t(found.b[p])], image = found.image[p] & image_bits;
    if (p == first || groups_.back().ball != found.a[p] || groups_.back().body != body ||
        groups_.back().image != image) {
      Group group;
      group.first = group.last = std::int64_t(listed_.size());
      group.ball = found.a[p];
      group.body = body;
      group.image = image;
      ball = see_ball(group);
      reach = k.radius.values[std::size_t(group.ball)] + scene_.share(group.ball);
      groups_.push_back(group);
    }
    place_facet(found.b[p]);
    if (is_far(found, p, ball, reach, false)) continue;
    listed_.push_back(p);
    ++groups_.back().last;
  }
}

void NearFacets::take(const OrderedPairs& found, bool surfaces_known) {
  if (!surfaces_known) {
    facets_.clear();
    facet_of_.assign(std::size_t(scene_.contactors->count), -1);
  }
  listed_.clear();
  groups_.clear();
  kind_groups_.assign(kinds, 0);
  for (int kind = 0; kind < kinds; ++kind) {
    if (pair_kinds[kind].hull_contact == cairn_pair_sphere_facet)
      list_groups(found, found.begin_of(kind), found.kind_end[std::size_t(kind)]);
    kind_groups_[std::size_t(kind)] = groups_.size();
  }
  close_.resize(listed_.size());
  may_touch_.resize(listed_.size());
}

void NearFacets::place_anew(const OrderedPairs& found) {
  facets_.clear();
  facet_of_.assign(std::size_t(scene_.contactors->count), -1);
  for (const std::int64_t p : listed_) place_facet(found.b[p]);
  for (Group& group : groups_) group.known = false;
}

// Where the ball of a group is, in the axes of the body of its triangles, and how much of it is rounded.
NearFacets::Seen NearFacets::see_ball(const Group& group) const {
  Seen ball{};
  double at[3], shift[3] = {0, 0, 0};
  place_of(group.ball, at);
  if (scene_.any_periodic) image_shift(*scene_.cell, group.image, shift);
  for (int d = 0; d < 3; ++d) at[d] -= shift[d];
  ball.rounding = scene_.into_body(group.body, at, ball.at);
  return ball;
}

// True if a pair cannot have a contact. exactly: what is nearest to the ball may have moved to the next triangle.
bool NearFacets::is_far(const OrderedPairs& found, std::int64_t p, const Seen& ball, double reach, bool exactly) const {
  if (found.image[p] & declared_bit) return false;
  const std::int32_t facet = found.b[p];
  const FacetOutline& outline = facets_[std::size_t(facet_of_[std::size_t(facet)])];
  double x[3];
  for (int d = 0; d < 3; ++d) x[d] = ball.at[d] - outline.centre[d];
  reach += scene_.share(facet);
  const double slack = on_the_safe_side * (reach + outline.size) + ball.rounding;
  return outline.is_beyond(x, reach, slack) || (exactly && outline.is_elsewhere(x, reach, slack));
}

// Marks which of the close pairs of a group may touch; these are sought again once the ball is elsewhere.
void NearFacets::look_at(const OrderedPairs& found, Group& group) {
  const Seen ball = see_ball(group);
  double square = 0;
  const double reach = scene_.contactors->radius.values[std::size_t(group.ball)] + scene_.share(group.ball);
  for (int d = 0; d < 3; ++d) square += (ball.at[d] - group.at[d]) * (ball.at[d] - group.at[d]);
  const double room = group.skin * group.reach - (reach - group.reach);
  ++group.age;
  if (!group.known || scene_.margin->per_contactor || !(room >= 0) || !(square <= room * room)) {
    if (group.known && group.age < often) group.skin = std::min(2 * group.skin, most_skin);
    if (group.known && group.age > seldom) group.skin = std::max(group.skin / 2, least_skin);
    group.known = true;
    group.age = 0;
    group.close = 0;
    group.reach = reach;
    std::copy_n(ball.at, 3, group.at);
    for (std::int64_t n = group.first; n < group.last; ++n)
      if (const std::int64_t p = listed_[std::size_t(n)]; !is_far(found, p, ball, (1 + group.skin) * reach, false))
        close_[std::size_t(group.first + group.close++)] = p;
  }
  for (std::int64_t n = group.first; n < group.first + group.close; ++n)
    may_touch_[std::size_t(n)] = !is_far(found, close_[std::size_t(n)], ball, reach, true);
}

void NearFacets::find(const OrderedPairs& found) {
  const auto count = std::int64_t(groups_.size());
#pragma omp parallel for schedule(static) if (count > 1024)
  for (std::int64_t g = 0; g < count; ++g) look_at(found, groups_[std::size_t(g)]);
  near_.begin(kinds);
  std::size_t g = 0;
  for (int kind = 0; kind < kinds; ++kind) {
    if (pair_kinds[kind].hull_contact && pair_kinds[kind].hull_contact != cairn_pair_sphere_facet)
      near_.append(found, found.begin_of(kind), found.kind_end[std::size_t(kind)]);
    for (; g < kind_groups_[std::size_t(kind)]; ++g)
      for (std::int64_t n = groups_[g].first; n < groups_[g].first + groups_[g].close; ++n)
        if (may_touch_[std::size_t(n)]) near_.append(found, close_[std::size_t(n)], close_[std::size_t(n)] + 1);
    near_.kind_end[std::size_t(kind)] = near_.count();
  }
}

} // namespace cairn::detection
