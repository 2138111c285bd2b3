// Areas of bonds between a mesh and a flat side of a rigid body. A node has the part of its sides nearer to it than to
// their other nodes, as far as the body covers it. Parts of nodes that the body does not reach belong to the nearest
// bond: a corner of the body that stands on the side, or a node beside it.
#include "mesh_bond_areas.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "../base/vectors.hpp"
#include "../contactors/shapes.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "body_axes.hpp"
#include "contact_areas.hpp"
#include "face_overlap.hpp"
#include "sides_of_nodes.hpp"

namespace cairn {
namespace {

constexpr double towards = 0.5; // cosine: least facing of a side of the mesh and a face of the body

} // namespace

struct MeshBondAreas::MeshFaceBond {
  std::int32_t mesh, carrier;   // of the bond
  std::array<double, 3> shift;  // from the body to its image beside the mesh [m]
  std::int32_t candidate, hull; // the body's contactor
  std::int32_t own;             // the mesh's
  AreaClaim claim;
  bool flat = false;             // a side of the mesh lies flat on one of the body there
  double x[3] = {}, normal[3]{}; // [m]; of that side
  double area = 0;               // [m2]
  auto group() const { return std::tie(mesh, carrier, shift); }
  auto order() const { return std::tuple(mesh, carrier, shift, claim, candidate); }
};

// How the sides of a mesh and the faces of one body lie on each other.
class MeshBondAreas::MeshFaces {
public:
  MeshFaces(const AssemblyInput& in, const SidesOfNodes& sides, std::span<MeshFaceBond> bonds);
  void share() {
    for (MeshFaceBond& b : bonds_) begin(b);
    for (MeshFaceBond& b : bonds_)
      if (b.flat && !in_.meshes->turns(b.own)) give_own(b);
    give_rest();
  }

private:
  // Lays a side before a contactor of the body; false where neither lies flat on the other.
  bool lay(std::int32_t side, std::int32_t hull);
  bool lay_edge(const double* normal, std::int32_t hull);
  bool lay_triangle(const double* normal, std::int32_t hull);
  double share_of(std::int32_t side, int corner); // of the triangle that was laid, in that part of it
  template <class F>
  void each_piece(std::int32_t side, F&& take);
  void begin(MeshFaceBond& b);
  void give_own(MeshFaceBond& b);
  void give_rest();
  void give_pieces(std::int32_t side, std::int32_t hull);
  MeshFaceBond* of_owner(std::int32_t owner, std::int32_t hull) const;
  MeshFaceBond* nearest(const double* x) const;
  template <class F>
  void each_side(const MeshFaceBond& b, F&& take) const {
    const MeshSet::Middle& m = in_.meshes->middle(b.own);
    for (int j = 0; j < 4 && m.node[j] >= 0; ++j)
      for (const std::int32_t side : sides_.at(m.node[j])) take(side);
  }

  const AssemblyInput& in_;
  const SidesOfNodes& sides_;
  std::span<MeshFaceBond> bonds_;
  std::vector<std::int32_t> hulls_;
  std::vector<std::pair<std::int32_t, std::int32_t>> owners_; // node or point, number of the bond
  double gap_ = 0;
  // last laid side with the contactor: shared area, whole area; range along an edge
  const double* x_[3] = {};
  double shared_ = 0, whole_ = 0, from_ = 0, to_ = 0;
  FaceOutline face_, side_, part_;
};

MeshBondAreas::MeshFaces::MeshFaces(const AssemblyInput& in, const SidesOfNodes& sides, std::span<MeshFaceBond> bonds)
    : in_(in), sides_(sides), bonds_(bonds) {
  for (const MeshFaceBond& b : bonds) {
    hulls_.push_back(b.hull);
    gap_ = std::max(gap_, std::abs(in_.candidates->gap[b.candidate]));
    if (!in_.meshes->turns(b.own)) owners_.emplace_back(b.own, std::int32_t(&b - bonds.data()));
  }
  std::sort(owners_.begin(), owners_.end());
  std::sort(hulls_.begin(), hulls_.end());
  hulls_.erase(std::unique(hulls_.begin(), hulls_.end()), hulls_.end());
}

bool MeshBondAreas::MeshFaces::lay(std::int32_t side, std::int32_t hull) {
  double normal[3] = {};
  in_.normal_of_side(side, normal);
  const MeshSet::Middle& middle = in_.meshes->middle(side);
  for (int j = 0; j < in_.dim(); ++j) x_[j] = in_.nodes->position[middle.node[j]];
  shared_ = from_ = to_ = 0;
  return in_.dim() == 2 ? lay_edge(normal, hull) : lay_triangle(normal, hull);
}

bool MeshBondAreas::MeshFaces::lay_edge(const double* normal, std::int32_t hull) {
  const Contactors& c = *in_.contactors;
  const Hulls& hulls = c.hulls;
  const std::int32_t body = in_.body(hull);
  double face[3] = {};
  if (info(Shape(*c.shape[hull])).half_space()) {
    const double own[3] = {c.direction[hull][0], c.direction[hull][1], 0};
    to_space_axes(*in_.bodies, 2, body, own, face);
    shared_ = to_ = 1;
    return -dot(face, normal) > flat_faces;
  }
  const std::int32_t which = *c.hull[hull];
  const double length = std::hypot(x_[1][0] - x_[0][0], x_[1][1] - x_[0][1]);
  const double along[3] = {(x_[1][0] - x_[0][0]) / length, (x_[1][1] - x_[0][1]) / length, 0};
  const auto corner = [&](std::int32_t k, double* at) {
    const double* vertex = &hulls.vertex[2 * std::size_t(hulls.first_vertex[which] + k)];
    double own[3] = {vertex[0], vertex[1], 0};
    for (int l = 0; l < 2 && c.offset.active; ++l) own[l] += c.offset[hull][l];
    to_space_axes(*in_.bodies, 2, body, own, at);
    for (int l = 0; l < 2; ++l) at[l] += in_.bodies->position[body][l] + bonds_[0].shift[std::size_t(l)] - x_[0][l];
  };
  for (std::int32_t f = 0; f < hulls.faces(which); ++f) {
    double a[3] = {}, b[3] = {};
    to_space_axes(*in_.bodies, 2, body, &hulls.normal[2 * std::size_t(hulls.first_face[which] + f)], face);
    if (!(-dot(face, normal) > flat_faces)) continue;
    corner(f, a);
    corner((f + 1) % hulls.vertices(which), b);
    if (std::abs(dot(a, normal)) > as_high * *c.radius[hull] + gap_) return false;
    from_ = std::clamp(std::min(dot(a, along), dot(b, along)) / length, 0.0, 1.0);
    to_ = std::clamp(std::max(dot(a, along), dot(b, along)) / length, 0.0, 1.0);
    shared_ = to_ - from_;
    return true;
  }
  return false;
}

bool MeshBondAreas::MeshFaces::lay_triangle(const double* normal, std::int32_t hull) {
  const Contactors& c = *in_.contactors;
  const FaceView view{normal, x_[0], *c.radius[hull], gap_};
  double t[3], across[3];
  tangent_of(normal, t);
  cross(normal, t, across);
  side_.clear();
  for (int j = 0; j < 3; ++j) {
    const double from[3] = {x_[j][0] - x_[0][0], x_[j][1] - x_[0][1], x_[j][2] - x_[0][2]};
    side_.corner.push_back({dot(t, from), dot(across, from)});
  }
  whole_ = side_.area();
  if (info(Shape(*c.shape[hull])).half_space()) {
    double face[3];
    to_space_axes(*in_.bodies, 3, in_.body(hull), c.direction[hull], face);
    shared_ = 1;
    return -dot(face, normal) > flat_faces;
  }
  if (!see_face(in_, view, hull, -1, bonds_[0].shift.data(), face_)) return false;
  if (std::abs(face_.height) > as_high * view.size + gap_) return false;
  shared_ = shared_area(side_, face_) / whole_;
  return true;
}

double MeshBondAreas::MeshFaces::share_of(std::int32_t side, int corner) {
  part_of_corner(side_, in_.meshes->shares_of_side(side).data(), corner, part_);
  return shared_area(part_, face_) / whole_;
}

// Parts of the last laid side: owner (-1: no bond), position, whole area and area on the contactor.
template <class F>
void MeshBondAreas::MeshFaces::each_piece(std::int32_t side, F&& take) {
  const std::span<const MeshSet::SidePart> parts = in_.meshes->parts_of_side(side);
  const int d = in_.dim();
  double x[3] = {};
  const auto place = [&](double first, double second, double third) {
    for (int k = 0; k < d; ++k) x[k] = first * x_[0][k] + second * x_[1][k] + (d == 3 ? third * x_[2][k] : 0);
  };
  const bool all = shared_ >= 1 - area_rounding;
  if (d == 2) {
    const MeshSet::SidePart halves[2] = {{-1, 0, 0, 0.5, 0}, {-1, 1, 0.5, 1, 0}};
    for (const MeshSet::SidePart& p : parts.empty() ? std::span<const MeshSet::SidePart>(halves) : parts) {
      const double from = std::max(p.from, from_), to = std::min(p.to, to_);
      place(1 - (p.from + p.to) / 2, (p.from + p.to) / 2, 0);
      take(p.owner, x, p.area, all && p.owner >= 0 ? p.area : from < to ? in_.meshes->edge_area(side, from, to) : 0.0);
    }
    return;
  }
  const bool points = std::any_of(parts.begin(), parts.end(), [](const auto& p) { return p.corner < 0; });
  double whole = 0;
  for (const MeshSet::SidePart& p : parts) whole += p.area;
  if (points || (all && !parts.empty())) {
    for (const MeshSet::SidePart& p : parts) {
      place(1.0 / 3, 1.0 / 3, 1.0 / 3);
      take(p.owner, x, p.area, all ? p.area : shared_ * p.area);
    }
    return;
  }
  const std::span<const double, 3> share = in_.meshes->shares_of_side(side);
  const double sum = share[0] + share[1] + share[2];
  for (int j = 0; j < 3; ++j) {
    const auto p = std::find_if(parts.begin(), parts.end(), [&](const auto& q) { return q.corner == j; });
    constexpr double most = 11.0 / 18, less = 7.0 / 36; // of the middle of a part
    place(j == 0 ? most : less, j == 1 ? most : less, j == 2 ? most : less);
    take(p == parts.end() ? -1 : p->owner, x, p == parts.end() ? 0 : p->area,
         (all ? share[std::size_t(j)] / sum : share_of(side, j)) * (parts.empty() ? whole_ : whole));
  }
}

MeshBondAreas::MeshFaceBond* MeshBondAreas::MeshFaces::of_owner(std::int32_t owner, std::int32_t hull) const {
  MeshFaceBond* any = nullptr;
  auto at = std::lower_bound(owners_.begin(), owners_.end(), std::pair(owner, std::int32_t(-1)));
  for (; at != owners_.end() && at->first == owner; ++at) {
    MeshFaceBond& b = bonds_[std::size_t(at->second)];
    if (!b.flat) continue;
    if (b.hull == hull) return &b;
    any = any ? any : &b;
  }
  return any;
}

MeshBondAreas::MeshFaceBond* MeshBondAreas::MeshFaces::nearest(const double* x) const {
  MeshFaceBond* found = nullptr;
  double least = std::numeric_limits<double>::max();
  for (MeshFaceBond& b : bonds_) {
    const double from[3] = {b.x[0] - x[0], b.x[1] - x[1], b.x[2] - x[2]}, square = dot(from, from);
    if (b.flat && square < least) least = square, found = &b;
  }
  return found;
}

void MeshBondAreas::MeshFaces::begin(MeshFaceBond& b) {
  const auto try_side = [&](std::int32_t side) {
    if (b.flat || !lay(side, b.hull)) return;
    b.flat = true;
    in_.normal_of_side(side, b.normal);
  };
  in_.meshes->turns(b.own) ? try_side(b.own) : each_side(b, try_side);
}

// Area of a node or a point: its parts of sides, without those off the body.
void MeshBondAreas::MeshFaces::give_own(MeshFaceBond& b) {
  b.area = in_.meshes->area(b.own);
  std::int32_t last = -1; // of a point between nodes sides come again
  std::vector<std::int32_t> seen;
  each_side(b, [&](std::int32_t side) {
    if (side == last || std::find(seen.begin(), seen.end(), side) != seen.end()) return;
    seen.push_back(last = side);
    const bool flat = lay(side, b.hull);
    double normal[3] = {}, lost = 0;
    in_.normal_of_side(side, normal);
    if (flat)
      each_piece(side, [&](std::int32_t owner, const double*, double whole, double here) {
        if (owner == b.own) lost += whole - here;
      });
    else if (const double look = dot(normal, b.normal); look < towards || look > flat_faces)
      for (const MeshSet::SidePart& p : in_.meshes->parts_of_side(side)) lost += p.owner == b.own ? p.area : 0;
    if (lost != 0) b.area -= lost;
  });
}

void MeshBondAreas::MeshFaces::give_pieces(std::int32_t side, std::int32_t hull) {
  each_piece(side, [&](std::int32_t owner, const double* x, double, double here) {
    if (!(here > 0)) return;
    MeshFaceBond* to = owner < 0 ? nullptr : of_owner(owner, hull);
    if (to && to->hull == hull) return; // it has it
    if (!to) to = nearest(x);
    if (to) to->area += here;
  });
}

// All sides round the bonds as far as the body lies on them.
void MeshBondAreas::MeshFaces::give_rest() {
  std::vector<std::int32_t> open, seen;
  for (const MeshFaceBond& b : bonds_)
    if (b.flat) each_side(b, [&](std::int32_t side) { open.push_back(side); });
  while (!open.empty()) {
    std::sort(open.begin(), open.end());
    open.erase(std::unique(open.begin(), open.end()), open.end());
    std::vector<std::int32_t> fresh, next;
    std::set_difference(open.begin(), open.end(), seen.begin(), seen.end(), std::back_inserter(fresh));
    for (const std::int32_t side : fresh) {
      bool met = false;
      for (const std::int32_t hull : hulls_) {
        if (!lay(side, hull) || !(shared_ > area_rounding)) continue;
        met = true;
        give_pieces(side, hull);
      }
      const MeshSet::Middle& m = in_.meshes->middle(side);
      for (int j = 0; met && j < in_.dim(); ++j)
        for (const std::int32_t beside : sides_.at(m.node[j])) next.push_back(beside);
    }
    std::vector<std::int32_t> all;
    std::merge(seen.begin(), seen.end(), fresh.begin(), fresh.end(), std::back_inserter(all));
    seen.swap(all);
    open.swap(next);
  }
}

// True if a contact is a bond of a mesh and a body with flat sides, by a law that uses its area.
bool MeshBondAreas::as_mesh_bond(std::int32_t i, AreaClaim claim, MeshFaceBond& bond) const {
  const Candidates& c = *in_.candidates;
  const std::int32_t a = c.contactor_a[i], b = c.contactor_b[i];
  const LawInfo& law = classes_.law(i);
  if (!law.anchored || law.joins || law.spans || law.holds || (in_.body(a) < 0) == (in_.body(b) < 0)) return false;
  const std::int32_t own = in_.body(a) < 0 ? a : b, hull = in_.body(a) < 0 ? b : a;
  const auto shape = Shape(*in_.contactors->shape[hull]);
  if (!info(shape).faced && !info(shape).half_space()) return false;
  if (*in_.contactors->radius[own] > 0 && !in_.meshes->turns(own)) return false;
  double shift[3] = {0, 0, 0};
  if (in_.cell->any()) image_shift(*in_.cell, c.image[i], shift);
  bond = {};
  bond.mesh = in_.meshes->mesh_of(own);
  bond.carrier = in_.body(hull);
  for (std::size_t k = 0; k < 3; ++k) bond.shift[k] = own == a ? shift[k] : 0.0 - shift[k];
  bond.candidate = i;
  bond.hull = hull;
  bond.own = own;
  bond.claim = claim;
  for (int k = 0; k < in_.dim(); ++k) bond.x[k] = c.point[in_.dim() * i + k] - (own == a ? 0 : shift[k]);
  return true;
}

// True if a bond of the same body is at that position: a corner above the edge of two triangles is found on both.
bool MeshBondAreas::is_there(std::span<const MeshFaceBond> bonds, const MeshFaceBond& wanted) const {
  const double near = as_high * *in_.contactors->radius[wanted.hull];
  return std::any_of(bonds.begin(), bonds.end(), [&](const MeshFaceBond& b) {
    const double from[3] = {b.x[0] - wanted.x[0], b.x[1] - wanted.x[1], b.x[2] - wanted.x[2]};
    return b.hull == wanted.hull && dot(from, from) <= near * near;
  });
}

// Areas of those that begin, in their order, where they are not what ContactAreas says. Of the remainder those for
// which something is left begin, too.
std::vector<MeshBondAreas::BondArea> MeshBondAreas::share_mesh_faces(std::vector<std::int32_t>& beginning,
                                                                     std::span<const std::int32_t> remainder) const {
  std::vector<BondArea> areas;
  std::vector<MeshFaceBond> bonds;
  if (!in_.meshes) return areas;
  MeshFaceBond made{};
  for (const std::int32_t i : beginning)
    if (as_mesh_bond(i, AreaClaim::full, made)) bonds.push_back(made);
  for (const std::int32_t i : remainder)
    if (as_mesh_bond(i, AreaClaim::remainder, made)) bonds.push_back(made);
  if (bonds.empty()) return areas;
  std::sort(bonds.begin(), bonds.end(), [](const auto& p, const auto& q) { return p.order() < q.order(); });
  const SidesOfNodes sides(in_);
  for (std::size_t first = 0, last = 0; first < bonds.size(); first = last) {
    std::size_t end = first; // of those that stay, in front of which claims of the remainder stand last
    for (; last < bonds.size() && bonds[last].group() == bonds[first].group(); ++last)
      if (bonds[last].claim == AreaClaim::full || !is_there(std::span(&bonds[first], end - first), bonds[last]))
        bonds[end++] = bonds[last];
    const std::span<MeshFaceBond> group(&bonds[first], end - first);
    MeshFaces(in_, sides, group).share();
    double most = 0;
    for (const MeshFaceBond& b : group) most = std::max(most, b.area);
    for (const MeshFaceBond& b : group) {
      if (!b.flat) continue;
      const double area = b.area > area_rounding * most ? b.area : 0;
      if (b.claim == AreaClaim::remainder && !(area > 0)) continue;
      if (b.claim == AreaClaim::remainder) beginning.push_back(b.candidate);
      areas.emplace_back(b.candidate, area);
    }
  }
  std::sort(beginning.begin(), beginning.end());
  std::sort(areas.begin(), areas.end());
  return areas;
}

} // namespace cairn
