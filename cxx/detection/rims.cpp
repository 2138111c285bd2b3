// Nodes that slide past the rim of a flat side.
//
// A node on the rim of a face has a tributary area of half a cell, and pressed bodies bulge: the rim of one body slides
// slightly past the rim of the other. No side holds the node there, and its load would go to its neighbours, until the
// body sinks past the rim. So a node that was over a side at the begin of the step, or held at its rim, stays on the
// plane of that side up to a share of its own cell beyond the rim; likewise a node that arrives from in front, if a
// side of its own mesh that faces the other reaches in over the rim. A node that arrives from beside has no such side
// and was never over the other, so it falls past; so does a node that slides on.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "../base/cell.hpp"
#include "../base/vectors.hpp"
#include "flat_sides.hpp"

namespace cairn {

using namespace detection;

int InteractionHandler::Workspace::flat_sides(std::int32_t c) const {
  switch (Shape(contactors->shape.values[c])) {
  case Shape::segment: return mapped->place[std::size_t(c)] >= 0 ? 1 : 0; // others have round ends
  case Shape::facet: return 1;
  case Shape::polygon:
  case Shape::polyhedron: return contactors->hulls.faces(contactors->hull.values[c]);
  default: return 0;
  }
}

// An edge of a mesh in the plane, whose bar lies inside the body by its thickness.
void InteractionHandler::Workspace::view_edge(std::int32_t c, FlatSide& s) const {
  const double* e = &direction[3 * std::int64_t(c)];
  const auto k = std::size_t(mapped->place[std::size_t(c)]);
  s.normal[0] = e[1], s.normal[1] = -e[0];
  s.offset = contactors->radius.values[c];
  for (const int way : {-1, 1}) {
    const std::int32_t next = way < 0 ? mapped->before[k] : mapped->after[k];
    bool rim = next < 0;
    if (!rim) {
      const double* f = &direction[3 * std::int64_t(next)];
      rim = dot(e, f, 2) < alike && way * (e[0] * f[1] - e[1] * f[0]) > 0;
    }
    s.corner.push_back(
        {{way * e[2] * e[0] + s.offset * s.normal[0], way * e[2] * e[1] + s.offset * s.normal[1], 0}, rim});
  }
}

// A triangle of a surface: its edges, and the vertex beyond each, if there is one.
void InteractionHandler::Workspace::view_facet(std::int32_t c, FlatSide& s) const {
  const Hulls& h = contactors->hulls;
  const std::int32_t* edge = &h.edge[4 * std::size_t(h.first_edge[contactors->hull.values[c]])];
  for (int k = 0; k < 3; ++k) {
    const std::int32_t beyond = edge[4 * k + 3];
    FlatSide::Corner corner{};
    vertex_of(c, k, corner.x);
    corner.rim = beyond == 0;
    if (beyond > 0) {
      double e[3] = {0, 0, 0}, w[3] = {0, 0, 0}, next[3];
      vertex_of(c, (k + 1) % 3, e);
      vertex_of(c, beyond - 1, w);
      for (int i = 0; i < 3; ++i) e[i] -= corner.x[i], w[i] -= corner.x[i];
      cross(w, e, next);
      corner.rim = dot(s.normal, w, 3) < 0 && dot(s.normal, next, 3) < alike * std::sqrt(dot(next, next, 3));
    }
    s.corner.push_back(corner);
  }
}

// A side of a polygon, or a face of a polyhedron.
void InteractionHandler::Workspace::view_face(std::int32_t c, int face, FlatSide& s) const {
  const Hulls& h = contactors->hulls;
  const std::int32_t hull = contactors->hull.values[c];
  double other[3] = {0, 0, 0};
  FlatSide::Corner corner{};
  const auto put = [&](int vertex, int beside) {
    looks_of(c, beside, other);
    vertex_of(c, vertex, corner.x);
    corner.rim = dot(s.normal, other, dim) < alike;
    s.corner.push_back(corner);
  };
  if (dim == 2) {
    const int sides = h.faces(hull), end = (face + 1) % sides;
    put(face, (face + sides - 1) % sides);
    put(end, end);
    return;
  }
  const std::int32_t at = h.first_face[hull] + face;
  for (std::int32_t k = h.first_corner[at]; k < h.first_corner[at + 1]; ++k) {
    const std::int32_t* edge = &h.edge[4 * std::size_t(h.first_edge[hull] + h.corner_edge[k] - 1)];
    put(h.corner_vertex[k] - 1, (edge[2] == face + 1 ? edge[3] : edge[2]) - 1);
  }
}

// From the centre of the contactor, turned: a vertex of its hull, and how a face of it looks.
void InteractionHandler::Workspace::vertex_of(std::int32_t c, int i, double* x) const {
  const std::int32_t vertices = contactors->hulls.vertices(contactors->hull.values[c]);
  for (int k = 0; k < dim; ++k) x[k] = turned[hull_place[c] + std::int64_t(k) * vertices + i];
}

void InteractionHandler::Workspace::looks_of(std::int32_t c, int i, double* n) const {
  const std::int32_t hull = contactors->hull.values[c], faces = contactors->hulls.faces(hull);
  const std::int64_t first = hull_place[c] + std::int64_t(dim) * contactors->hulls.vertices(hull);
  for (int k = 0; k < dim; ++k) n[k] = turned[first + std::int64_t(k) * faces + i];
}

void InteractionHandler::Workspace::view_side(std::int32_t c, int face, FlatSide& s) const {
  s.corner.clear();
  const auto shape = Shape(contactors->shape.values[c]);
  if (shape == Shape::segment) return view_edge(c, s);
  looks_of(c, face, s.normal);
  if (shape == Shape::facet)
    view_facet(c, s);
  else
    view_face(c, face, s);
  s.offset = dot(s.normal, s.corner.front().x, dim);
}

// How far the foot of a point, from the centre of the contactor, is beyond the side [m], and whether past a rim, which
// way; 0 over it.
double InteractionHandler::Workspace::beyond(const FlatSide& s, const double* x, bool& rim, double* way) const {
  const double height = dot(s.normal, x, dim) - s.offset;
  double foot[3] = {0, 0, 0}, least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < dim; ++k) foot[k] = x[k] - height * s.normal[k];
  bool inside = true;
  rim = false;
  const std::size_t n = s.corner.size();
  const auto take = [&](const double* d, bool at_rim) {
    const double square = dot(d, d, dim);
    if (square > least || (square == least && !at_rim)) return;
    least = square;
    rim = at_rim;
    std::copy_n(d, dim, way);
  };
  for (std::size_t i = 0; i < n; ++i) {
    const FlatSide::Corner &from = s.corner[i], &to = s.corner[(i + 1) % n];
    double e[3] = {0, 0, 0}, w[3] = {0, 0, 0}, out[3];
    for (int k = 0; k < dim; ++k) e[k] = to.x[k] - from.x[k], w[k] = foot[k] - from.x[k];
    const double along = dot(w, e, dim) / dot(e, e, dim);
    if (dim == 2) {
      if (along >= 0) continue;
      inside = false;
      take(w, from.rim);
      continue;
    }
    cross(e, s.normal, out);
    if (dot(out, w, 3) <= 0) continue;
    inside = false;
    const double t = std::clamp(along, 0.0, 1.0);
    for (int k = 0; k < 3; ++k) w[k] -= t * e[k];
    // at a corner one of its two edges is enough
    take(w, from.rim || (along < 0 && s.corner[(i + n - 1) % n].rim) || (along > 1 && to.rim));
  }
  const double distance = inside ? 0 : std::sqrt(least);
  for (int k = 0; k < dim && distance > 0; ++k) way[k] /= distance;
  return distance;
}

bool InteractionHandler::Workspace::is_mapped_point(std::int32_t c) const {
  return mapped->place[std::size_t(c)] >= 0 && info(Shape(contactors->shape.values[c])).ball();
}

// Nodes that are over a flat side that they may touch: those that may slide past its rim in the step.
void InteractionHandler::Workspace::note_seats(Candidates& out) {
  FlatSide& side = seen_side;
  double x[3] = {0, 0, 0}, way[3] = {0, 0, 0};
  bool rim = false;
  for (std::int64_t i = 0; i < out.count; ++i) {
    const std::int32_t a = out.contactor_a[i], b = out.contactor_b[i];
    if (!is_mapped_point(a)) continue;
    const double hair = mapped->hair[std::size_t(mapped->place[std::size_t(a)])];
    const int faces = flat_sides(b);
    from_centre(a, b, out.image[i], x);
    for (int face = 0; face < faces; ++face) {
      view_side(b, face, side);
      if (dim == 2 && std::none_of(side.corner.begin(), side.corner.end(), [](const auto& c) { return c.rim; }))
        continue;
      if (!(dot(side.normal, &out.normal[dim * i], dim) > alike)) continue;
      const double height = dot(side.normal, x, dim) - side.offset;
      if (std::abs(height - out.gap[i]) <= on_rim * hair && beyond(side, x, rim, way) <= on_rim * hair)
        out.seats.push_back({a, b, face});
    }
  }
}

// The point from the centre of the contactor whose image it sees.
void InteractionHandler::Workspace::from_centre(std::int32_t a, std::int32_t b, std::int32_t which, double* x) const {
  double shift[3] = {0, 0, 0};
  if (any_periodic) image_shift(*cell, which, shift);
  for (int k = 0; k < dim; ++k) x[k] = centre[std::int64_t(dim) * a + k] - shift[k] - centre[std::int64_t(dim) * b + k];
}

// The side of what bore the node, among those within its reach, that it slid past the rim of.
bool InteractionHandler::Workspace::past_its_rim(const OrderedPairs& pairs, const RimSeat& seat, HeldNode& held) const {
  const auto node = std::int32_t(seat.node), was = std::int32_t(seat.side);
  const double hair = mapped->hair[std::size_t(mapped->place[std::size_t(node)])];
  FlatSide &before = seen_before, &side = seen_side;
  view_side(was, seat.face, before);
  double least = hair, x[3] = {0, 0, 0}, way[3] = {0, 0, 0};
  bool found = false, rim = false;
  const bool all = each_pair_of(pairs, node, [&](std::int64_t p, int kind) {
    const std::int32_t b = pairs.b[p], image_of = pairs.image[p] & image_bits;
    if (carrier[b] != carrier[was]) return true;
    if (pairs.image[p] & declared_bit) return false; // it is held by its bond
    from_centre(node, b, image_of, x);
    for (int face = 0; face < flat_sides(b); ++face) {
      view_side(b, face, side);
      if (!(dot(side.normal, before.normal, dim) > alike)) continue;
      const double height = dot(side.normal, x, dim) - side.offset, far = beyond(side, x, rim, way);
      if (far <= on_rim * hair && height >= -hair) return false; // it is over it
      if (!rim || !(far < least) || !(height >= -hair) || !(height <= share(node) + share(b))) continue;
      least = far;
      found = true;
      held = {node, b, face, kind, image_of, height, {}, {}};
      std::copy_n(side.normal, 3, held.normal);
      std::copy_n(way, 3, held.way);
    }
    return true;
  });
  if (!all) return false;
  if (!found || !same_mesh(node, held.side)) return found;
  return held.gap >= -mapped->apart_depth[std::size_t(mapped->place[std::size_t(held.side)])];
}

// A node that comes from in front past a rim, over which a side of its own reaches.
bool InteractionHandler::Workspace::comes_past_a_rim(const OrderedPairs& pairs, int kind, std::int64_t first,
                                                     std::int64_t last, HeldNode& held) const {
  const std::int32_t node = pairs.a[first];
  const double hair = mapped->hair[std::size_t(mapped->place[std::size_t(node)])];
  FlatSide& side = seen_side;
  double x[3] = {0, 0, 0}, way[3] = {0, 0, 0}, least = hair;
  bool rim = false, found = false;
  for (std::int64_t p = first; p < last; ++p) {
    const std::int32_t b = pairs.b[p], image_of = pairs.image[p] & image_bits;
    if (pairs.image[p] & declared_bit) return false;
    from_centre(node, b, image_of, x);
    for (int face = 0; face < flat_sides(b); ++face) {
      view_side(b, face, side);
      const double height = dot(side.normal, x, dim) - side.offset;
      if (!(height >= -on_rim * hair) || !(height <= share(node) + share(b))) continue;
      const double far = beyond(side, x, rim, way);
      if (far <= on_rim * hair) return false; // it is over one
      if (!rim || !(far < least) || !reaches_back(node, side.normal, way, far)) continue;
      least = far;
      found = true;
      held = {node, b, face, kind, image_of, height, {}, {}};
      std::copy_n(side.normal, 3, held.normal);
      std::copy_n(way, 3, held.way);
    }
  }
  return found;
}

// Nodes that slid past a rim or come in front of one.
template <class Hold>
void InteractionHandler::Workspace::hold_what_slid(const OrderedPairs& pairs, std::span<const RimSeat> before,
                                                   std::span<const RimSeat> over, Hold&& hold) {
  HeldNode h;
  for (const HeldNode& one : left_nodes)
    if (lies_on_another(pairs, one, h)) hold(h);
  for (const RimSeat& seat : before)
    if (!std::binary_search(over.begin(), over.end(), seat) && past_its_rim(pairs, seat, h)) hold(h);
  std::int64_t end = 0;
  for (int kind = 0; kind < kinds; ++kind)
    for (std::int64_t first = end, last; first < pairs.kind_end[std::size_t(kind)]; first = end) {
      const std::int32_t node = pairs.a[first];
      for (last = first; last < pairs.kind_end[std::size_t(kind)] && pairs.a[last] == node; ++last) {}
      end = last;
      if (is_mapped_point(node) && comes_past_a_rim(pairs, kind, first, last, h)) hold(h);
    }
}

// Nodes that no side has but the one past whose rim they slid, and nodes at edges between two sides. Bonds begin
// between a node and the side that its cells lie on, whether or not a contact at the opposite node carries the load of
// both.
void InteractionHandler::Workspace::hold_at_rims(const OrderedPairs& pairs, std::span<const RimSeat> before,
                                                 Candidates& out) {
  out.seats.clear();
  if (!mapped) return;
  note_seats(out);
  std::sort(out.seats.begin(), out.seats.end());
  std::vector<HeldNode>& held = held_nodes;
  held.clear();
  contacts_of_nodes.clear();
  const auto same_surface = [&](const HeldNode& one, const HeldNode& two) {
    return one.node == two.node && carrier[one.side] == carrier[two.side] && dot(one.normal, two.normal, dim) > alike;
  };
  const auto hold = [&](const HeldNode& h) {
    if (std::any_of(held.begin(), held.end(), [&](const HeldNode& other) { return same_surface(h, other); })) return;
    if (contacts_of_nodes.empty()) index_nodes(out);
    if (!bears_as_high(out, h) && (for_bonds || !is_met_there(out, h))) held.push_back(h);
  };
  HeldNode h, met;
  for (std::int64_t i = 0; i < out.count; ++i) {
    if (!is_mapped_point(out.contactor_a[i]) || flat_sides(out.contactor_b[i]) == 0) continue;
    note_met(out, i, met);
    if (lies_on_another(pairs, met, h)) hold(h);
  }
  if (!for_bonds) hold_what_slid(pairs, before, out.seats, hold);
  if (!held.empty()) {
    const auto order = [](const HeldNode& h) { return std::array<std::int64_t, 4>{h.kind, h.node, h.side, h.image}; };
    std::sort(held.begin(), held.end(), [&](const auto& one, const auto& two) { return order(one) < order(two); });
    put_held(held, out);
    contacts_of_nodes.clear();
  }
  if (!for_bonds) leave_hidden_sides(pairs, out);
  out.seats.clear();
  if (for_bonds) return;
  note_seats(out);
  for (const HeldNode& one : held) out.seats.push_back({one.node, one.side, one.face});
  std::sort(out.seats.begin(), out.seats.end());
  out.seats.erase(std::unique(out.seats.begin(), out.seats.end()), out.seats.end());
}

void InteractionHandler::Workspace::index_nodes(const Candidates& out) {
  for (std::int64_t i = 0; i < out.count; ++i)
    if (is_mapped_point(out.contactor_a[i])) contacts_of_nodes.emplace_back(out.contactor_a[i], i);
  std::sort(contacts_of_nodes.begin(), contacts_of_nodes.end());
  contacts_on_sides.clear();
  for (const auto& [node, i] : contacts_of_nodes) contacts_on_sides.emplace_back(out.contactor_b[i], i);
  std::sort(contacts_on_sides.begin(), contacts_on_sides.end());
}

// True if a node of the opposite surface lies on a side of the node's own mesh, equally near: that contact carries the
// load of both.
bool InteractionHandler::Workspace::is_met_there(const Candidates& out, const HeldNode& h) const {
  const auto k = std::size_t(mapped->place[std::size_t(h.node)]);
  if (mapped->sides.empty()) return false;
  const double hair = mapped->hair[k];
  for (std::int64_t s = mapped->sides_start[k]; s < mapped->sides_start[k + 1]; ++s) {
    const std::pair first(mapped->sides[std::size_t(s)], std::int64_t(0));
    for (auto at = std::lower_bound(contacts_on_sides.begin(), contacts_on_sides.end(), first);
         at != contacts_on_sides.end() && at->first == first.first; ++at) {
      const std::int32_t other = out.contactor_a[at->second];
      double x[3] = {0, 0, 0};
      from_centre(other, h.node, out.image[at->second], x);
      if (same_mesh(other, h.side) && dot(x, x, dim) <= hair * hair) return true;
    }
  }
  return false;
}

std::span<const std::pair<std::int32_t, std::int64_t>>
InteractionHandler::Workspace::contacts_of(std::int32_t node) const {
  const auto first =
      std::lower_bound(contacts_of_nodes.begin(), contacts_of_nodes.end(), std::pair(node, std::int64_t(0)));
  auto last = first;
  while (last != contacts_of_nodes.end() && last->first == node) ++last;
  return {first, last};
}

// True if another contact of the node carries it at the height of the side's plane, or above; a bond to one body holds
// the node beside that to another.
bool InteractionHandler::Workspace::bears_as_high(const Candidates& out, const HeldNode& h) const {
  const double hair = mapped->hair[std::size_t(mapped->place[std::size_t(h.node)])];
  for (const auto& [node, i] : contacts_of(h.node)) {
    if (!(dot(&out.normal[dim * i], h.normal, dim) > alike)) continue;
    if (for_bonds && carrier[out.contactor_b[i]] != carrier[h.side]) continue;
    const RimSeat over{h.node, out.contactor_b[i], 0};
    const auto at = std::lower_bound(out.seats.begin(), out.seats.end(), over);
    if (at == out.seats.end() || at->node != over.node || at->side != over.side) continue;
    if (out.gap[i] <= h.gap + on_rim * hair) return true;
  }
  return false;
}

// Inserts contacts of held nodes in the order of detection, in place of contacts of the same pairs and of those that
// would stop the node on its way back.
void InteractionHandler::Workspace::put_held(std::span<const HeldNode> held, Candidates& out) {
  Candidates& all = with_held;
  for (Array<std::int32_t>* ids : {&all.contactor_a, &all.contactor_b, &all.feature, &all.image}) ids->resize(0);
  for (Array<double>* numbers : {&all.gap, &all.normal, &all.point}) numbers->resize(0);
  const auto kind_of = [&](std::int32_t a, std::int32_t b) {
    return kind_table.kind[contactors->shape.values[a] + shapes * contactors->shape.values[b]];
  };
  const auto hinders = [&](std::int64_t i, const HeldNode& h) {
    if (carrier[out.contactor_b[i]] != carrier[h.side]) return false;
    if (out.contactor_b[i] == h.side && out.image[i] == h.image) return true;
    const double hair = mapped->hair[std::size_t(mapped->place[std::size_t(h.node)])];
    return std::abs(out.gap[i]) <= hair && dot(&out.normal[dim * i], h.way, dim) > unlike_side;
  };
  const auto copy = [&](std::int64_t i) {
    all.contactor_a.push_back(out.contactor_a[i]);
    all.contactor_b.push_back(out.contactor_b[i]);
    all.feature.push_back(out.feature[i]);
    all.image.push_back(out.image[i]);
    all.gap.push_back(out.gap[i]);
    all.normal.insert(all.normal.end(), &out.normal[dim * i], &out.normal[dim * i] + dim);
    all.point.insert(all.point.end(), &out.point[dim * i], &out.point[dim * i] + dim);
  };
  const auto put = [&](const HeldNode& h) {
    all.contactor_a.push_back(h.node);
    all.contactor_b.push_back(h.side);
    all.feature.push_back(0);
    all.image.push_back(h.image);
    all.gap.push_back(h.gap);
    all.normal.insert(all.normal.end(), h.normal, h.normal + dim);
    for (int k = 0; k < dim; ++k) all.point.push_back(centre[std::int64_t(dim) * h.node + k] - h.gap / 2 * h.normal[k]);
  };
  std::vector<std::uint8_t>& gone = hinders_held;
  gone.assign(std::size_t(out.count), 0);
  for (const HeldNode& h : held)
    for (const auto& [node, i] : contacts_of(h.node)) gone[std::size_t(i)] |= hinders(i, h);
  std::size_t next = 0;
  for (std::int64_t i = 0; i < out.count; ++i) {
    const std::array<std::int64_t, 4> at = {kind_of(out.contactor_a[i], out.contactor_b[i]), out.contactor_a[i],
                                            out.contactor_b[i], out.image[i]};
    for (; next < held.size(); ++next) {
      const HeldNode& h = held[next];
      if (!(std::array<std::int64_t, 4>{h.kind, h.node, h.side, h.image} < at)) break;
      put(h);
    }
    if (!gone[std::size_t(i)]) copy(i);
  }
  for (; next < held.size(); ++next) put(held[next]);
  all.count = std::int64_t(all.contactor_a.size());
  std::swap(all.seats, out.seats);
  std::swap(all, out);
}

} // namespace cairn
