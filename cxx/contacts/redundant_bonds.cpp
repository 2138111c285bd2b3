// Redundant bonds on meshes, whose sides share their nodes. A rigid body that touches a shared node touches all of its
// sides at one point: a bond holds it, and a second would make W singular, so that both diverge against each other. A
// contactor bonded to a side has no contact with the end of a neighbour within that side. Points and nodes bonded to a
// body with sides share the area of their side of the mesh; corners of that body have the rest of the area, if any.
#include "redundant_bonds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "../contactors/shapes.hpp"

namespace cairn {
namespace {

bool has(const std::int32_t* node, int count, std::int32_t wanted) {
  return std::find(node, node + count, wanted) < node + count;
}

// True if all nodes that carry one contact are of the side of the other.
bool within(const SupportNodes& f, const SupportNodes& side) {
  return f.mesh >= 0 && f.mesh == side.mesh &&
         std::all_of(f.node, f.node + f.carrying, [&](std::int32_t k) { return has(side.node, side.nodes, k); });
}

// True if a point or a node of a mesh shares in the area of a side.
bool shares(const SupportNodes& point, const SupportNodes& side, int dim) {
  if (point.mesh < 0 || point.mesh != side.mesh) return false;
  const auto common = std::count_if(point.node, point.node + point.carrying,
                                    [&](std::int32_t k) { return has(side.node, side.nodes, k); });
  return common >= std::min(point.carrying, dim);
}

// Points and nodes of meshes to be joined to partners with sides, found by partner and carrying nodes.
class PointsOfSides {
public:
  void add(std::int64_t partner, const SupportNodes& point) {
    for (int k = 0; k < point.carrying; ++k) at_.push_back({partner, point.node[k], std::int64_t(points_.size())});
    points_.push_back(point);
  }
  void sort() { std::sort(at_.begin(), at_.end()); }
  bool share(std::int64_t partner, const SupportNodes& side, int dim) const {
    for (int k = 0; k < side.nodes; ++k) {
      auto at = std::lower_bound(at_.begin(), at_.end(), Place{partner, side.node[k], 0});
      for (; at != at_.end() && (*at)[0] == partner && (*at)[1] == side.node[k]; ++at)
        if (shares(points_[std::size_t((*at)[2])], side, dim)) return true;
    }
    return false;
  }
  // True if the partner is to be joined to the node that alone carries a contact.
  bool has_node(std::int64_t partner, const SupportNodes& f) const {
    auto at = std::lower_bound(at_.begin(), at_.end(), Place{partner, f.node[0], 0});
    for (; at != at_.end() && (*at)[0] == partner && (*at)[1] == f.node[0]; ++at)
      if (points_[std::size_t((*at)[2])].carrying == 1) return true;
    return false;
  }

private:
  using Place = std::array<std::int64_t, 3>; // partner, node, number of the point
  std::vector<SupportNodes> points_;
  std::vector<Place> at_;
};

bool at_end(const SupportNodes& f) { return f.mesh >= 0 && f.carrying < f.nodes; }

SupportNodes support(const Mapping& m) {
  SupportNodes f;
  if (m.mean >= 0) return f; // of a mortar, which has no ends
  f.mesh = m.mesh;
  const double rounding = std::sqrt(std::numeric_limits<double>::epsilon()); // of weights, far from the origin
  for (const bool carries : {true, false}) {
    for (int j = 0; j < 4; ++j)
      if (m.node[j] >= 0 && (std::abs(m.weight[j]) > rounding) == carries) f.node[f.nodes++] = m.node[j];
    if (carries) f.carrying = f.nodes;
  }
  return f;
}

} // namespace

BondSupport RedundantBonds::support_of(std::int64_t i) const {
  const Candidates& c = *in_.candidates;
  const std::int32_t one = c.contactor_a[i], two = c.contactor_b[i];
  BondSupport s;
  s.candidate = std::int32_t(i);
  if (classes_.is_mapped(one) && classes_.is_mapped(two))
    return s; // nodes, which do not turn, keep all bonds to a side
  const double* point = &c.point[in_.dim() * i];
  if (classes_.is_mapped(one)) s.a = support(in_.meshes->mapping(*in_.nodes, one, point, two));
  if (!classes_.is_mapped(two)) return s;
  double shift[3] = {0, 0, 0}, there[3] = {0, 0, 0};
  if (in_.cell->any()) image_shift(*in_.cell, c.image[i], shift);
  for (int k = 0; k < 3 && k < in_.dim(); ++k) there[k] = point[k] - shift[k];
  s.b = support(in_.meshes->mapping(*in_.nodes, two, there, one));
  return s;
}

bool RedundantBonds::may_be_redundant(const BondSupport& s) { return at_end(s.a) || at_end(s.b); }

// Search keys of a contact: its contactors.
std::array<std::int64_t, 2> RedundantBonds::contactors_of(const BondSupport& s) const {
  return {in_.candidates->contactor_a[s.candidate], in_.candidates->contactor_b[s.candidate]};
}

void RedundantBonds::add(const BondSupport& s) {
  for (const std::int64_t name : contactors_of(s)) by_contactor_.emplace_back(name, std::int32_t(held_.size()));
  held_.push_back(s);
}

// True if a contact is at a position that a bond already holds.
bool RedundantBonds::is_redundant(const BondSupport& s) const {
  const Candidates& c = *in_.candidates;
  // a point holds its carrying nodes alone, not the rest of its side
  const auto held_by = [&](SupportNodes f, std::int32_t contactor) {
    if (info(Shape(*in_.contactors->shape[contactor])).ball()) f.nodes = f.carrying;
    return f;
  };
  for (const std::int64_t name : contactors_of(s)) {
    auto at = std::lower_bound(by_contactor_.begin(), by_contactor_.end(), std::pair(name, std::int32_t(-1)));
    for (; at != by_contactor_.end() && at->first == name; ++at) {
      const BondSupport& held = held_[std::size_t(at->second)];
      if (held.candidate == s.candidate || held.left_out) continue;
      const std::int32_t a = c.contactor_a[held.candidate], b = c.contactor_b[held.candidate];
      const SupportNodes by_a = held_by(held.a, a), by_b = held_by(held.b, b);
      if (a == c.contactor_a[s.candidate] && at_end(s.b) && within(s.b, by_b)) return true;
      if (b == c.contactor_b[s.candidate] && at_end(s.a) && within(s.a, by_a)) return true;
      // a node comes first, a side behind the body that touches it
      if (b == c.contactor_a[s.candidate] && at_end(s.b) && within(s.b, by_a)) return true;
      if (a == c.contactor_b[s.candidate] && at_end(s.a) && within(s.a, by_b)) return true;
    }
  }
  return false;
}

// Chooses among contacts that would begin as bonds: points and nodes that share a side precede other contacts there,
// those in the middle of a side stay, then the first at each position.
void RedundantBonds::leave_out(std::vector<std::int32_t>& beginning, std::vector<std::int32_t>& remainder) {
  if (!in_.meshes) return;
  const Candidates& c = *in_.candidates;
  const auto is_ball = [&](std::int32_t contactor) { return info(Shape(*in_.contactors->shape[contactor])).ball(); };
  const auto is_mapped = [&](std::int32_t contactor) { return classes_.is_mapped(contactor) != 0; };
  const auto partner = [&](std::int32_t contactor) { // a mesh, or the contactor itself, apart from meshes
    return is_mapped(contactor) ? std::int64_t(in_.meshes->mesh_of(contactor)) : -1 - std::int64_t(contactor);
  };
  PointsOfSides pointed;
  std::vector<BondSupport> supports;
  for (const std::int32_t i : beginning) {
    BondSupport s = support_of(i);
    const std::int32_t a = c.contactor_a[i], b = c.contactor_b[i];
    // nodes on a side of another mesh, in whose law an area counts
    if (is_mapped(a) && is_mapped(b) && !classes_.law(i).holds) {
      double shift[3] = {0, 0, 0}, there[3] = {0, 0, 0};
      if (in_.cell->any()) image_shift(*in_.cell, c.image[i], shift);
      for (int k = 0; k < 3 && k < in_.dim(); ++k) there[k] = c.point[in_.dim() * i + k] - shift[k];
      s.a = support(in_.meshes->mapping(*in_.nodes, a, &c.point[in_.dim() * i], b));
      s.b = support(in_.meshes->mapping(*in_.nodes, b, there, a));
    }
    if (s.a.mesh >= 0 && is_ball(a) && !is_ball(b)) pointed.add(partner(b), s.a);
    if (s.b.mesh >= 0 && is_ball(b) && !is_ball(a)) pointed.add(partner(a), s.b);
    supports.push_back(s);
  }
  pointed.sort();
  const auto is_shared = [&](const BondSupport& s) {
    const std::int32_t a = c.contactor_a[s.candidate], b = c.contactor_b[s.candidate];
    const bool side_a = s.a.mesh >= 0 && !is_ball(a);
    const SupportNodes& side = side_a ? s.a : s.b;
    const std::int32_t other = side_a ? b : a;
    if (side.mesh < 0 || (!is_mapped(other) && is_ball(other)) || classes_.law(s.candidate).holds) return false;
    // of two meshes whose points meet each other's sides those of the first count
    if (is_mapped(other) && in_.meshes->mesh_of(other) <= side.mesh) return false;
    return pointed.share(partner(other), side, in_.dim());
  };
  // Nodes that coincide meet each other's sides, and detection may keep one contact of the two: a second bond there is
  // redundant only if the node of the side has one.
  const auto at_bonded_node = [&](const BondSupport& s) {
    const std::int32_t a = c.contactor_a[s.candidate], b = c.contactor_b[s.candidate];
    if (s.a.carrying != 1 && s.b.carrying != 1) return false;
    if (!is_mapped(a) || !is_mapped(b)) return true;
    return is_ball(a) ? pointed.has_node(partner(a), s.b) : pointed.has_node(partner(b), s.a);
  };
  held_.clear();
  by_contactor_.clear();
  for (const BondSupport& s : supports)
    if (!is_shared(s))
      add(s);
    else if (!at_bonded_node(s))
      remainder.push_back(s.candidate);
  std::sort(by_contactor_.begin(), by_contactor_.end());
  for (BondSupport& s : held_) s.left_out = may_be_redundant(s);
  std::vector<std::int32_t> kept;
  for (BondSupport& s : held_) {
    s.left_out = s.left_out && is_redundant(s);
    if (!s.left_out) kept.push_back(s.candidate);
  }
  beginning = kept;
}

} // namespace cairn
