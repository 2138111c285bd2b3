// Areas of bonds between two meshes. Each pair of overlapping sides shares a piece of the face, whose parts belong to
// the nearest node of their side: of the mesh added first, if that node is bonded, else of the other, else to the
// nearest bond.
#include "mesh_bond_areas.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <unordered_set>

#include "../base/vectors.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "face_overlap.hpp"
#include "sides_of_nodes.hpp"

namespace cairn {
namespace {

constexpr double facing = 0.5; // cosine: sides that look less at each other do not lie on each other

} // namespace

struct MeshBondAreas::MeshPairBond {
  std::int32_t first, second;          // meshes, in the order in which they were added
  std::array<double, 3> shift;         // from the second to its image beside the first [m]
  std::int32_t candidate, point, side; // contactors: a node or a point of one mesh, a side of the other
  bool of_first;                       // the point is of the first mesh
  AreaClaim claim;
  double x[3] = {}; // [m]
  double area = 0;  // [m2]
  auto group() const { return std::tie(first, second, shift); }
  auto order() const { return std::tuple(first, second, shift, claim, candidate); }
};

class MeshBondAreas::MeshPairFaces {
public:
  MeshPairFaces(const AssemblyInput& in, const SidesOfNodes& sides, std::span<MeshPairBond> bonds);
  // Areas of the bonds; false where sides are not flat on each other, so that pieces would not add up.
  bool share();

private:
  // A part of a side, in its plane or along it, and who has it: of points in space all share the whole.
  struct Part {
    double from = 0, to = 1;
    FaceOutline outline;
    std::array<std::pair<std::int32_t, double>, 8> owner; // contactor, -1: none; its share
    int owners = 0;
    double x[3] = {};
  };
  using Sides = std::pair<std::int32_t, std::int32_t>; // of the first mesh, of the second
  bool lay(const Sides& pair);
  bool lay_edges(const Sides& pair);
  bool lay_triangles(const Sides& pair);
  bool meets(double high, double size);
  void take_edge_parts(std::int32_t side, double from, double to, std::vector<Part>& out) const;
  void take_triangle_parts(std::int32_t side, const FaceOutline& whole, std::vector<Part>& out) const;
  void give(const Part& one, const Part& other, double area);
  MeshPairBond* of_owner(std::int32_t owner) const;
  MeshPairBond* nearest(const double* x) const;

  const AssemblyInput& in_;
  const SidesOfNodes& sides_;
  std::span<MeshPairBond> bonds_;
  std::vector<std::pair<std::int32_t, std::int32_t>> owners_; // node or point, number of the bond
  std::vector<Part> parts_[2];
  double gap_ = 0, normal_[3] = {};
  const double* x_[2][3] = {};
  bool curved_ = false;
};

MeshBondAreas::MeshPairFaces::MeshPairFaces(const AssemblyInput& in, const SidesOfNodes& sides,
                                            std::span<MeshPairBond> bonds)
    : in_(in), sides_(sides), bonds_(bonds) {
  for (const MeshPairBond& b : bonds) {
    gap_ = std::max(gap_, std::abs(in_.candidates->gap[b.candidate]));
    owners_.emplace_back(b.point, std::int32_t(&b - bonds.data()));
  }
  std::sort(owners_.begin(), owners_.end());
}

// From the sides at the bonds on to those beside, as far as they lie on each other: beside both, too, where edges of
// both lie on each other.
bool MeshBondAreas::MeshPairFaces::share() {
  std::unordered_set<std::uint64_t> seen;
  std::vector<Sides> open;
  std::vector<std::int32_t> beside[2];
  const auto visit = [&](std::int32_t one, std::int32_t other) {
    if (seen.insert(std::uint64_t(one) << 32 | std::uint64_t(other)).second) open.emplace_back(one, other);
  };
  const auto look_round = [&](std::int32_t contactor, std::vector<std::int32_t>& found) {
    const MeshSet::Middle& m = in_.meshes->middle(contactor);
    found.clear();
    for (int j = 0; j < 4 && m.node[j] >= 0; ++j)
      for (const std::int32_t side : sides_.at(m.node[j])) found.push_back(side);
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
  };
  for (const MeshPairBond& b : bonds_) {
    look_round(b.point, beside[0]);
    for (const std::int32_t own : beside[0]) b.of_first ? visit(own, b.side) : visit(b.side, own);
  }
  while (!open.empty() && !curved_) {
    const Sides pair = open.back();
    open.pop_back();
    if (!lay(pair)) continue;
    look_round(pair.first, beside[0]);
    look_round(pair.second, beside[1]);
    for (const std::int32_t one : beside[0])
      for (const std::int32_t other : beside[1]) visit(one, other);
  }
  return !curved_;
}

// Shares out the common face of two sides; false if it is empty.
bool MeshBondAreas::MeshPairFaces::lay(const Sides& pair) {
  double other[3] = {};
  in_.normal_of_side(pair.first, normal_);
  in_.normal_of_side(pair.second, other);
  const double look = -dot(normal_, other);
  if (look < facing) return false;
  for (const bool second : {false, true}) {
    const MeshSet::Middle& m = in_.meshes->middle(second ? pair.second : pair.first);
    for (int j = 0; j < in_.dim(); ++j) x_[second][j] = in_.nodes->position[m.node[j]];
  }
  if (!(in_.dim() == 2 ? lay_edges(pair) : lay_triangles(pair))) return false;
  curved_ = curved_ || !(look > flat_faces);
  return true;
}

bool MeshBondAreas::MeshPairFaces::lay_edges(const Sides& pair) {
  const double x = x_[0][1][0] - x_[0][0][0], y = x_[0][1][1] - x_[0][0][1], square = x * x + y * y;
  double at[2], high = 0;
  for (int j = 0; j < 2; ++j) {
    const double from[3] = {x_[1][j][0] + bonds_[0].shift[0] - x_[0][0][0],
                            x_[1][j][1] + bonds_[0].shift[1] - x_[0][0][1], 0};
    at[j] = (from[0] * x + from[1] * y) / square;
    high = std::max(high, std::abs(dot(from, normal_)));
  }
  const double from = std::max(0.0, std::min(at[0], at[1])), to = std::min(1.0, std::max(at[0], at[1]));
  if (!(to - from > area_rounding) || !meets(high, std::sqrt(square))) return false;
  take_edge_parts(pair.first, 0, 1, parts_[0]);
  take_edge_parts(pair.second, at[0], at[1], parts_[1]);
  for (const Part& one : parts_[0])
    for (const Part& other : parts_[1]) {
      const double begin = std::max({one.from, std::min(other.from, other.to), 0.0});
      const double end = std::min({one.to, std::max(other.from, other.to), 1.0});
      if (begin < end) give(one, other, in_.meshes->edge_area(pair.first, begin, end));
    }
  return true;
}

// True if opposite sides touch: sides of warped faces do although their corners stand off, by less than a ledge.
bool MeshBondAreas::MeshPairFaces::meets(double high, double size) {
  constexpr double warped = 0.25;
  if (high <= as_high * size + gap_) return true;
  curved_ = curved_ || high <= warped * size + gap_;
  return false;
}

// Parts of an edge within a range along it.
void MeshBondAreas::MeshPairFaces::take_edge_parts(std::int32_t side, double from, double to,
                                                   std::vector<Part>& out) const {
  const std::span<const MeshSet::SidePart> parts = in_.meshes->parts_of_side(side);
  const MeshSet::SidePart none[1] = {{-1, 0, 0, 1, 0}};
  out.clear();
  for (const MeshSet::SidePart& p : parts.empty() ? std::span<const MeshSet::SidePart>(none) : parts) {
    Part& made = out.emplace_back();
    made.from = from + (to - from) * p.from;
    made.to = from + (to - from) * p.to;
    made.owner[0] = {p.owner, 1.0};
    made.owners = 1;
    const double middle = (made.from + made.to) / 2;
    for (int k = 0; k < 2; ++k) made.x[k] = (1 - middle) * x_[0][0][k] + middle * x_[0][1][k];
  }
}

bool MeshBondAreas::MeshPairFaces::lay_triangles(const Sides& pair) {
  FaceOutline outline[2];
  double t[3], across[3], high = 0;
  tangent_of(normal_, t);
  cross(normal_, t, across);
  for (int second = 0; second < 2; ++second)
    for (int j = 0; j < 3; ++j) {
      double from[3];
      for (int k = 0; k < 3; ++k)
        from[k] = x_[second][j][k] + (second ? bonds_[0].shift[std::size_t(k)] : 0.0) - x_[0][0][k];
      outline[second].corner.push_back({dot(t, from), dot(across, from)});
      high = std::max(high, std::abs(dot(normal_, from)));
    }
  const double whole = std::abs(outline[0].area());
  FaceOutline one = outline[0], other = outline[1];
  one.turn_left();
  other.turn_left();
  if (!(shared_area(one, other) > area_rounding * whole) || !meets(high, std::sqrt(whole))) return false;
  take_triangle_parts(pair.first, outline[0], parts_[0]);
  take_triangle_parts(pair.second, outline[1], parts_[1]);
  double reference = 0; // of the body as it lies at the start, which may be another
  for (const MeshSet::SidePart& p : in_.meshes->parts_of_side(pair.first)) reference += p.area;
  const double scale = reference > 0 ? reference / whole : 1;
  for (const Part& p : parts_[0])
    for (const Part& q : parts_[1])
      if (const double area = shared_area(p.outline, q.outline); area > 0) give(p, q, scale * area);
  return true;
}

// A corner has its share of the triangle.
void MeshBondAreas::MeshPairFaces::take_triangle_parts(std::int32_t side, const FaceOutline& whole,
                                                       std::vector<Part>& out) const {
  const std::span<const MeshSet::SidePart> parts = in_.meshes->parts_of_side(side);
  const bool first = &out == &parts_[0];
  out.clear();
  const auto place = [&](Part& made, int corner) {
    for (int j = 0; j < 3; ++j) {
      constexpr double most = 11.0 / 18, less = 7.0 / 36; // of the middle of a part
      const double weight = corner < 0 ? 1.0 / 3 : j == corner ? most : less;
      for (int k = 0; k < 3; ++k)
        made.x[k] += weight * (x_[first ? 0 : 1][j][k] + (first ? 0.0 : bonds_[0].shift[std::size_t(k)]));
    }
  };
  if (std::any_of(parts.begin(), parts.end(), [](const auto& p) { return p.corner < 0; })) {
    Part& made = out.emplace_back();
    double sum = 0;
    for (const MeshSet::SidePart& p : parts) sum += p.area;
    made.outline = whole;
    made.outline.turn_left();
    for (const MeshSet::SidePart& p : parts)
      if (made.owners < int(made.owner.size())) made.owner[std::size_t(made.owners++)] = {p.owner, p.area / sum};
    return place(made, -1);
  }
  for (int j = 0; j < 3; ++j) {
    Part& made = out.emplace_back();
    part_of_corner(whole, in_.meshes->shares_of_side(side).data(), j, made.outline);
    made.outline.turn_left();
    const auto p = std::find_if(parts.begin(), parts.end(), [&](const auto& q) { return q.corner == j; });
    made.owner[0] = {p == parts.end() ? -1 : p->owner, 1.0};
    made.owners = 1;
    place(made, j);
  }
}

void MeshBondAreas::MeshPairFaces::give(const Part& one, const Part& other, double area) {
  for (int i = 0; i < one.owners; ++i) {
    if (MeshPairBond* to = of_owner(one.owner[std::size_t(i)].first)) {
      to->area += one.owner[std::size_t(i)].second * area;
      continue;
    }
    for (int j = 0; j < other.owners; ++j) {
      MeshPairBond* to = of_owner(other.owner[std::size_t(j)].first);
      if (!to) to = nearest(one.x);
      to->area += one.owner[std::size_t(i)].second * other.owner[std::size_t(j)].second * area;
    }
  }
}

MeshBondAreas::MeshPairBond* MeshBondAreas::MeshPairFaces::of_owner(std::int32_t owner) const {
  if (owner < 0) return nullptr;
  const auto at = std::lower_bound(owners_.begin(), owners_.end(), std::pair(owner, std::int32_t(-1)));
  return at != owners_.end() && at->first == owner ? &bonds_[std::size_t(at->second)] : nullptr;
}

MeshBondAreas::MeshPairBond* MeshBondAreas::MeshPairFaces::nearest(const double* x) const {
  MeshPairBond* found = &bonds_[0];
  double least = std::numeric_limits<double>::max();
  for (MeshPairBond& b : bonds_) {
    const double from[3] = {b.x[0] - x[0], b.x[1] - x[1], b.x[2] - x[2]}, square = dot(from, from);
    if (square < least) least = square, found = &b;
  }
  return found;
}

// True if a contact is a bond of two meshes by a law that uses its area.
bool MeshBondAreas::as_mesh_pair_bond(std::int32_t i, AreaClaim claim, MeshPairBond& bond) const {
  const Candidates& c = *in_.candidates;
  const std::int32_t a = c.contactor_a[i], b = c.contactor_b[i];
  const LawInfo& law = classes_.law(i);
  if (law.joins || law.spans || law.holds || !(classes_.is_mapped(a) && classes_.is_mapped(b))) return false;
  const std::int32_t mesh_a = in_.meshes->mesh_of(a), mesh_b = in_.meshes->mesh_of(b);
  if (mesh_a == mesh_b || in_.meshes->turns(a) == in_.meshes->turns(b)) return false;
  double shift[3] = {0, 0, 0};
  if (in_.cell->any()) image_shift(*in_.cell, c.image[i], shift);
  const bool in_order = mesh_a < mesh_b;
  bond = {};
  bond.first = std::min(mesh_a, mesh_b);
  bond.second = std::max(mesh_a, mesh_b);
  for (std::size_t k = 0; k < 3; ++k) bond.shift[k] = in_order ? shift[k] : 0.0 - shift[k];
  bond.candidate = i;
  bond.point = in_.meshes->turns(a) ? b : a;
  bond.side = in_.meshes->turns(a) ? a : b;
  bond.of_first = in_.meshes->mesh_of(bond.point) == bond.first;
  bond.claim = claim;
  for (int k = 0; k < in_.dim(); ++k) bond.x[k] = c.point[in_.dim() * i + k] - (in_order ? 0 : shift[k]);
  return true;
}

// A node at the corner of a mesh touches the sides round that of another as well: it is joined to sides that one of its
// own looks at alone.
void MeshBondAreas::leave_out_corners(std::vector<std::int32_t>& beginning) const {
  if (!in_.meshes) return;
  MeshPairBond made{};
  if (std::none_of(beginning.begin(), beginning.end(),
                   [&](std::int32_t i) { return as_mesh_pair_bond(i, AreaClaim::full, made); }))
    return;
  const SidesOfNodes sides(in_);
  std::erase_if(beginning, [&](std::int32_t i) {
    if (!as_mesh_pair_bond(i, AreaClaim::full, made)) return false;
    double face[3] = {}, own[3] = {};
    in_.normal_of_side(made.side, face);
    bool any = false;
    const MeshSet::Middle& m = in_.meshes->middle(made.point);
    for (int j = 0; j < 4 && m.node[j] >= 0; ++j)
      for (const std::int32_t side : sides.at(m.node[j])) {
        any = true;
        in_.normal_of_side(side, own);
        if (-dot(face, own) >= facing) return false;
      }
    return any;
  });
}

// Adds the areas of bonds of meshes, where they are not what ContactAreas says. Of the remainder those for which
// something is left begin, too.
void MeshBondAreas::share_mesh_pairs(std::vector<std::int32_t>& beginning, std::span<const std::int32_t> remainder,
                                     std::vector<BondArea>& areas) const {
  if (!in_.meshes) return;
  std::vector<MeshPairBond> bonds;
  MeshPairBond made{};
  for (const std::int32_t i : beginning)
    if (as_mesh_pair_bond(i, AreaClaim::full, made)) bonds.push_back(made);
  for (const std::int32_t i : remainder)
    if (as_mesh_pair_bond(i, AreaClaim::remainder, made)) bonds.push_back(made);
  if (bonds.empty()) return;
  std::sort(bonds.begin(), bonds.end(), [](const auto& p, const auto& q) { return p.order() < q.order(); });
  const SidesOfNodes sides(in_);
  for (std::size_t first = 0, last = 0; first < bonds.size(); first = last) {
    while (last < bonds.size() && bonds[last].group() == bonds[first].group()) ++last;
    const std::span<MeshPairBond> group(&bonds[first], last - first);
    if (!MeshPairFaces(in_, sides, group).share()) continue;
    double most = 0;
    for (const MeshPairBond& b : group) most = std::max(most, b.area);
    for (const MeshPairBond& b : group) {
      const double area = b.area > area_rounding * most ? b.area : 0, own = in_.meshes->area(b.point);
      if (b.claim == AreaClaim::remainder && !(area > 0)) continue;
      if (b.claim == AreaClaim::remainder) beginning.push_back(b.candidate);
      if (std::abs(area - own) > area_rounding * own) areas.emplace_back(b.candidate, area);
    }
  }
  std::sort(beginning.begin(), beginning.end());
  std::sort(areas.begin(), areas.end());
}

} // namespace cairn
