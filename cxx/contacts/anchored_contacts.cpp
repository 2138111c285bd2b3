// Anchored bonds: bonds of bodies with sides hold at material points of both bodies. Detection renames the contact
// points of a face when bodies slide, turn or bend a little, and a bond would be lost with its name; gaps between the
// points themselves tell openings and slips of a joint, gaps of faces do not. Broken bonds are left to detection again.
#include "anchored_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "../base/held_bytes.hpp"
#include "../contactors/shapes.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "body_axes.hpp"
#include "face_overlap.hpp"

namespace cairn {

void AnchoredContacts::measure(const Bodies& bodies, const Contactors& contactors, const LawTable& laws,
                               const Cell& cell, std::span<const std::int32_t> numbers, Candidates& found,
                               MeshSet* meshes, Nodes* nodes) {
  const ContactMemory& m = memory_;
  anchor_of_.clear();
  held_.clear();
  places_.clear();
  ropes_.find(contactors, laws);
  for (std::size_t k = 0; k < m.anchors.size(); ++k) {
    const std::int32_t a = numbers[2 * k], b = numbers[2 * k + 1];
    if (m.anchors[k].reach < 0 || a < 0 || b < 0) continue;
    const int entry = laws.find(*contactors.material[a], *contactors.material[b]);
    if (entry < 0) continue;
    const LawInfo& law = law_infos()[std::size_t(laws.entry(entry).law)];
    if (!law.anchored) continue;
    if (ropes_.has_lost_end(*contactors.material[a])) continue;
    const bool sound = m.states[k * std::size_t(m.state_components)] > 0;
    const bool spans = law.spans || (law.joins && laws.entry(entry).params[joint_spans] > 0);
    places_.push_back({a, b, m.keys[k].image, m.keys[k].feature, std::int32_t(k), sound, spans, law.joins});
  }
  // without anchors, numbers are given where meshes may be bonded to each other
  if (places_.empty() && (numbers.empty() || !m.anchors.empty() || !meshes)) return;
  in_.bodies = &bodies;
  in_.contactors = &contactors;
  in_.cell = &cell;
  in_.meshes = meshes && !meshes->empty() ? meshes : nullptr;
  in_.nodes = nodes;
  const auto pair_of = [](const auto& p) { return std::tuple(p.a, p.b, p.image); };
  std::sort(places_.begin(), places_.end(), [&](const auto& p, const auto& q) {
    return pair_of(p) != pair_of(q) ? pair_of(p) < pair_of(q) : ~p.feature < ~q.feature;
  });
  find_bonds_on_surfaces();
  find_bonded_nodes(laws, numbers);
  if (places_.empty() && bonded_nodes_.empty()) return;
  Candidates& to = measured_;
  const std::size_t most = std::size_t(found.count) + places_.size();
  for (auto* column : {&to.contactor_a, &to.contactor_b, &to.image, &to.feature}) fit(*column, most);
  fit(to.gap, most);
  fit(to.normal, most * std::size_t(in_.dim()));
  fit(to.point, most * std::size_t(in_.dim()));
  to.count = 0;
  const std::span<const Place> all = places_;
  // pairs in the order of detection, behind them those that it did not find
  std::vector<std::uint8_t>& seen = seen_;
  fit(seen, all.size());
  std::fill(seen.begin(), seen.end(), 0);
  for (std::int64_t i = 0, end = 0; i < found.count; i = end) {
    const std::tuple pair(found.contactor_a[i], found.contactor_b[i], found.image[i]);
    for (end = i + 1;
         end < found.count && std::tuple(found.contactor_a[end], found.contactor_b[end], found.image[end]) == pair;)
      ++end;
    const auto first = std::lower_bound(all.begin(), all.end(), pair,
                                        [&](const auto& p, const auto& wanted) { return pair_of(p) < wanted; });
    auto last = first;
    while (last != all.end() && pair_of(*last) == pair) seen[std::size_t(last++ - all.begin())] = 1;
    measure_pair({first, last}, i, end, found);
  }
  for (std::size_t i = 0; i < all.size(); ++i)
    if (!seen[i]) measure_pair(all.subspan(i, 1), 0, 0, found);
  for (auto* column : {&to.contactor_a, &to.contactor_b, &to.image, &to.feature}) column->resize(std::size_t(to.count));
  to.gap.resize(std::size_t(to.count));
  to.normal.resize(std::size_t(to.count) * std::size_t(in_.dim()));
  to.point.resize(std::size_t(to.count) * std::size_t(in_.dim()));
  std::swap(found.seats, to.seats); // those of this detection stay with it
  std::swap(found, to);
  if (places_.empty()) anchor_of_.clear();
}

// True for triangles of a rigid body and sides of a mesh: they form a surface, named by its body or mesh.
bool AnchoredContacts::is_of_surface(std::int32_t side) const {
  return in_.body(side) >= 0 ? info(Shape(*in_.contactors->shape[side])).facet() : in_.meshes->turns(side);
}

std::int32_t AnchoredContacts::surface_of(std::int32_t side) const {
  return in_.body(side) >= 0 ? in_.body(side) : -1 - in_.meshes->mesh_of(side);
}

// Bonds on surfaces, sorted by contactor and surface.
void AnchoredContacts::find_bonds_on_surfaces() {
  on_surfaces_.clear();
  for (const Place& p : places_)
    if (p.sound && !p.joins && is_of_surface(p.b) && memory_.anchors[std::size_t(p.key)].reach > 0)
      on_surfaces_.push_back(p);
  std::sort(on_surfaces_.begin(), on_surfaces_.end(), [&](const Place& p, const Place& q) {
    return std::tuple(p.a, surface_of(p.b), p.image, p.key) < std::tuple(q.a, surface_of(q.b), q.image, q.key);
  });
}

// Nodes of meshes that bonds hold on flat sides of bodies, and on other meshes by laws that give way under pressure.
void AnchoredContacts::find_bonded_nodes(const LawTable& laws, std::span<const std::int32_t> numbers) {
  bonded_nodes_.clear();
  const auto is_node = [&](std::int32_t side) { return in_.body(side) < 0 && in_.meshes->middle(side).node[1] < 0; };
  for (const Place& p : places_)
    if (p.sound && !p.joins && !p.spans && in_.body(p.b) >= 0 && is_node(p.a))
      bonded_nodes_.emplace_back(in_.body(p.b), in_.meshes->middle(p.a).node[0]);
  for (std::size_t k = 0; in_.meshes && k < numbers.size() / 2; ++k) {
    const std::int32_t a = numbers[2 * k], b = numbers[2 * k + 1];
    if (a < 0 || b < 0 || in_.body(a) >= 0 || in_.body(b) >= 0) continue;
    const int entry = laws.find(*in_.contactors->material[a], *in_.contactors->material[b]);
    if (entry < 0 || !law_infos()[std::size_t(laws.entry(entry).law)].holds_broken ||
        !(memory_.states[k * std::size_t(memory_.state_components)] > 0))
      continue;
    for (const auto& [node, bearer] : {std::pair(a, b), std::pair(b, a)})
      if (is_node(node)) bonded_nodes_.emplace_back(surface_of(bearer), in_.meshes->middle(node).node[0]);
  }
  std::sort(bonded_nodes_.begin(), bonded_nodes_.end());
}

// True if bonds between nodes of one body and sides of the other hold a contact from detection already, which has a
// side of the first.
bool AnchoredContacts::is_held_by_nodes(std::int64_t i, const Candidates& found) const {
  if (bonded_nodes_.empty()) return false;
  const std::int32_t a = found.contactor_a[i], b = found.contactor_b[i];
  return (in_.body(a) < 0 && is_held_by_nodes(a, b, i, found)) || (in_.body(b) < 0 && is_held_by_nodes(b, a, i, found));
}

// True if all nodes that carry a side of a mesh at its contact with a body are bonded to that body. The bonds leave
// only rounding to such a contact; as its normal and gap differ from theirs, its impulses would diverge against them.
// Between two meshes one bonded node suffices: the bonds of a joint share the whole area of its faces.
bool AnchoredContacts::is_held_by_nodes(std::int32_t side, std::int32_t other, std::int64_t i,
                                        const Candidates& found) const {
  constexpr double some = 1.0 / 64; // of the weight of a node
  if (!in_.meshes->turns(side)) return false;
  double shift[3] = {0, 0, 0}, point[3] = {0, 0, 0};
  if (in_.cell->any() && side == found.contactor_b[i]) image_shift(*in_.cell, found.image[i], shift);
  for (int k = 0; k < 3 && k < in_.dim(); ++k) point[k] = found.point[in_.dim() * i + k] - shift[k];
  const bool meshes = in_.body(other) < 0;
  const Mapping m = in_.meshes->mapping(*in_.nodes, side, point, meshes ? other : -1);
  const std::int32_t first = in_.meshes->meshes[std::size_t(m.mesh)].first_node(), bearer = surface_of(other);
  for (int j = 0; j < 4 && m.node[j] >= 0; ++j) {
    if (std::abs(m.weight[j]) <= some) continue;
    const bool bonded =
        std::binary_search(bonded_nodes_.begin(), bonded_nodes_.end(), std::pair(bearer, first + m.node[j]));
    if (bonded == meshes) return bonded;
  }
  return !meshes;
}

// True if a contact of a body with a triangle is a corner that a bond holds on the neighbouring triangle: rounding
// decides to which of two triangles a corner above their edge belongs.
bool AnchoredContacts::is_held_beside(std::int64_t i, const Candidates& found) const {
  constexpr double bends = 0.75;    // cosine between sides of a mesh, which bend
  constexpr double near = 1.0 / 64; // of the size of the body
  const std::int32_t a = found.contactor_a[i], b = found.contactor_b[i];
  if (on_surfaces_.empty() || !is_of_surface(b)) return false;
  const int d = in_.dim();
  const std::tuple pair(a, surface_of(b), found.image[i]);
  auto at = std::lower_bound(on_surfaces_.begin(), on_surfaces_.end(), pair, [&](const Place& p, const auto& wanted) {
    return std::tuple(p.a, surface_of(p.b), p.image) < wanted;
  });
  for (; at != on_surfaces_.end() && std::tuple(at->a, surface_of(at->b), at->image) == pair; ++at) {
    const Anchor& anchor = memory_.anchors[std::size_t(at->key)];
    double from[3] = {}, normal[3] = {}, x[3] = {}, square = 0, alike = 0;
    in_.carried(a, anchor.a, from);
    in_.on_mesh_side(at->b) ? in_.normal_of_side(at->b, normal) : in_.carried(at->b, anchor.normal, normal);
    in_.carrier_at(a, x);
    for (int k = 0; k < d; ++k) {
      const double apart = found.point[d * i + k] - (x[k] + from[k]);
      square += apart * apart;
      alike += normal[k] * found.normal[d * i + k];
    }
    const double size = near * *in_.contactors->radius[in_.body(a) < 0 ? b : a];
    if (at->b != b && square <= size * size && alike > (in_.body(b) < 0 ? bends : flat_faces)) return true;
  }
  return false;
}

// Contacts of one pair: sound anchored bonds first, then contacts from detection, of which the nearest inherits the
// state of a broken bond.
void AnchoredContacts::measure_pair(std::span<const Place> places, std::int64_t first, std::int64_t last,
                                    const Candidates& found) {
  const int d = in_.dim();
  Candidates& to = measured_;
  const std::int64_t begin = to.count;
  for (const Place& p : places) {
    if (!p.sound) continue;
    const Anchor& anchor = memory_.anchors[std::size_t(p.key)];
    const std::int64_t i = to.count++;
    to.contactor_a[i] = p.a;
    to.contactor_b[i] = p.b;
    to.image[i] = p.image;
    to.feature[i] = p.feature;
    double a[3] = {}, normal[3] = {}, xa[3] = {}, between[3] = {}, square = 0, along = 0;
    in_.carried(p.a, anchor.a, a);
    in_.on_mesh_side(p.b) ? in_.normal_of_side(p.b, normal) : in_.carried(p.b, anchor.normal, normal);
    in_.carrier_at(p.a, xa);
    in_.between_ends(p.a, p.b, p.image, anchor, between);
    // a node does not turn with the other end: slip along it is measured at A's end, not half way
    const double share = p.joins && (in_.body(p.a) < 0 || in_.body(p.b) < 0) ? 0 : 0.5;
    for (int k = 0; k < d; ++k) {
      square += between[k] * between[k];
      to.point[d * i + k] = xa[k] + a[k] - share * between[k];
    }
    if (p.spans && square > 0)
      for (int k = 0; k < d; ++k) normal[k] = between[k] / std::sqrt(square);
    for (int k = 0; k < d; ++k) along += between[k] * normal[k];
    to.gap[i] = p.joins ? 0 : along;
    std::copy_n(normal, d, &to.normal[d * i]);
    anchor_of_.push_back(std::int32_t(held_.size()));
    held_.push_back(anchor);
  }
  const auto distance = [&](std::int64_t i, std::int64_t j) {
    double square = 0;
    for (int k = 0; k < d; ++k)
      square += (found.point[d * i + k] - to.point[d * j + k]) * (found.point[d * i + k] - to.point[d * j + k]);
    return std::sqrt(square);
  };
  const std::int64_t others = to.count;
  // between flat faces that hold at all their points nothing else can touch
  bool whole = others > begin;
  for (std::int64_t j = begin; j < others; ++j)
    whole =
        whole && !in_.on_mesh_side(to.contactor_b[j]) && of(j).reach > 0 && of(j).siblings <= double(others - begin);
  for (std::int64_t i = first; i < last; ++i) {
    bool stands = whole;
    for (std::int64_t j = begin; j < others && !stands; ++j) stands = distance(i, j) <= of(j).reach && of(j).reach > 0;
    if (stands || is_held_beside(i, found) || is_held_by_nodes(i, found)) continue;
    const std::int64_t j = to.count++;
    to.contactor_a[j] = found.contactor_a[i];
    to.contactor_b[j] = found.contactor_b[i];
    to.image[j] = found.image[i];
    to.feature[j] = found.feature[i];
    to.gap[j] = found.gap[i];
    std::copy_n(&found.normal[d * i], d, &to.normal[d * j]);
    std::copy_n(&found.point[d * i], d, &to.point[d * j]);
    anchor_of_.push_back(-1);
  }
  for (const Place& p : places) {
    if (p.sound) continue;
    double x[3] = {}, at_a[3] = {}, least = std::numeric_limits<double>::max();
    in_.carried(p.a, memory_.anchors[std::size_t(p.key)].a, x);
    in_.carrier_at(p.a, at_a);
    std::int64_t heir = -1;
    for (std::int64_t j = others; j < to.count; ++j) {
      if (anchor_of_[std::size_t(j)] != -1) continue;
      double square = 0;
      for (int k = 0; k < d; ++k) {
        const double apart = to.point[d * j + k] - (at_a[k] + x[k]);
        square += apart * apart;
      }
      if (square < least) least = square, heir = j;
    }
    if (heir >= 0) anchor_of_[std::size_t(heir)] = -2 - p.key;
  }
}

std::int64_t AnchoredContacts::bytes() const {
  return held_bytes(held_, anchor_of_, places_, measured_.point, measured_.normal, measured_.gap);
}

} // namespace cairn
