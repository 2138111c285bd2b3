// Anchored bonds: bonds of bodies with sides hold at material points of both bodies. Detection renames the contact
// points of a face when bodies slide, turn or bend a little, and a bond would be lost with its name; gaps between the
// points themselves tell openings and slips of a joint, gaps of faces do not. Broken bonds are left to detection again.
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "../contactors/shapes.hpp"
#include "body_axes.hpp"
#include "face_overlap.hpp"
#include "interaction_state.hpp"

namespace cairn {

// Makes the anchor of candidate i, for the last key of the memory. Shapes are taken as they are: a bent body carries
// the point as one of its present shape.
void Interactions::State::anchor(std::int64_t i, const LawInfo& law) {
  const Candidates& c = *candidates;
  const std::int32_t ca = c.contactor_a[i], cb = c.contactor_b[i];
  const auto flat = [&](std::int32_t of) { return info(Shape(*contactors->shape[of])).is_hull(); };
  const bool of_bodies = !((kind[ca] | kind[cb]) & mapped) && flat(ca);
  // a node beside the rim of a side would be held by the corner, askew
  const bool of_node = kind[ca] & mapped && !(kind[cb] & mapped) && flat(cb) && !meshes->turns(ca);
  const bool of_side = !law.spans && !(kind[ca] & mapped) && kind[cb] & mapped && flat(ca) && meshes->turns(cb);
  if (!law.joins && !of_bodies && !of_side && !(of_node && !(*contactors->radius[ca] > 0))) return;
  Anchor made;
  memory.joints_came |= law.joins;
  law.joins ? anchor_joint(i, made) : anchor_bond(i, law, made);
  memory.keys.back().feature = ~memory.keys.back().feature; // none of those that detection gives
  memory.anchors.resize(memory.keys.size());
  memory.anchors.back() = made;
}

void Interactions::State::anchor_bond(std::int64_t i, const LawInfo& law, Anchor& made) const {
  const Candidates& c = *candidates;
  const std::int32_t ca = c.contactor_a[i], cb = c.contactor_b[i];
  const int d = dim() == 2 ? 2 : 3;
  double shift[3] = {0, 0, 0}, from_a[3] = {}, from_b[3] = {};
  if (cell->any()) image_shift(*cell, c.image[i], shift);
  const double* point = &c.point[d * i];
  double xa[3] = {}, xb[3] = {}, normal[3] = {}, gap = c.gap[i];
  std::copy_n(&c.normal[d * i], d, normal);
  carrier_at(ca, xa);
  if (body(cb) >= 0) carrier_at(cb, xb);
  for (int k = 0; k < d; ++k) {
    from_a[k] = point[k] + gap / 2 * normal[k] - xa[k];
    from_b[k] = point[k] - gap / 2 * normal[k] - (xb[k] + shift[k]);
  }
  if (body(ca) < 0) face_of_node(ca, cb, shift, normal, from_b);
  if (body(ca) >= 0) to_body_axes(*bodies, d, body(ca), from_a, made.a); // nodes carry their end without a lever
  if (body(cb) >= 0) {
    to_body_axes(*bodies, d, body(cb), from_b, made.b);
    to_body_axes(*bodies, d, body(cb), normal, made.normal);
  } else {
    const Mapping at = meshes->mapping(*nodes, cb, from_b, ca);
    std::copy_n(at.weight, 3, made.b);
  }
  std::copy_n(made.a, 3, made.shape_a);
  std::copy_n(made.b, 3, made.shape_b);
  made.reach = law.spans ? 0 : std::numeric_limits<double>::max();
  made.siblings = 1;
  if (!law.holds) return;
  made.length = 1; // it knows how its bodies stood
  keep_turn(ca, cb, made);
}

// A node on the rim of a hull lies on several of its faces, and rounding says which detection took: it is held by the
// one that a side of its mesh lies on. normal: in space axes, from: the end on B, from its centre in space axes.
void Interactions::State::face_of_node(std::int32_t node, std::int32_t hull, const double* shift, double* normal,
                                       double* from) const {
  const int d = dim();
  const Hulls& hulls = contactors->hulls;
  const MappedContactors& mapped_sides = meshes->mapped();
  const std::int32_t which = *contactors->hull[hull], seat = mapped_sides.place[std::size_t(node)];
  if (hulls.form(which) != Hulls::Form::polygon && hulls.form(which) != Hulls::Form::polyhedron) return;
  if (mapped_sides.sides_start.empty()) return;
  const auto facing = [&](const double* face) { // how squarely a side at the node looks at it
    double most = -1;
    for (std::int64_t k = mapped_sides.sides_start[std::size_t(seat)];
         k < mapped_sides.sides_start[std::size_t(seat) + 1]; ++k) {
      double side[3], along = 0;
      normal_of_side(mapped_sides.sides[std::size_t(k)], side);
      for (int l = 0; l < d; ++l) along -= face[l] * side[l];
      most = std::max(most, along);
    }
    return most;
  };
  double x[3] = {}, centre[3] = {}, at_node[3] = {}, best = facing(normal) + 1.0 / 64;
  if (contactors->offset.active) to_space_axes(*bodies, d, body(hull), contactors->offset[hull], centre);
  carrier_at(node, at_node);
  for (int k = 0; k < d; ++k) x[k] = at_node[k] - (bodies->position[body(hull)][k] + shift[k]) - centre[k];
  const double near = 2 * touch * std::max(*contactors->radius[hull], meshes->meshes[meshes->mesh_of(node)].size());
  for (std::int32_t f = hulls.first_face[which]; f < hulls.first_face[which + 1]; ++f) {
    double face[3] = {}, distance = -hulls.offset[std::size_t(f)];
    to_space_axes(*bodies, d, body(hull), &hulls.normal[std::size_t(d) * std::size_t(f)], face);
    for (int k = 0; k < d; ++k) distance += face[k] * x[k];
    if (std::abs(distance) > near || !(facing(face) > best)) continue;
    best = facing(face);
    std::copy_n(face, d, normal);
    for (int k = 0; k < d; ++k) from[k] = x[k] + centre[k] - distance * face[k];
  }
}

// Carrier of a contactor: its position, and vectors of its axes in axes of space. A point of a mesh carries its end of
// a joint without a lever, and has the axes of space.
void Interactions::State::carrier_at(std::int32_t contactor, double* x) const {
  for (int k = 0; k < dim(); ++k)
    x[k] =
        body(contactor) < 0 ? meshes->middle(contactor).of(nodes->position, k) : bodies->position[body(contactor)][k];
}

void Interactions::State::carried(std::int32_t contactor, const double* own, double* out) const {
  if (body(contactor) >= 0) return to_space_axes(*bodies, dim(), body(contactor), own, out);
  for (int k = 0; k < dim(); ++k) out[k] = own[k];
}

// The end on A from that on B, which a side of a mesh carries by the weights of its nodes.
void Interactions::State::between_ends(std::int32_t ca, std::int32_t cb, std::int32_t image, const Anchor& anchor,
                                       double* between) const {
  const int d = dim();
  double shift[3] = {0, 0, 0}, a[3] = {}, b[3] = {}, xa[3] = {}, xb[3] = {};
  if (cell->any()) image_shift(*cell, image, shift);
  carried(ca, anchor.a, a);
  carrier_at(ca, xa);
  if (on_mesh_side(cb)) {
    const std::array<std::int32_t, 4> node = meshes->nodes_of_side(cb);
    const double weight[4] = {anchor.b[0], anchor.b[1], anchor.b[2], 1 - anchor.b[0] - anchor.b[1] - anchor.b[2]};
    for (int j = 0; j < 4 && node[std::size_t(j)] >= 0; ++j)
      for (int k = 0; k < d; ++k) xb[k] += weight[j] * nodes->position[node[std::size_t(j)]][k];
  } else {
    carried(cb, anchor.b, b);
    carrier_at(cb, xb);
  }
  for (int k = 0; k < d; ++k) between[k] = (xa[k] - (xb[k] + shift[k])) + (a[k] - b[k]);
}

// Half the way to the next anchored point of the pair. A rod stands for no point where bodies touch.
void Interactions::State::space_anchors(std::size_t first) {
  if (memory.anchors.empty()) return;
  memory.anchors.resize(memory.keys.size());
  const auto same_pair = [&](std::size_t i, std::size_t j) {
    const ContactKey &a = memory.keys[i], &b = memory.keys[j];
    return std::tie(a.contactor_a, a.contactor_b, a.image) == std::tie(b.contactor_a, b.contactor_b, b.image);
  };
  for (std::size_t i = first; i < memory.keys.size(); ++i)
    for (std::size_t j = i + 1; j < memory.keys.size() && same_pair(i, j); ++j) { // points of a pair stand together
      Anchor &one = memory.anchors[i], &other = memory.anchors[j];
      ++one.siblings;
      ++other.siblings;
      if (!(one.reach > 0) || !(other.reach > 0)) continue;
      double square = 0;
      for (int k = 0; k < dim(); ++k) square += (one.a[k] - other.a[k]) * (one.a[k] - other.a[k]);
      one.reach = std::min(one.reach, std::sqrt(square) / 2);
      other.reach = std::min(other.reach, std::sqrt(square) / 2);
    }
}

std::span<Anchor> Interactions::anchors() { return s_->memory.anchors; }

std::span<double> Interactions::states(std::size_t key) {
  const auto each = std::size_t(s_->memory.state_components);
  return std::span<double>(s_->memory.states).subspan(key * each, each);
}

void Interactions::measure_anchored(const Bodies& bodies, const Contactors& contactors, const LawTable& laws,
                                    const Cell& cell, std::span<const std::int32_t> numbers, Candidates& found,
                                    MeshSet* meshes, Nodes* nodes) {
  State& s = *s_;
  const ContactMemory& m = s.memory;
  s.anchor_of.clear();
  s.held.clear();
  s.anchored_places.clear();
  s.find_ropes(contactors, laws);
  for (std::size_t k = 0; k < m.anchors.size(); ++k) {
    const std::int32_t a = numbers[2 * k], b = numbers[2 * k + 1];
    if (m.anchors[k].reach < 0 || a < 0 || b < 0) continue;
    const int entry = laws.find(*contactors.material[a], *contactors.material[b]);
    if (entry < 0) continue;
    const LawInfo& law = law_infos()[std::size_t(laws.entry(entry).law)];
    if (!law.anchored) continue;
    if (!s.rope_of.empty() && s.rope_of[std::size_t(*contactors.material[a])].value_or(RopeEnds{0, 0, 0}).far < 0)
      continue; // the rope has lost its end
    const bool sound = m.states[k * std::size_t(m.state_components)] > 0;
    const bool spans = law.spans || (law.joins && laws.entry(entry).params[joint_spans] > 0);
    s.anchored_places.push_back({a, b, m.keys[k].image, m.keys[k].feature, std::int32_t(k), sound, spans, law.joins});
  }
  if (s.anchored_places.empty()) return;
  s.bodies = &bodies;
  s.contactors = &contactors;
  s.cell = &cell;
  s.meshes = meshes && !meshes->empty() ? meshes : nullptr;
  s.nodes = nodes;
  const auto pair_of = [](const auto& p) { return std::tuple(p.a, p.b, p.image); };
  std::sort(s.anchored_places.begin(), s.anchored_places.end(), [&](const auto& p, const auto& q) {
    return pair_of(p) != pair_of(q) ? pair_of(p) < pair_of(q) : ~p.feature < ~q.feature;
  });
  s.find_bonds_on_surfaces();
  s.find_bonded_nodes();
  Candidates& to = s.measured;
  const std::size_t most = std::size_t(found.count) + s.anchored_places.size();
  for (auto* column : {&to.contactor_a, &to.contactor_b, &to.image, &to.feature}) fit(*column, most);
  fit(to.gap, most);
  fit(to.normal, most * std::size_t(s.dim()));
  fit(to.point, most * std::size_t(s.dim()));
  to.count = 0;
  const std::span<const State::AnchoredPlace> all = s.anchored_places;
  // pairs in the order of detection, behind them those that it did not find
  std::vector<std::uint8_t>& seen = s.anchored_seen;
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
    s.measure_pair({first, last}, i, end, found);
  }
  for (std::size_t i = 0; i < all.size(); ++i)
    if (!seen[i]) s.measure_pair(all.subspan(i, 1), 0, 0, found);
  for (auto* column : {&to.contactor_a, &to.contactor_b, &to.image, &to.feature}) column->resize(std::size_t(to.count));
  to.gap.resize(std::size_t(to.count));
  to.normal.resize(std::size_t(to.count) * std::size_t(s.dim()));
  to.point.resize(std::size_t(to.count) * std::size_t(s.dim()));
  std::swap(found, to);
}

// True for triangles of a rigid body and sides of a mesh: they form a surface, named by its body or mesh.
bool Interactions::State::is_of_surface(std::int32_t side) const {
  return body(side) >= 0 ? Shape(*contactors->shape[side]) == Shape::facet : meshes->turns(side);
}

std::int32_t Interactions::State::surface_of(std::int32_t side) const {
  return body(side) >= 0 ? body(side) : -1 - meshes->mesh_of(side);
}

// Bonds on surfaces, sorted by contactor and surface.
void Interactions::State::find_bonds_on_surfaces() {
  on_surfaces.clear();
  for (const AnchoredPlace& p : anchored_places)
    if (p.sound && !p.joins && is_of_surface(p.b) && memory.anchors[std::size_t(p.key)].reach > 0)
      on_surfaces.push_back(p);
  std::sort(on_surfaces.begin(), on_surfaces.end(), [&](const AnchoredPlace& p, const AnchoredPlace& q) {
    return std::tuple(p.a, surface_of(p.b), p.image, p.key) < std::tuple(q.a, surface_of(q.b), q.image, q.key);
  });
}

// Nodes of meshes that bonds hold on flat sides of bodies.
void Interactions::State::find_bonded_nodes() {
  bonded_nodes.clear();
  for (const AnchoredPlace& p : anchored_places)
    if (p.sound && !p.joins && !p.spans && body(p.a) < 0 && body(p.b) >= 0 && meshes->middle(p.a).node[1] < 0)
      bonded_nodes.emplace_back(body(p.b), meshes->middle(p.a).node[0]);
  std::sort(bonded_nodes.begin(), bonded_nodes.end());
}

// True if all nodes that carry a side of a mesh at its contact with a body are bonded to that body. Only rounding is
// left to such a contact; as its normal and gap differ from those of the bonds, its impulses would diverge against
// them.
bool Interactions::State::is_held_by_nodes(std::int64_t i, const Candidates& found) const {
  constexpr double some = 1.0 / 64; // of the weight of a node
  const std::int32_t a = found.contactor_a[i], b = found.contactor_b[i];
  if (bonded_nodes.empty() || (body(a) < 0) == (body(b) < 0)) return false;
  const std::int32_t side = body(a) < 0 ? a : b, bearer = body(a) < 0 ? body(b) : body(a);
  if (!meshes->turns(side)) return false;
  double shift[3] = {0, 0, 0}, point[3] = {0, 0, 0};
  if (cell->any() && side == b) image_shift(*cell, found.image[i], shift);
  for (int k = 0; k < 3 && k < dim(); ++k) point[k] = found.point[dim() * i + k] - shift[k];
  const Mapping m = meshes->mapping(*nodes, side, point);
  const std::int32_t first = meshes->meshes[std::size_t(m.mesh)].first_node;
  for (int j = 0; j < 4 && m.node[j] >= 0; ++j)
    if (std::abs(m.weight[j]) > some &&
        !std::binary_search(bonded_nodes.begin(), bonded_nodes.end(), std::pair(bearer, first + m.node[j])))
      return false;
  return true;
}

// True if a contact of a body with a triangle is a corner that a bond holds on the neighbouring triangle: rounding
// decides to which of two triangles a corner above their edge belongs.
bool Interactions::State::is_held_beside(std::int64_t i, const Candidates& found) const {
  constexpr double bends = 0.75;    // cosine between sides of a mesh, which bend
  constexpr double near = 1.0 / 64; // of the size of the body
  const std::int32_t a = found.contactor_a[i], b = found.contactor_b[i];
  if (on_surfaces.empty() || !is_of_surface(b)) return false;
  const int d = dim();
  const std::tuple pair(a, surface_of(b), found.image[i]);
  auto at =
      std::lower_bound(on_surfaces.begin(), on_surfaces.end(), pair, [&](const AnchoredPlace& p, const auto& wanted) {
        return std::tuple(p.a, surface_of(p.b), p.image) < wanted;
      });
  for (; at != on_surfaces.end() && std::tuple(at->a, surface_of(at->b), at->image) == pair; ++at) {
    const Anchor& anchor = memory.anchors[std::size_t(at->key)];
    double from[3] = {}, normal[3] = {}, x[3] = {}, square = 0, alike = 0;
    carried(a, anchor.a, from);
    on_mesh_side(at->b) ? normal_of_side(at->b, normal) : carried(at->b, anchor.normal, normal);
    carrier_at(a, x);
    for (int k = 0; k < d; ++k) {
      const double apart = found.point[d * i + k] - (x[k] + from[k]);
      square += apart * apart;
      alike += normal[k] * found.normal[d * i + k];
    }
    const double size = near * *contactors->radius[body(a) < 0 ? b : a];
    if (at->b != b && square <= size * size && alike > (body(b) < 0 ? bends : flat_faces)) return true;
  }
  return false;
}

// Contacts of one pair: sound anchored bonds first, then contacts from detection, of which the nearest inherits the
// state of a broken bond.
void Interactions::State::measure_pair(std::span<const AnchoredPlace> places, std::int64_t first, std::int64_t last,
                                       const Candidates& found) {
  const int d = dim();
  Candidates& to = measured;
  const std::int64_t begin = to.count;
  for (const AnchoredPlace& p : places) {
    if (!p.sound) continue;
    const Anchor& anchor = memory.anchors[std::size_t(p.key)];
    const std::int64_t i = to.count++;
    to.contactor_a[i] = p.a;
    to.contactor_b[i] = p.b;
    to.image[i] = p.image;
    to.feature[i] = p.feature;
    double a[3] = {}, normal[3] = {}, xa[3] = {}, between[3] = {}, square = 0, along = 0;
    carried(p.a, anchor.a, a);
    on_mesh_side(p.b) ? normal_of_side(p.b, normal) : carried(p.b, anchor.normal, normal);
    carrier_at(p.a, xa);
    between_ends(p.a, p.b, p.image, anchor, between);
    // a node does not turn with the other end: slip along it is measured at A's end, not half way
    const double share = p.joins && (body(p.a) < 0 || body(p.b) < 0) ? 0 : 0.5;
    for (int k = 0; k < d; ++k) {
      square += between[k] * between[k];
      to.point[d * i + k] = xa[k] + a[k] - share * between[k];
    }
    if (p.spans && square > 0)
      for (int k = 0; k < d; ++k) normal[k] = between[k] / std::sqrt(square);
    for (int k = 0; k < d; ++k) along += between[k] * normal[k];
    to.gap[i] = p.joins ? 0 : along;
    std::copy_n(normal, d, &to.normal[d * i]);
    anchor_of.push_back(std::int32_t(held.size()));
    held.push_back(anchor);
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
    whole = whole && !on_mesh_side(to.contactor_b[j]) && held[std::size_t(anchor_of[std::size_t(j)])].reach > 0 &&
            held[std::size_t(anchor_of[std::size_t(j)])].siblings <= double(others - begin);
  for (std::int64_t i = first; i < last; ++i) {
    bool stands = whole;
    for (std::int64_t j = begin; j < others && !stands; ++j)
      stands = distance(i, j) <= held[std::size_t(anchor_of[std::size_t(j)])].reach &&
               held[std::size_t(anchor_of[std::size_t(j)])].reach > 0;
    if (stands || is_held_beside(i, found) || is_held_by_nodes(i, found)) continue;
    const std::int64_t j = to.count++;
    to.contactor_a[j] = found.contactor_a[i];
    to.contactor_b[j] = found.contactor_b[i];
    to.image[j] = found.image[i];
    to.feature[j] = found.feature[i];
    to.gap[j] = found.gap[i];
    std::copy_n(&found.normal[d * i], d, &to.normal[d * j]);
    std::copy_n(&found.point[d * i], d, &to.point[d * j]);
    anchor_of.push_back(-1);
  }
  for (const AnchoredPlace& p : places) {
    if (p.sound) continue;
    double x[3] = {}, at_a[3] = {}, least = std::numeric_limits<double>::max();
    carried(p.a, memory.anchors[std::size_t(p.key)].a, x);
    carrier_at(p.a, at_a);
    std::int64_t heir = -1;
    for (std::int64_t j = others; j < to.count; ++j) {
      if (anchor_of[std::size_t(j)] != -1) continue;
      double square = 0;
      for (int k = 0; k < d; ++k) {
        const double apart = to.point[d * j + k] - (at_a[k] + x[k]);
        square += apart * apart;
      }
      if (square < least) least = square, heir = j;
    }
    if (heir >= 0) anchor_of[std::size_t(heir)] = -2 - p.key;
  }
}

void Interactions::State::hand_on_broken() {
  for (std::size_t c = 0; c < system.candidate.size(); ++c)
    if (const std::int32_t i = system.candidate[c]; i >= 0 && place[c] < 0 && anchor_of[std::size_t(i)] <= -2)
      place[c] = -2 - anchor_of[std::size_t(i)];
}

void Interactions::State::keep_anchors() {
  if (held.empty()) return memory.anchors.clear();
  fit(memory.anchors, memory.keys.size());
  std::size_t to = 0;
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::int32_t which = anchor_of[std::size_t(system.candidate[b.first + lane])];
      memory.anchors[to++] = which >= 0 ? held[std::size_t(which)] : Anchor{};
    }
}

} // namespace cairn
