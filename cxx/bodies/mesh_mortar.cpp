// Mortar contact of sides of first order in the plane (others: mesh_mortar_sides.cpp): a node of a side that asks for
// it meets the sides of another mesh on average over its shape function, by dual multipliers on the common segments
// (Wohlmuth 2000). With D_jk = int psi_j N_k of that side, which is diagonal, and M_jl = int psi_j N_l of the other,
// the gap of node j is n_j . (x_j - sum_l (M_jl / D_jj) x_l): one contact a node, which rests on one node here and with
// weights M_jl / D_jj, whose sum is 1, on those there.
#include <algorithm>
#include <array>
#include <cmath>

#include "../base/call.hpp"
#include "../detection/candidates.hpp"
#include "body.hpp"
#include "mesh_set.hpp"
#include "mortar_work.hpp"

namespace cairn {
namespace {

constexpr double least_share = 1e-6; // of a side, that counts as common

double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1]; }

} // namespace

namespace {

class MortarNode {
public:
  MortarNode(const Nodes& nodes, const MeshBody& own, const MeshBody& other, MortarWork& work)
      : nodes_(nodes), own_(own), other_(other), work_(work) {
    work.nodes.clear();
    work.weights.clear();
  }

  // Adds what a side of its own that ends, or begins, at the node has in common with the other mesh.
  void add_side(std::int32_t side, bool ends) {
    const std::int32_t* node = &own_.model.side_nodes[4 * std::size_t(side)];
    const double *a = place(own_, node[0]), *b = place(own_, node[1]);
    double along[2] = {b[0] - a[0], b[1] - a[1]};
    const double length = std::sqrt(dot(along, along));
    for (double& k : along) k /= length;
    const double out[2] = {along[1], -along[0]}; // the body is on the left
    find_segments(a, along, length);
    double me[3] = {0, 0, 0}, de[2] = {0, 0};
    for (const MortarSegment& s : work_.segments)
      each_point(s, length, [&](double xi, double, double wide) {
        const double one = 1 - xi;
        me[0] += wide * one * one;
        me[1] += wide * one * xi;
        me[2] += wide * xi * xi;
        de[0] += wide * one;
        de[1] += wide * xi;
      });
    const double determinant = me[0] * me[2] - me[1] * me[1];
    if (!(de[0] + de[1] > least_share * length) || !(determinant > 0)) return;
    const double own = de[ends ? 1 : 0];
    // psi = de M^-1 N on what is common, so that int psi_j N_k = delta_jk de_j there
    const double of_one = own * (ends ? -me[1] : me[2]) / determinant,
                 of_two = own * (ends ? me[0] : -me[1]) / determinant;
    diagonal_ += own;
    for (int k = 0; k < 2; ++k) normal_[k] -= own * out[k];
    for (const MortarSegment& s : work_.segments) {
      double m[2] = {0, 0};
      each_point(s, length, [&](double xi, double eta, double wide) {
        const double psi = of_one * (1 - xi) + of_two * xi;
        m[0] += wide * psi * (1 - eta);
        m[1] += wide * psi * eta;
      });
      const std::int32_t* there = &other_.model.side_nodes[4 * std::size_t(s.side)];
      for (int k = 0; k < 2; ++k) add(there[k], m[k]);
    }
  }

  // Gap and normal, from the other mesh to the node; the work then has the nodes there and their weights. False:
  // nothing is common.
  bool finish(std::int32_t node, double& gap, double* normal) {
    const double size = std::sqrt(dot(normal_, normal_));
    if (!(diagonal_ > 0) || !(size > 0)) return false;
    const double* x = place(own_, node);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < work_.nodes.size(); ++k) {
      const double weight = work_.weights[k] / diagonal_;
      if (std::abs(weight) < 1e-14) continue; // what rounding left of an end
      work_.nodes[kept] = work_.nodes[k];
      work_.weights[kept++] = weight;
    }
    work_.nodes.resize(kept);
    work_.weights.resize(kept);
    for (int k = 0; k < 2; ++k) normal[k] = normal_[k] / size;
    gap = 0;
    for (std::size_t j = 0; j < kept; ++j) {
      const double* y = place(other_, work_.nodes[j]);
      for (int k = 0; k < 2; ++k) gap += work_.weights[j] * normal[k] * (x[k] - y[k]);
    }
    return kept > 0;
  }

private:
  const double* place(const MeshBody& mesh, std::int32_t node) const { return nodes_.position[mesh.node(node)]; }

  void add(std::int32_t node, double weight) {
    const auto at = std::find(work_.nodes.begin(), work_.nodes.end(), node);
    if (at != work_.nodes.end()) {
      work_.weights[std::size_t(at - work_.nodes.begin())] += weight;
      return;
    }
    work_.nodes.push_back(node);
    work_.weights.push_back(weight);
  }

  // Three Gauss points: products of three linear functions are exact.
  template <class Use>
  static void each_point(const MortarSegment& s, double length, Use&& use) {
    constexpr double point[3] = {-0.7745966692414834, 0, 0.7745966692414834};
    constexpr double weight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    for (int g = 0; g < 3; ++g) {
      const double t = (1 + point[g]) / 2;
      use(s.low + (s.high - s.low) * t, s.eta_low + (s.eta_high - s.eta_low) * t,
          weight[g] * (s.high - s.low) * length);
    }
  }

  // Sides of the other mesh in front of one of its own: from those that detection saw along the boundary, both ways.
  void find_segments(const double* a, const double* along, double length) {
    work_.segments.clear();
    work_.seen.clear();
    for (const std::int32_t seed : work_.seeds) {
      walk(seed, true, a, along, length);
      walk(seed, false, a, along, length);
    }
    std::sort(work_.segments.begin(), work_.segments.end(),
              [](const MortarSegment& s, const MortarSegment& t) { return s.low < t.low; });
  }

  void walk(std::int32_t side, bool forward, const double* a, const double* along, double length) {
    constexpr int most_apart = 2; // sides beside the one in question before the walk ends
    const MeshModel& m = other_.model;
    for (int apart = 0; side >= 0 && apart <= most_apart;) {
      const std::int32_t* node = &m.side_nodes[4 * std::size_t(side)];
      const bool met = common(side, a, along, length);
      apart = met ? 0 : apart + 1;
      side = forward ? m.side_from[std::size_t(node[1])] : m.side_to[std::size_t(node[0])];
    }
  }

  // Whether a side is in front, and its common part if it is new.
  bool common(std::int32_t side, const double* a, const double* along, double length) {
    const std::int32_t* node = &other_.model.side_nodes[4 * std::size_t(side)];
    double at[2];
    for (int e = 0; e < 2; ++e) {
      const double* x = place(other_, node[e]);
      const double r[2] = {x[0] - a[0], x[1] - a[1]};
      at[e] = dot(r, along) / length;
    }
    if (!(at[1] < at[0])) return false; // it looks the same way
    const double low = std::max(at[1], 0.0), high = std::min(at[0], 1.0);
    if (!(high - low > least_share)) return false;
    if (std::find(work_.seen.begin(), work_.seen.end(), side) != work_.seen.end()) return false;
    work_.seen.push_back(side);
    const double span = at[1] - at[0];
    work_.segments.push_back({low, high, side, (low - at[0]) / span, (high - at[0]) / span});
    return true;
  }

  const Nodes& nodes_;
  const MeshBody &own_, &other_;
  MortarWork& work_;
  double diagonal_ = 0, normal_[2] = {0, 0};
};

} // namespace

// The pair of sides is met once: by the nodes that ask, or of two meshes that do by those of the first.
bool MeshSet::mortar_first(std::int32_t one, std::int32_t other) const {
  return meshes[std::size_t(one)].model.mortar && (one < other || !meshes[std::size_t(other)].model.mortar);
}

bool MeshSet::asks_mortar(std::int32_t a, std::int32_t b) const {
  if (!carries(a) || !carries(b)) return false;
  const Seat &of = seat(a), &on = seat(b);
  return of.role == Role::node && (on.role == Role::edge || on.role == Role::facet) && of.mesh != on.mesh &&
         mortar_first(of.mesh, on.mesh);
}

bool MeshSet::gives_back_to_mortar(std::int32_t a, std::int32_t b) const {
  if (!carries(a) || !carries(b) || seat(a).mesh == seat(b).mesh) return false;
  if (seat(b).role != Role::edge && seat(b).role != Role::facet) return false;
  const bool sides = !meshes[std::size_t(seat(a).mesh)].model.side_nodes.empty();
  return sides && mortar_first(seat(b).mesh, seat(a).mesh);
}

void MeshSet::put_mortar(Candidates& c, std::int64_t& to, const KeptMortar& m, int dim) const {
  c.contactor_a[to] = m.node;
  c.contactor_b[to] = m.edge;
  c.feature[to] = m.feature;
  c.image[to] = m.image;
  c.gap[to] = m.gap;
  std::copy_n(m.normal, dim, &c.normal[std::size_t(dim) * std::size_t(to)]);
  std::copy_n(m.point, dim, &c.point[std::size_t(dim) * std::size_t(to)]);
  ++to;
}

void MeshSet::end_mortar(Candidates& c, std::int64_t count, int dim) {
  c.count = count;
  for (auto* array : {&c.contactor_a, &c.contactor_b, &c.image, &c.feature}) array->resize(std::size_t(count));
  c.gap.resize(std::size_t(count));
  c.normal.resize(std::size_t(dim * count));
  c.point.resize(std::size_t(dim * count));
}

void MeshSet::sort_mortar() {
  std::sort(mortar_.begin(), mortar_.end(), [](const MortarContact& one, const MortarContact& two) {
    return one.node != two.node ? one.node < two.node : one.edge < two.edge;
  });
}

void MeshSet::map_mean(Mapping& m, std::span<const std::int32_t> node, std::span<const double> weight) {
  const auto n = std::ptrdiff_t(node.size());
  std::int32_t heaviest[4];
  int kept = 0;
  const auto heavier = [&](std::int32_t i, std::int32_t j) {
    return std::abs(weight[std::size_t(i)]) > std::abs(weight[std::size_t(j)]);
  };
  for (std::int32_t i = 0; i < n; ++i) { // few: each goes to its place
    int at = kept < 4 ? kept++ : 4;
    if (n <= 4) {
      heaviest[at] = i;
      continue;
    }
    for (; at > 0 && heavier(i, heaviest[at - 1]); --at)
      if (at < 4) heaviest[at] = heaviest[at - 1];
    if (at < 4) heaviest[at] = i;
  }
  for (int j = 0; j < kept; ++j) {
    m.node[j] = node[std::size_t(heaviest[j])];
    m.weight[j] = weight[std::size_t(heaviest[j])];
  }
  if (n <= 4) return;
  if (mean_start_.empty()) mean_start_.push_back(0);
  m.mean = std::int32_t(mean_row_.size());
  mean_node_.insert(mean_node_.end(), node.begin(), node.end());
  mean_weight_.insert(mean_weight_.end(), weight.begin(), weight.end());
  mean_start_.push_back(std::int32_t(mean_node_.size()));
  mean_row_.push_back(-1);
}

void keep_candidate(Candidates& c, std::int64_t& to, std::int64_t i, int dim) {
  c.contactor_a[to] = c.contactor_a[i];
  c.contactor_b[to] = c.contactor_b[i];
  c.feature[to] = c.feature[i];
  c.image[to] = c.image[i];
  c.gap[to] = c.gap[i];
  for (int k = 0; k < dim; ++k) {
    c.normal[dim * to + k] = c.normal[dim * i + k];
    c.point[dim * to + k] = c.point[dim * i + k];
  }
  ++to;
}

// Candidates of nodes that ask for it: one of each for each mesh that it faces, with the gap, the normal and the nodes
// of the mortar.
void MeshSet::weigh_mortar(const Nodes& nodes, Candidates& c) {
  mortar_.clear();
  for (auto* of : {&mean_start_, &mean_node_, &mean_row_}) of->clear();
  mean_weight_.clear();
  if (!any_mortar_) return;
  if (!mortar_work_) mortar_work_ = std::make_shared<MortarWork>();
  MortarWork& work = *mortar_work_;
  if (by_sides_) return weigh_sides(nodes, c);
  std::int64_t to = 0;
  for (std::int64_t i = 0, end; i < c.count; i = end) {
    end = i + 1;
    if (!asks_mortar(c.contactor_a[i], c.contactor_b[i])) {
      if (!gives_back_to_mortar(c.contactor_a[i], c.contactor_b[i])) keep_candidate(c, to, i, 2);
      continue;
    }
    const std::int32_t node = c.contactor_a[i];
    const Seat& of = seat(node);
    while (end < c.count && c.contactor_a[end] == node && asks_mortar(node, c.contactor_b[end])) ++end;
    for (std::int64_t k = i; k < end; ++k) { // the first of each mesh that it faces
      const std::int32_t which = seat(c.contactor_b[k]).mesh;
      bool known = false;
      for (std::int64_t j = i; j < k; ++j) known = known || seat(c.contactor_b[j]).mesh == which;
      if (known) continue;
      std::int64_t nearest = k;
      work.seeds.clear();
      for (std::int64_t j = k; j < end; ++j) {
        if (seat(c.contactor_b[j]).mesh != which) continue;
        work.seeds.push_back(seat(c.contactor_b[j]).index);
        if (std::abs(c.gap[j]) < std::abs(c.gap[nearest])) nearest = j;
      }
      const MeshBody& own = meshes[std::size_t(of.mesh)];
      MortarNode mortar(nodes, own, meshes[std::size_t(which)], work);
      if (const std::int32_t side = own.model.side_to[std::size_t(of.index)]; side >= 0) mortar.add_side(side, true);
      if (const std::int32_t side = own.model.side_from[std::size_t(of.index)]; side >= 0) mortar.add_side(side, false);
      Mapping there;
      there.mesh = which;
      double gap = 0, normal[2];
      if (!mortar.finish(of.index, gap, normal)) continue;
      map_mean(there, work.nodes, work.weights);
      const std::int32_t edge = c.contactor_b[nearest];
      const double* x = nodes.position[of.middle.node[0]];
      mortar_.push_back({node, edge, there, {}});
      // places up to here were read already: what is kept stands before them
      const std::int32_t image = c.image[nearest], feature = c.feature[nearest];
      kept_mortar_.push_back({node, edge, feature, image, gap, {normal[0], normal[1], 0}, {x[0], x[1], 0}});
    }
    for (const KeptMortar& m : kept_mortar_) put_mortar(c, to, m, 2);
    kept_mortar_.clear();
  }
  sort_mortar();
  end_mortar(c, to, 2);
}

const MeshSet::MortarContact* MeshSet::mortar_of(std::int32_t node, std::int32_t edge) const {
  const auto at = std::lower_bound(mortar_.begin(), mortar_.end(), std::pair{node, edge},
                                   [](const MortarContact& m, const std::pair<std::int32_t, std::int32_t>& wanted) {
                                     return m.node != wanted.first ? m.node < wanted.first : m.edge < wanted.second;
                                   });
  return at == mortar_.end() || at->node != node || at->edge != edge ? nullptr : &*at;
}

} // namespace cairn
