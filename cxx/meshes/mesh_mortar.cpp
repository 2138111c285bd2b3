// Mortar contact: contact is enforced weakly, by dual mortar multipliers on the common part of both surfaces (Wohlmuth
// 2000). With D_jk = int psi_j N_k of the slave side, which is diagonal, and M_jl = int psi_j N_l of the master side,
// the gap of node j is n_j . (x_j - sum_l (M_jl / D_jj) x_l): one contact a node, see mesh_mortar_sides.cpp. This file
// selects the candidates that mortars replace.
#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "../bodies/body.hpp"
#include "../detection/candidates.hpp"
#include "mesh_set.hpp"
#include "mortar_work.hpp"

namespace cairn {

bool MeshSet::is_on_side(std::int32_t a, std::int32_t b) const {
  if (!carries(a) || !carries(b)) return false;
  const Seat &of = seat(a), &on = seat(b);
  return (of.role == Role::node || of.role == Role::point) && (on.role == Role::edge || on.role == Role::facet) &&
         of.mesh != on.mesh;
}

bool MeshSet::asks_mortar(std::int32_t a, std::int32_t b) const {
  return is_on_side(a, b) && seat(a).role == Role::node && meshes[std::size_t(seat(a).mesh)].model.mortar;
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

namespace {

bool has(const std::vector<std::int32_t>& rising, std::int32_t wanted) {
  return std::binary_search(rising.begin(), rising.end(), wanted);
}

} // namespace

// Mortar of one mesh with another, as found in this step; null: none.
const MeshSet::TakenMortar* MeshSet::taken_of(std::int32_t own, std::int32_t other) const {
  const auto begin = mortar_work_->taken.begin(), end = begin + std::ptrdiff_t(mortar_work_->used);
  const auto at = std::lower_bound(begin, end, std::pair{own, other}, [](const TakenMortar& t, const auto& wanted) {
    return t.own != wanted.first ? t.own < wanted.first : t.other < wanted.second;
  });
  return at == end || at->own != own || at->other != other ? nullptr : &*at;
}

// True if a slave side at a node faces a side of another mesh, so that their mortar decides on contact. Sides that the
// mortar of the other mesh has taken as masters are no slaves.
bool MeshSet::looks_towards(const Nodes& nodes, const Seat& node, const Seat& side) const {
  const MortarWork& work = *mortar_work_;
  const MortarSurface &surface = work.surfaces[std::size_t(node.mesh)], &there = work.surfaces[std::size_t(side.mesh)];
  const MeshBody &own = meshes[std::size_t(node.mesh)], &other = meshes[std::size_t(side.mesh)];
  const MortarPiece& facing = there.piece[std::size_t(there.piece_of_side[std::size_t(side.index)])];
  const TakenMortar* reverse = taken_of(side.mesh, node.mesh);
  for (auto e = surface.pieces_start[std::size_t(node.index)]; e < surface.pieces_start[std::size_t(node.index) + 1];
       ++e) {
    const std::int32_t piece = surface.pieces_at[std::size_t(e)];
    const std::int32_t whole = surface.piece[std::size_t(piece)].whole;
    if (!work.asks[std::size_t(node.mesh)][std::size_t(whole)] || (reverse && has(reverse->front, whole))) continue;
    if (face_each_other(nodes, own, surface.piece[std::size_t(piece)], other, facing)) return true;
  }
  return false;
}

// True if a candidate of a node or point and a side is replaced by the mortar of their meshes.
bool MeshSet::is_left_to_mortar(const Nodes& nodes, std::int32_t a, std::int32_t b) const {
  if (!is_on_side(a, b)) return false;
  const MortarWork& work = *mortar_work_;
  const Seat &of = seat(a), &on = seat(b);
  const MortarSurface &here = work.surfaces[std::size_t(of.mesh)], &there = work.surfaces[std::size_t(on.mesh)];
  if (const TakenMortar* taken = taken_of(on.mesh, of.mesh)) {
    const MortarPiece& piece = there.piece[std::size_t(there.piece_of_side[std::size_t(on.index)])];
    if (has(taken->covered, piece.whole)) return true;
    bool in_front = false, looks = false;
    for (std::size_t e = of.role == Role::node ? std::size_t(here.wholes_start[std::size_t(of.index)]) : 0,
                     end = of.role == Role::node ? std::size_t(here.wholes_start[std::size_t(of.index) + 1]) : 0;
         e < end && !looks; ++e) {
      const MortarWhole& whole = here.whole[std::size_t(here.wholes_at[e])];
      in_front = in_front || has(taken->front, here.wholes_at[e]);
      for (std::int32_t k = whole.first_piece; k < whole.end_piece; ++k)
        looks = looks || face_each_other(nodes, meshes[std::size_t(of.mesh)], here.piece[std::size_t(k)],
                                         meshes[std::size_t(on.mesh)], piece);
    }
    if (in_front && !looks) return true; // round the corner from a side that is taken
  }
  if (!asks_mortar(a, b)) return false;
  const TakenMortar* taken = taken_of(of.mesh, on.mesh);
  return (taken && has(taken->nodes, of.index)) || looks_towards(nodes, of, on);
}

// Surfaces of meshes, and the sides all of whose nodes ask.
void MeshSet::find_mortar_sides() {
  MortarWork& work = *mortar_work_;
  for (const MeshBody& mesh : meshes) {
    work.surfaces.emplace_back(mesh.model);
    work.contactor.emplace_back(std::size_t(mesh.model.nodes()), -1);
    work.contactor_of_piece.emplace_back(work.surfaces.back().piece.size(), -1);
  }
  for (std::size_t i = 0; i < seats_.size(); ++i) {
    const Seat& s = seats_[i];
    if (s.role == Role::node) work.contactor[std::size_t(s.mesh)][std::size_t(s.index)] = mapped_.contactor[i];
    if (s.role != Role::edge && s.role != Role::facet) continue;
    std::int32_t& of =
        work.contactor_of_piece[std::size_t(s.mesh)]
                               [std::size_t(work.surfaces[std::size_t(s.mesh)].piece_of_side[std::size_t(s.index)])];
    if (of < 0) of = mapped_.contactor[i];
  }
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    std::vector<std::uint8_t>& asks = work.asks.emplace_back(work.surfaces[m].whole.size(), 0);
    if (!meshes[m].model.mortar) continue;
    for (std::size_t k = 0; k < asks.size(); ++k) {
      const MortarWhole& w = work.surfaces[m].whole[k];
      asks[k] = std::all_of(w.node, w.node + w.nodes,
                            [&](std::int32_t node) { return work.contactor[m][std::size_t(node)] >= 0; });
    }
  }
}

// Nodes where a mesh that asks sees the other across the ends of a periodic cell.
const Nodes& MeshSet::seen_from(const Nodes& nodes, const MetMortar& met, const Cell& cell) {
  double shift[3] = {0, 0, 0};
  if (cell.any()) image_shift(cell, met.image, shift);
  if (!std::any_of(shift, shift + 3, [](double x) { return x < 0 || x > 0; })) return nodes;
  std::optional<Nodes>& shifted = mortar_work_->shifted;
  shifted = nodes;
  const MeshBody& other = meshes[std::size_t(met.other)];
  for (std::int64_t i = 0; i < other.model.nodes(); ++i)
    for (int k = 0; k < nodes.dim; ++k) shifted->position[other.first_node() + i][k] += shift[k];
  return *shifted;
}

// Two meshes go by the mortar of the one that asks and whose sides between contact nodes face the other; where both do,
// a side goes by that of the first. Nodes on sides that are taken so have no contact of their own; all others keep it.
void MeshSet::weigh_mortar(const Nodes& nodes, const MortarSearch& search, Candidates& c) {
  mortar_.clear();
  for (auto* of : {&mean_start_, &mean_node_, &mean_row_}) of->clear();
  mean_weight_.clear();
  if (!any_mortar_) return;
  if (!mortar_work_) {
    mortar_work_ = std::make_shared<MortarWork>();
    find_mortar_sides();
  }
  MortarWork& work = *mortar_work_;
  work.met.clear();
  for (std::int64_t i = 0; i < c.count; ++i) {
    const std::int32_t a = c.contactor_a[i], b = c.contactor_b[i];
    if (!asks_mortar(a, b)) continue;
    const Seat &of = seat(a), &on = seat(b);
    work.met.push_back({of.mesh, on.mesh, of.index,
                        work.surfaces[std::size_t(on.mesh)].piece_of_side[std::size_t(on.index)], b, c.feature[i],
                        c.image[i], c.gap[i]});
  }
  seek_sides(nodes, search);
  std::sort(work.met.begin(), work.met.end(), [](const MetMortar& x, const MetMortar& y) {
    if (x.own != y.own) return x.own < y.own;
    if (x.other != y.other) return x.other < y.other;
    if (x.image != y.image) return x.image < y.image;
    if (x.node != y.node) return x.node < y.node;
    return x.edge != y.edge ? x.edge < y.edge : x.gap < y.gap;
  });
  kept_mortar_.clear();
  work.used = 0;
  for (std::size_t i = 0, end; i < work.met.size(); i = end) {
    const MetMortar& met = work.met[i];
    const auto with = [&](const MetMortar& m) {
      return m.own == met.own && m.other == met.other && m.image == met.image;
    };
    for (end = i; end < work.met.size() && with(work.met[end]);) ++end;
    weigh_pair(seen_from(nodes, met, search.cell), {&met, end - i});
  }
  std::int64_t to = 0;
  for (std::int64_t i = 0; i < c.count; ++i)
    if (!is_left_to_mortar(nodes, c.contactor_a[i], c.contactor_b[i])) keep_candidate(c, to, i, nodes.dim);
  end_mortar(c, to + std::int64_t(kept_mortar_.size()), nodes.dim);
  for (const KeptMortar& m : kept_mortar_) put_mortar(c, to, m, nodes.dim);
  sort_mortar();
}

const MeshSet::MortarContact* MeshSet::mortar_of(std::int32_t node, std::int32_t edge) const {
  const auto at = std::lower_bound(mortar_.begin(), mortar_.end(), std::pair{node, edge},
                                   [](const MortarContact& m, const std::pair<std::int32_t, std::int32_t>& wanted) {
                                     return m.node != wanted.first ? m.node < wanted.first : m.edge < wanted.second;
                                   });
  return at == mortar_.end() || at->node != node || at->edge != edge ? nullptr : &*at;
}

} // namespace cairn
