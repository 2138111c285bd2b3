// A node on the rim of a face has a tributary area of half a cell, and pressed bodies bulge: the rim of one body slides
// slightly past the rim of the other. No side holds the node there, and its load would go to its neighbours, until the
// body sinks past the rim. So a node that was over a side at the begin of the step, or held at its rim, stays on the
// plane of that side up to a share of its own cell beyond the rim; likewise a node that arrives from in front, if a
// side of its own mesh that faces the other reaches in over the rim. A node that arrives from beside has no such side
// and was never over the other, so it falls past; so does a node that slides on.
#include "rims.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "../base/vectors.hpp"
#include "pair_kinds.hpp"

namespace cairn::detection {

// Nodes that are over a flat side that they may touch: those that may slide past its rim in the step.
void RimContacts::note_seats(Candidates& out) const {
  FlatSide& side = seen_side_;
  double x[3] = {0, 0, 0}, way[3] = {0, 0, 0};
  bool rim = false;
  for (std::int64_t i = 0; i < out.count; ++i) {
    const std::int32_t a = out.contactor_a[i], b = out.contactor_b[i];
    if (!scene_.is_mapped_point(a)) continue;
    const double hair = scene_.mapped->hair[std::size_t(scene_.mapped->place[std::size_t(a)])];
    const int faces = sides_.count(b);
    scene_.from_centre(a, b, out.image[i], x);
    for (int face = 0; face < faces; ++face) {
      sides_.view(b, face, side);
      if (scene_.dim == 2 && std::none_of(side.corner.begin(), side.corner.end(), [](const auto& c) { return c.rim; }))
        continue;
      if (!(dot(side.normal, &out.normal[scene_.dim * i], scene_.dim) > alike)) continue;
      const double height = dot(side.normal, x, scene_.dim) - side.offset;
      if (std::abs(height - out.gap[i]) <= on_rim * hair && sides_.beyond(side, x, rim, way) <= on_rim * hair)
        out.seats.push_back({a, b, face});
    }
  }
}

// The side of what bore the node, among those within its reach, that it slid past the rim of.
bool RimContacts::past_its_rim(const OrderedPairs& pairs, const RimSeat& seat, HeldNode& held) const {
  const auto node = std::int32_t(seat.node), was = std::int32_t(seat.side);
  const double hair = scene_.mapped->hair[std::size_t(scene_.mapped->place[std::size_t(node)])];
  FlatSide &before = seen_before_, &side = seen_side_;
  sides_.view(was, seat.face, before);
  double least = hair, x[3] = {0, 0, 0}, way[3] = {0, 0, 0};
  bool found = false, rim = false;
  const bool all = each_pair_of(pairs, node, [&](std::int64_t p, int kind) {
    const std::int32_t b = pairs.b[p], image_of = pairs.image[p] & image_bits;
    if (scene_.carrier[b] != scene_.carrier[was]) return true;
    if (pairs.image[p] & declared_bit) return false; // it is held by its bond
    scene_.from_centre(node, b, image_of, x);
    for (int face = 0; face < sides_.count(b); ++face) {
      sides_.view(b, face, side);
      if (!(dot(side.normal, before.normal, scene_.dim) > alike)) continue;
      const double height = dot(side.normal, x, scene_.dim) - side.offset, far = sides_.beyond(side, x, rim, way);
      if (far <= on_rim * hair && height >= -hair) return false; // it is over it
      if (!rim || !(far < least) || !(height >= -hair) || !(height <= scene_.share(node) + scene_.share(b))) continue;
      least = far;
      found = true;
      held = {node, b, face, kind, image_of, height, {}, {}};
      std::copy_n(side.normal, 3, held.normal);
      std::copy_n(way, 3, held.way);
    }
    return true;
  });
  if (!all) return false;
  if (!found || !scene_.same_mesh(node, held.side)) return found;
  return held.gap >= -scene_.mapped->apart_depth[std::size_t(scene_.mapped->place[std::size_t(held.side)])];
}

// A node that comes from in front past a rim, over which a side of its own reaches.
bool RimContacts::comes_past_a_rim(const OrderedPairs& pairs, int kind, std::int64_t first, std::int64_t last,
                                   HeldNode& held) const {
  const std::int32_t node = pairs.a[first];
  const double hair = scene_.mapped->hair[std::size_t(scene_.mapped->place[std::size_t(node)])];
  FlatSide& side = seen_side_;
  double x[3] = {0, 0, 0}, way[3] = {0, 0, 0}, least = hair;
  bool rim = false, found = false;
  for (std::int64_t p = first; p < last; ++p) {
    const std::int32_t b = pairs.b[p], image_of = pairs.image[p] & image_bits;
    if (pairs.image[p] & declared_bit) return false;
    scene_.from_centre(node, b, image_of, x);
    for (int face = 0; face < sides_.count(b); ++face) {
      sides_.view(b, face, side);
      const double height = dot(side.normal, x, scene_.dim) - side.offset;
      if (!(height >= -on_rim * hair) || !(height <= scene_.share(node) + scene_.share(b))) continue;
      const double far = sides_.beyond(side, x, rim, way);
      if (far <= on_rim * hair) return false; // it is over one
      if (!rim || !(far < least) || !nodes_.reaches_back(node, side.normal, way, far)) continue;
      least = far;
      found = true;
      held = {node, b, face, kind, image_of, height, {}, {}};
      std::copy_n(side.normal, 3, held.normal);
      std::copy_n(way, 3, held.way);
    }
  }
  return found;
}

// Holds a node at a side, unless it is held at that surface, or a contact carries it there.
void RimContacts::consider(const Candidates& out, const HeldNode& node) {
  const auto same_surface = [&](const HeldNode& other) {
    return node.node == other.node && scene_.carrier[node.side] == scene_.carrier[other.side] &&
           dot(node.normal, other.normal, scene_.dim) > alike;
  };
  if (std::any_of(held_.begin(), held_.end(), same_surface)) return;
  contacts_.fill(scene_, out);
  if (!bears_as_high(out, node) && (scene_.for_bonds || !is_met_there(out, node))) held_.push_back(node);
}

// Nodes at edges between two sides.
void RimContacts::consider_met(const OrderedPairs& pairs, const Candidates& out) {
  HeldNode h;
  for (std::int64_t i = 0; i < out.count; ++i) {
    if (!scene_.is_mapped_point(out.contactor_a[i]) || sides_.count(out.contactor_b[i]) == 0) continue;
    if (nodes_.lies_on_another(pairs, met_node(out, scene_.dim, i), h)) consider(out, h);
  }
}

// Nodes that slid past a rim or come in front of one.
void RimContacts::consider_slid(const OrderedPairs& pairs, std::span<const RimSeat> before,
                                std::span<const HeldNode> met, const Candidates& out) {
  HeldNode h;
  for (const HeldNode& one : met)
    if (nodes_.lies_on_another(pairs, one, h)) consider(out, h);
  for (const RimSeat& seat : before)
    if (!std::binary_search(out.seats.begin(), out.seats.end(), seat) && past_its_rim(pairs, seat, h)) consider(out, h);
  std::int64_t end = 0;
  for (int kind = 0; kind < kinds; ++kind)
    for (std::int64_t first = end, last; first < pairs.kind_end[std::size_t(kind)]; first = end) {
      const std::int32_t node = pairs.a[first];
      for (last = first; last < pairs.kind_end[std::size_t(kind)] && pairs.a[last] == node; ++last) {}
      end = last;
      if (scene_.is_mapped_point(node) && comes_past_a_rim(pairs, kind, first, last, h)) consider(out, h);
    }
}

// Bonds begin between a node and the side that its cells lie on, whether or not a contact at the opposite node carries
// the load of both.
void RimContacts::hold(const OrderedPairs& pairs, std::span<const RimSeat> before, std::span<const HeldNode> met,
                       DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out) {
  out.seats.clear();
  if (!scene_.mapped) return;
  note_seats(out);
  std::sort(out.seats.begin(), out.seats.end());
  held_.clear();
  contacts_.clear();
  consider_met(pairs, out);
  if (!scene_.for_bonds) consider_slid(pairs, before, met, out);
  if (!held_.empty()) {
    const auto order = [](const HeldNode& h) { return std::array<std::int64_t, 4>{h.kind, h.node, h.side, h.image}; };
    std::sort(held_.begin(), held_.end(), [&](const auto& one, const auto& two) { return order(one) < order(two); });
    put_held(out);
    contacts_.clear();
  }
  if (!scene_.for_bonds) drop_hidden(pairs, declared, dropped, out);
  out.seats.clear();
  if (scene_.for_bonds) return;
  note_seats(out);
  for (const HeldNode& one : held_) out.seats.push_back({one.node, one.side, one.face});
  std::sort(out.seats.begin(), out.seats.end());
  out.seats.erase(std::unique(out.seats.begin(), out.seats.end()), out.seats.end());
}

// True if a node of the opposite surface lies on a side of the node's own mesh, equally near: that contact carries the
// load of both.
bool RimContacts::is_met_there(const Candidates& out, const HeldNode& h) const {
  const auto k = std::size_t(scene_.mapped->place[std::size_t(h.node)]);
  if (scene_.mapped->sides.empty()) return false;
  const double hair = scene_.mapped->hair[k];
  for (std::int64_t s = scene_.mapped->sides_start[k]; s < scene_.mapped->sides_start[k + 1]; ++s) {
    for (const auto& [side, i] : contacts_.on_side(scene_.mapped->sides[std::size_t(s)])) {
      const std::int32_t other = out.contactor_a[i];
      double x[3] = {0, 0, 0};
      scene_.from_centre(other, h.node, out.image[i], x);
      if (scene_.same_mesh(other, h.side) && dot(x, x, scene_.dim) <= hair * hair) return true;
    }
  }
  return false;
}

// True if another contact of the node carries it at the height of the side's plane, or above; a bond to one body holds
// the node beside that to another.
bool RimContacts::bears_as_high(const Candidates& out, const HeldNode& h) const {
  const double hair = scene_.mapped->hair[std::size_t(scene_.mapped->place[std::size_t(h.node)])];
  for (const auto& [node, i] : contacts_.of_node(h.node)) {
    if (!(dot(&out.normal[scene_.dim * i], h.normal, scene_.dim) > alike)) continue;
    if (scene_.for_bonds && scene_.carrier[out.contactor_b[i]] != scene_.carrier[h.side]) continue;
    const RimSeat over{h.node, out.contactor_b[i], 0};
    const auto at = std::lower_bound(out.seats.begin(), out.seats.end(), over);
    if (at == out.seats.end() || at->node != over.node || at->side != over.side) continue;
    if (out.gap[i] <= h.gap + on_rim * hair) return true;
  }
  return false;
}

// True if a contact of a held node would stop it on its way back, or is of the same pair.
bool RimContacts::hinders(const Candidates& out, std::int64_t i, const HeldNode& h) const {
  if (scene_.carrier[out.contactor_b[i]] != scene_.carrier[h.side]) return false;
  if (out.contactor_b[i] == h.side && out.image[i] == h.image) return true;
  const double hair = scene_.mapped->hair[std::size_t(scene_.mapped->place[std::size_t(h.node)])];
  return std::abs(out.gap[i]) <= hair && dot(&out.normal[scene_.dim * i], h.way, scene_.dim) > unlike_side;
}

// Inserts contacts of held nodes in the order of detection, in place of contacts of the same pairs and of those that
// would stop the node on its way back.
void RimContacts::put_held(Candidates& out) {
  Candidates& all = with_held_;
  for (Array<std::int32_t>* ids : {&all.contactor_a, &all.contactor_b, &all.feature, &all.image}) ids->resize(0);
  for (Array<double>* numbers : {&all.gap, &all.normal, &all.point}) numbers->resize(0);
  const auto kind_of = [&](std::int32_t a, std::int32_t b) {
    return kind_table.kind[scene_.contactors->shape.values[a] + shapes * scene_.contactors->shape.values[b]];
  };
  const auto copy = [&](std::int64_t i) {
    all.contactor_a.push_back(out.contactor_a[i]);
    all.contactor_b.push_back(out.contactor_b[i]);
    all.feature.push_back(out.feature[i]);
    all.image.push_back(out.image[i]);
    all.gap.push_back(out.gap[i]);
    all.normal.insert(all.normal.end(), &out.normal[scene_.dim * i], &out.normal[scene_.dim * i] + scene_.dim);
    all.point.insert(all.point.end(), &out.point[scene_.dim * i], &out.point[scene_.dim * i] + scene_.dim);
  };
  const auto put = [&](const HeldNode& h) {
    all.contactor_a.push_back(h.node);
    all.contactor_b.push_back(h.side);
    all.feature.push_back(0);
    all.image.push_back(h.image);
    all.gap.push_back(h.gap);
    all.normal.insert(all.normal.end(), h.normal, h.normal + scene_.dim);
    for (int k = 0; k < scene_.dim; ++k)
      all.point.push_back(scene_.centre[std::int64_t(scene_.dim) * h.node + k] - h.gap / 2 * h.normal[k]);
  };
  std::vector<std::uint8_t>& gone = hinders_;
  gone.assign(std::size_t(out.count), 0);
  for (const HeldNode& h : held_)
    for (const auto& [node, i] : contacts_.of_node(h.node)) gone[std::size_t(i)] |= hinders(out, i, h);
  std::size_t next = 0;
  for (std::int64_t i = 0; i < out.count; ++i) {
    const std::array<std::int64_t, 4> at = {kind_of(out.contactor_a[i], out.contactor_b[i]), out.contactor_a[i],
                                            out.contactor_b[i], out.image[i]};
    for (; next < held_.size(); ++next) {
      const HeldNode& h = held_[next];
      if (!(std::array<std::int64_t, 4>{h.kind, h.node, h.side, h.image} < at)) break;
      put(h);
    }
    if (!gone[std::size_t(i)]) copy(i);
  }
  for (; next < held_.size(); ++next) put(held_[next]);
  all.count = std::int64_t(all.contactor_a.size());
  std::swap(all.seats, out.seats);
  std::swap(all, out);
}

// Contacts of nodes with sides of a body that others hide, where the node lies on one of these.
void RimContacts::drop_hidden(const OrderedPairs& pairs, DeclaredPairs& declared, DroppedContacts& dropped,
                              Candidates& out) {
  contacts_.fill(scene_, out);
  const std::span<const ContactsOfNodes::Entry> all = contacts_.all();
  dropped.begin(out);
  bool any = false;
  for (std::size_t from = 0, to = 0; from < all.size(); from = to) {
    const std::int32_t node = all[from].first;
    for (to = from; to < all.size() && all[to].first == node; ++to) {}
    for (std::size_t k = from; k < to && to - from > 1; ++k)
      for (std::size_t other = from; other < to; ++other) {
        const std::int64_t i = all[k].second, j = all[other].second;
        if (dropped[i] || dropped[j] || !nodes_.hides(pairs, out, j, i)) continue;
        dropped[i] = 1;
        any = true;
      }
  }
  if (!any) return;
  dropped.spare(declared, scene_, out);
  dropped.remove(out, scene_.dim);
}

} // namespace cairn::detection
