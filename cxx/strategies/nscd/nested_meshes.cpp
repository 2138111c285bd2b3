// Meshes that begin wholly within each other or within rigid surfaces, and rigid bodies within meshes: no side is near,
// so that no contact tells; meshes that reach into each other by more than contacts see. They are looked for once, when
// they come in.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "../../contactors/shapes.hpp"
#include "../../contacts/body_axes.hpp"
#include "../../detection/detection_grid.hpp"
#include "../../fe/bulk_model.hpp"
#include "../../fe/elements.hpp"
#include "../../meshes/closed_surface.hpp"
#include "mesh_contacts.hpp"

namespace cairn {
namespace {

// Nodes of a mesh that hang together.
struct Piece {
  std::int32_t mesh = -1;
  double low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
  std::array<std::int32_t, 6> extreme{-1, -1, -1, -1, -1, -1}; // the nodes that are farthest along each axis
};

// The facets of a rigid body.
struct Shell {
  std::vector<std::int32_t> material;
  std::vector<double> corner; // (9, facets) [m]
  double low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
};

// True if the inner box lies within the outer one, or equals it.
template <class Inner, class Outer>
bool boxed(int dim, const Inner& inner, const Outer& outer) {
  bool is = true;
  for (int k = 0; k < dim; ++k) is = is && inner.low[k] >= outer.low[k] && inner.high[k] <= outer.high[k];
  return is;
}

class NestedMeshes {
public:
  // Checks pairs that contain an id from `fresh` on.
  NestedMeshes(const Simulation& s, std::int64_t fresh) : s_(s), dim_(s.scene.dim), fresh_(fresh) {}
  std::string text();

private:
  const MeshModel& model(std::int32_t mesh) const { return s_.meshes.meshes[std::size_t(mesh)].model; }
  const double* place(std::int32_t mesh) const {
    return s_.scene.nodes.position_begin[s_.meshes.meshes[std::size_t(mesh)].first_node()];
  }
  void find_pieces(std::int32_t mesh);
  void find_materials();
  bool act(std::int32_t one, std::int32_t other) const;
  bool meet(std::int32_t one, std::int32_t other) const;
  bool meet_rigid(std::int32_t contactor, std::int32_t mesh) const;
  const ClosedSurface* surface(std::int32_t mesh);
  void centre_of(std::int32_t contactor, double* x) const;
  void find_shells();
  std::vector<std::array<double, 3>> outermost(const Piece& piece) const;
  bool within(const Piece& inner, std::int32_t outer);
  bool within(const Piece& inner, const Shell& outer) const;
  bool within(std::int32_t contactor, const Piece& outer);
  std::vector<std::pair<std::int32_t, std::int32_t>> find_pairs() const;
  bool is_fresh(std::int32_t mesh) const { return model(mesh).node_ids.back() >= fresh_; }
  bool is_told(const Piece& inner, const Piece& outer);
  bool is_told(std::int32_t contactor, const Piece& outer);
  bool is_told(const Piece& inner, std::int32_t body, const Shell& outer) const;
  const std::vector<double>& below_surface(std::int32_t mesh);
  bool reaches(const Piece& inner, const Piece& outer, std::int32_t& node);
  void tell(const std::string& inner, const std::string& outer);
  std::string name_of_node(std::int32_t mesh, std::int32_t node) const;
  std::string name(const Piece& p) const { return name_of_node(p.mesh, p.extreme[0]); }

  const Simulation& s_;
  int dim_;
  std::int64_t fresh_;
  std::vector<Piece> pieces_;
  std::vector<std::int32_t> rigid_;      // contactors of bodies, but for walls
  std::map<std::int32_t, Shell> shells_; // by their bodies
  std::string told_;                     // the first one
  std::int64_t more_ = 0;
  std::vector<std::vector<std::int32_t>> points_, sides_; // materials of contact points and sides of each mesh
  std::vector<std::optional<ClosedSurface>> surface_;
  std::vector<std::int8_t> tried_;                        // surfaces that were made, or are none
  std::vector<std::vector<double>> below_;                // of each mesh, see below_surface
  std::set<std::pair<std::int32_t, std::int32_t>> asked_; // meshes of which one was sought in the other
  std::string reach_;                                     // the first that reaches into another
};

void NestedMeshes::find_pieces(std::int32_t mesh) {
  const MeshModel& m = model(mesh);
  const double* x = place(mesh);
  std::vector<std::int32_t> root(static_cast<std::size_t>(m.nodes()));
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](std::int32_t i) {
    while (root[std::size_t(i)] != i) i = root[std::size_t(i)] = root[std::size_t(root[std::size_t(i)])];
    return i;
  };
  for (std::int64_t column = 0; column < m.mass.n; ++column)
    for (auto e = m.mass.start[std::size_t(column)]; e < m.mass.start[std::size_t(column) + 1]; ++e) {
      const std::int32_t one = find(std::int32_t(column / dim_)), other = find(m.mass.row[std::size_t(e)] / dim_);
      root[std::size_t(std::max(one, other))] = std::min(one, other);
    }
  std::vector<std::int32_t> number(root.size(), -1);
  for (std::int32_t i = 0; i < std::int32_t(root.size()); ++i) {
    std::int32_t& piece = number[std::size_t(find(i))];
    if (piece < 0) {
      piece = std::int32_t(pieces_.size());
      pieces_.emplace_back().mesh = mesh;
      for (int k = 0; k < dim_; ++k) pieces_.back().low[k] = pieces_.back().high[k] = x[dim_ * i + k];
      pieces_.back().extreme.fill(i);
    }
    Piece& p = pieces_[std::size_t(piece)];
    for (int k = 0; k < dim_; ++k) {
      const double at = x[dim_ * i + k];
      if (at < p.low[k]) p.low[k] = at, p.extreme[std::size_t(2 * k)] = i;
      if (at > p.high[k]) p.high[k] = at, p.extreme[std::size_t(2 * k + 1)] = i;
    }
  }
}

void NestedMeshes::find_materials() {
  const Contactors& c = s_.scene.contactors;
  points_.resize(s_.meshes.meshes.size());
  sides_.resize(s_.meshes.meshes.size());
  for (const std::int32_t i : s_.meshes.mapped().contactor) {
    auto& of = (info(Shape(*c.shape[i])).ball() ? points_ : sides_)[std::size_t(s_.meshes.mesh_of(i))];
    if (of.empty() || of.back() != *c.material[i]) of.push_back(*c.material[i]);
  }
  for (auto* of_meshes : {&points_, &sides_})
    for (std::vector<std::int32_t>& of : *of_meshes) {
      std::sort(of.begin(), of.end());
      of.erase(std::unique(of.begin(), of.end()), of.end());
    }
}

// True if a law that pushes apart acts between two materials.
bool NestedMeshes::act(std::int32_t one, std::int32_t other) const {
  const LawRules& rules = s_.laws.rules();
  const std::int32_t rule = rules.between(one, other);
  const int entry = s_.laws.find(one, other);
  if (!rules.meets(rule) || entry < 0) return false;
  const LawInfo& law = law_infos()[std::size_t(s_.laws.entry(entry).law)];
  return !law.joins && !law.keeps;
}

bool NestedMeshes::meet(std::int32_t one, std::int32_t other) const {
  const auto any = [&](const std::vector<std::int32_t>& a, const std::vector<std::int32_t>& b) {
    return std::any_of(a.begin(), a.end(), [&](std::int32_t i) {
      return std::any_of(b.begin(), b.end(), [&](std::int32_t j) { return act(i, j); });
    });
  };
  const auto a = std::size_t(one), b = std::size_t(other);
  return any(points_[a], sides_[b]) || any(points_[b], sides_[a]);
}

bool NestedMeshes::meet_rigid(std::int32_t contactor, std::int32_t mesh) const {
  const std::int32_t material = *s_.scene.contactors.material[contactor];
  for (const auto* of : {&points_[std::size_t(mesh)], &sides_[std::size_t(mesh)]})
    for (const std::int32_t other : *of)
      if (act(material, other)) return true;
  return false;
}

const ClosedSurface* NestedMeshes::surface(std::int32_t mesh) {
  const auto at = std::size_t(mesh);
  if (!tried_[at]) {
    tried_[at] = 1;
    if (std::vector<std::int32_t> sides = closed_sides(model(mesh)); !sides.empty())
      surface_[at].emplace(dim_, std::move(sides), place(mesh));
  }
  return surface_[at] ? &*surface_[at] : nullptr;
}

// Places by which it is judged where a piece is: middles of the first cells with its outermost nodes, as nodes may
// touch from either side; of a mesh without cells these nodes.
std::vector<std::array<double, 3>> NestedMeshes::outermost(const Piece& piece) const {
  const MeshModel& m = model(piece.mesh);
  const double* x = place(piece.mesh);
  std::vector<std::array<double, 3>> out(std::size_t(2 * dim_), {0, 0, 0});
  std::array<bool, 6> found{};
  const auto look = [&](const ElementInfo& e, const std::vector<std::int32_t>& node) {
    for (std::size_t i = 0; i < node.size(); ++i)
      for (std::size_t k = 0; k < out.size(); ++k) {
        if (found[k] || node[i] != piece.extreme[k]) continue;
        found[k] = true;
        const std::size_t first = i - i % std::size_t(e.nodes);
        for (std::size_t j = first; j < first + std::size_t(e.nodes); ++j)
          for (int d = 0; d < dim_; ++d) out[k][std::size_t(d)] += x[dim_ * node[j] + d] / e.nodes;
      }
  };
  for (const ElasticCells& c : m.cells) look(*c.element, c.node);
  if (const BulkModel* solid = m.bulk ? m.bulk->solid() : nullptr)
    for (const BulkCells& c : solid->cells()) look(*c.element, c.node);
  for (std::size_t k = 0; k < out.size(); ++k)
    if (!found[k]) std::copy_n(x + dim_ * piece.extreme[k], dim_, out[k].begin());
  return out;
}

bool NestedMeshes::within(const Piece& inner, std::int32_t outer) {
  const ClosedSurface* round = surface(outer);
  if (!round) return false;
  const auto at = outermost(inner);
  return std::all_of(at.begin(), at.end(), [&](const auto& x) { return round->turns(x.data()) >= 1; });
}

void NestedMeshes::find_shells() {
  const Contactors& c = s_.scene.contactors;
  const Bodies& b = s_.scene.bodies;
  for (std::int32_t i = 0; i < std::int32_t(c.count); ++i) {
    const std::int32_t body = *c.body[i];
    if (!info(Shape(*c.shape[i])).facet() || body < 0) continue;
    const auto [at, fresh] = shells_.try_emplace(body);
    Shell& shell = at->second;
    if (std::find(shell.material.begin(), shell.material.end(), *c.material[i]) == shell.material.end())
      shell.material.push_back(*c.material[i]);
    double centre[3];
    centre_of(i, centre);
    const double* vertex = &c.hulls.vertex[std::size_t(3 * c.hulls.first_vertex[std::size_t(*c.hull[i])])];
    for (int j = 0; j < 3; ++j) { // its own vertices are the first of a facet
      double x[3] = {vertex[3 * j], vertex[3 * j + 1], vertex[3 * j + 2]};
      if (b.rotation.active) turn_about(b.rotation_begin[body], 1, x, x);
      for (int k = 0; k < 3; ++k) {
        x[k] += centre[k];
        shell.low[k] = std::min(fresh && j == 0 ? x[k] : shell.low[k], x[k]);
        shell.high[k] = std::max(fresh && j == 0 ? x[k] : shell.high[k], x[k]);
      }
      shell.corner.insert(shell.corner.end(), x, x + 3);
    }
  }
}

// Solid angle of closed facets about a point / 4 pi (Van Oosterom & Strackee 1983): 1 inside, -1 in a cavity, 0
// outside, values in between if the surface has a hole. Vertices that facets share may differ by rounding, since each
// facet has a centre of its own.
double covered(const std::vector<double>& corner, const double* point) {
  double sum = 0;
  for (std::size_t f = 0; f < corner.size(); f += 9) {
    double u[3][3], dot[3] = {0, 0, 0};
    for (int j = 0; j < 3; ++j) {
      double square = 0;
      for (int k = 0; k < 3; ++k) u[j][k] = corner[f + std::size_t(3 * j + k)] - point[k], square += u[j][k] * u[j][k];
      for (double& x : u[j]) x /= square > 0 ? std::sqrt(square) : 1;
    }
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) dot[j] += u[j][k] * u[(j + 1) % 3][k];
    double volume = 0;
    for (int k = 0; k < 3; ++k)
      volume += u[0][k] * (u[1][(k + 1) % 3] * u[2][(k + 2) % 3] - u[1][(k + 2) % 3] * u[2][(k + 1) % 3]);
    sum += std::atan2(volume, 1 + dot[0] + dot[1] + dot[2]);
  }
  return sum / (2 * std::numbers::pi);
}

bool NestedMeshes::within(const Piece& inner, const Shell& outer) const {
  constexpr double whole = 1 - 1e-6; // what may miss by rounding
  const auto at = outermost(inner);
  return std::all_of(at.begin(), at.end(), [&](const auto& x) { return covered(outer.corner, x.data()) > whole; });
}

void NestedMeshes::centre_of(std::int32_t contactor, double* x) const {
  const Contactors& c = s_.scene.contactors;
  const Bodies& b = s_.scene.bodies;
  std::int64_t unused = 0;
  cairn_contactor_centres(dim_, contactor, contactor + 1, c.body.values.data(), b.position_begin.values.data(),
                          c.offset.active, c.offset.active ? c.offset.values.data() : nullptr, b.rotation.active,
                          b.rotation.active ? b.rotation_begin.values.data() : nullptr, x - dim_ * contactor, &unused);
}

// True if a ball or hull lies wholly within a mesh; a hull counts by its inscribed ball.
bool NestedMeshes::within(std::int32_t contactor, const Piece& outer) {
  constexpr double inside = 1 - 1e-3; // of the radius: an inscribed body that touches counts as within
  const Contactors& c = s_.scene.contactors;
  double x[3];
  centre_of(contactor, x);
  for (int k = 0; k < dim_; ++k)
    if (!(x[k] > outer.low[k] && x[k] < outer.high[k])) return false;
  const ClosedSurface* round = surface(outer.mesh);
  if (!round || round->turns(x) < 1) return false;
  const std::int32_t hull = c.hull.active ? *c.hull[contactor] : -1;
  const double reach = inside * (hull < 0 ? *c.radius[contactor] : c.hulls.inner[std::size_t(hull)]);
  for (int k = 0; k < dim_; ++k)
    for (const double way : {-reach, reach}) {
      double there[] = {x[0], x[1], dim_ == 3 ? x[2] : 0};
      there[k] += way;
      if (round->turns(there) < 1) return false;
    }
  return true;
}

std::string NestedMeshes::name_of_node(std::int32_t mesh, std::int32_t node) const {
  const MeshModel& m = model(mesh);
  const std::string name = m.bulk ? m.bulk->place_of_node(node) + "," : "node " + std::to_string(node);
  return name + " of the mesh '" + m.name + "'";
}

// Candidate pairs (inner, outer piece) by bounding balls; index of a piece or, behind these, of a rigid contactor.
std::vector<std::pair<std::int32_t, std::int32_t>> NestedMeshes::find_pairs() const {
  const Contactors& c = s_.scene.contactors;
  const auto pieces = std::int64_t(pieces_.size()), n = pieces + std::int64_t(rigid_.size());
  std::vector<double> x(std::size_t(dim_ * n)), reach(static_cast<std::size_t>(n));
  for (std::int64_t i = 0; i < pieces; ++i) {
    const Piece& p = pieces_[std::size_t(i)];
    double square = 0;
    for (int k = 0; k < dim_; ++k) {
      const double half = 0.5 * (p.high[k] - p.low[k]);
      x[std::size_t(dim_ * i + k)] = p.low[k] + half;
      square += half * half;
    }
    reach[std::size_t(i)] = std::sqrt(square);
  }
  for (std::int64_t i = pieces; i < n; ++i) {
    const std::int32_t contactor = rigid_[std::size_t(i - pieces)], hull = c.hull.active ? *c.hull[contactor] : -1;
    centre_of(contactor, &x[std::size_t(dim_ * i)]);
    reach[std::size_t(i)] = hull < 0 ? *c.radius[contactor] : c.hulls.radius[std::size_t(hull)];
  }
  Scratch scratch;
  DetectionGrid grid;
  grid.build(dim_, n, x.data(), reach.data(), scratch);
  Array<std::int32_t> hits;
  const std::int64_t met = grid.search(0, grid.cells(), hits);
  std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
  for (std::int64_t k = 0; k < met; ++k) {
    const std::int32_t one = grid.order()[hits[std::size_t(2 * k)]], other = grid.order()[hits[std::size_t(2 * k + 1)]];
    if (other < pieces) pairs.emplace_back(one, other);
    if (one < pieces) pairs.emplace_back(other, one);
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

bool NestedMeshes::is_told(const Piece& inner, const Piece& outer) {
  return inner.mesh != outer.mesh && (is_fresh(inner.mesh) || is_fresh(outer.mesh)) && boxed(dim_, inner, outer) &&
         meet(inner.mesh, outer.mesh) && within(inner, outer.mesh);
}

bool NestedMeshes::is_told(std::int32_t contactor, const Piece& outer) {
  const std::int64_t body = carrier_id(s_.scene.bodies, s_.scene.contactors, contactor);
  return (body >= fresh_ || is_fresh(outer.mesh)) && meet_rigid(contactor, outer.mesh) && within(contactor, outer);
}

bool NestedMeshes::is_told(const Piece& inner, std::int32_t body, const Shell& outer) const {
  if (!(*s_.scene.bodies.id[body] >= fresh_ || is_fresh(inner.mesh)) || !boxed(dim_, inner, outer)) return false;
  const std::vector<std::int32_t>& points = points_[std::size_t(inner.mesh)];
  const bool meet = std::any_of(points.begin(), points.end(), [&](std::int32_t i) {
    return std::any_of(outer.material.begin(), outer.material.end(), [&](std::int32_t j) { return act(i, j); });
  });
  return meet && within(inner, outer);
}

// Points a quarter of the way from each contact node to the centre of one of its cells [m], NaN at other nodes: a body
// that contains such a point overlaps the mesh by more than an eighth of the cell.
const std::vector<double>& NestedMeshes::below_surface(std::int32_t mesh) {
  std::vector<double>& out = below_[std::size_t(mesh)];
  if (!out.empty()) return out;
  const MeshModel& m = model(mesh);
  const double* x = place(mesh);
  out.assign(std::size_t(m.dofs()), std::numeric_limits<double>::quiet_NaN());
  const auto look = [&](const ElementInfo& e, const std::vector<std::int32_t>& node) {
    for (std::size_t first = 0; first < node.size(); first += std::size_t(e.nodes))
      for (std::size_t i = first; i < first + std::size_t(e.nodes); ++i) {
        double* at = &out[std::size_t(dim_ * node[i])];
        if (!m.options.last[std::size_t(dim_ * node[i])] || !std::isnan(at[0])) continue;
        for (int k = 0; k < dim_; ++k) {
          double middle = 0;
          for (std::size_t j = first; j < first + std::size_t(e.nodes); ++j) middle += x[dim_ * node[j] + k] / e.nodes;
          at[k] = 0.75 * x[dim_ * node[i] + k] + 0.25 * middle;
        }
      }
  };
  for (const ElasticCells& c : m.cells) look(*c.element, c.node);
  if (const BulkModel* solid = m.bulk ? m.bulk->solid() : nullptr)
    for (const BulkCells& c : solid->cells()) look(*c.element, c.node);
  return out;
}

// True if a mesh penetrates another deeper than contacts detect; node: the first that does.
bool NestedMeshes::reaches(const Piece& inner, const Piece& outer, std::int32_t& node) {
  if (inner.mesh == outer.mesh || !(is_fresh(inner.mesh) || is_fresh(outer.mesh)) || !meet(inner.mesh, outer.mesh))
    return false;
  if (!asked_.insert({inner.mesh, outer.mesh}).second) return false;
  const std::vector<double>& below = below_surface(inner.mesh);
  for (std::int32_t i = 0; i < std::int32_t(model(inner.mesh).nodes()); ++i) {
    const double* x = &below[std::size_t(dim_ * i)];
    if (std::isnan(x[0])) continue;
    const ClosedSurface* round = surface(outer.mesh);
    if (!round) return false;
    if (round->turns(x) < 1) continue;
    node = i;
    return true;
  }
  return false;
}

void NestedMeshes::tell(const std::string& inner, const std::string& outer) {
  if (told_.empty())
    told_ = inner + ", which lies wholly within " + outer + " at the begin of step " + std::to_string(s_.steps + 1);
  else
    ++more_;
}

std::string NestedMeshes::text() {
  const auto meshes = std::int32_t(s_.meshes.meshes.size());
  const Contactors& c = s_.scene.contactors;
  for (std::int32_t i = 0; i < std::int32_t(c.count); ++i)
    if (const ShapeInfo& shape = info(Shape(*c.shape[i])); *c.body[i] >= 0 && shape.mover) rigid_.push_back(i);
  if (dim_ == 3) find_shells();
  if (meshes < 2 && rigid_.empty() && shells_.empty()) return {};
  find_materials();
  surface_.resize(std::size_t(meshes));
  tried_.assign(std::size_t(meshes), 0);
  below_.resize(std::size_t(meshes));
  for (std::int32_t mesh = 0; mesh < meshes; ++mesh)
    if (!points_[std::size_t(mesh)].empty() || !sides_[std::size_t(mesh)].empty()) find_pieces(mesh);
  const auto pieces = std::int32_t(pieces_.size());
  const auto name_of_body = [](std::int64_t id) { return "body " + std::to_string(id); };
  std::pair<std::int32_t, std::int32_t> last{-1, -1}; // an inner one, and a mesh: pieces of it follow each other
  for (const auto& [inner, outer] : find_pairs()) {
    const Piece& round = pieces_[std::size_t(outer)];
    const std::int32_t contactor = inner < pieces ? -1 : rigid_[std::size_t(inner - pieces)];
    const std::pair both{inner, round.mesh};
    if (both == last) continue;
    if (!(contactor < 0 ? is_told(pieces_[std::size_t(inner)], round) : is_told(contactor, round))) {
      if (std::int32_t node = -1; contactor < 0 && reach_.empty() && reaches(pieces_[std::size_t(inner)], round, node))
        reach_ = name_of_node(pieces_[std::size_t(inner)].mesh, node) + " reaches into the mesh '" +
                 model(round.mesh).name + "' by over an eighth of a cell at the begin of step " +
                 std::to_string(s_.steps + 1) +
                 ": contacts see what is near a side alone, and may not push all of it apart; let them begin apart, or "
                 "let them pass through each other, with no law";
      continue;
    }
    last = both;
    tell(contactor < 0 ? name(pieces_[std::size_t(inner)]) : name_of_body(carrier_id(s_.scene.bodies, c, contactor)),
         "the mesh '" + model(round.mesh).name + "'");
  }
  for (const auto& [body, shell] : shells_)
    for (const Piece& p : pieces_)
      if (is_told(p, body, shell)) tell(name(p), name_of_body(*s_.scene.bodies.id[body]));
  if (told_.empty()) return reach_;
  if (more_ > 0) told_ += ", as " + std::to_string(more_) + " more do";
  return told_ + ": no side is near, and contacts do not push them apart; let them begin apart, or let them pass "
                 "through each other, with no law";
}

} // namespace

void NestedMeshLook::look(Simulation& s) {
  s.report.mesh_within.clear();
  if (s.meshes.empty()) return;
  if (seen_ != s.scene.next_body_id) {
    hint_ = NestedMeshes(s, seen_).text();
    seen_ = s.scene.next_body_id;
    step_ = s.steps;
  }
  if (step_ == s.steps) s.report.mesh_within = hint_;
}

} // namespace cairn
