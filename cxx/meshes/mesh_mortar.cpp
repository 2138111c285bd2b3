// Mortar contact: contact is enforced weakly, by dual mortar multipliers on the common part of both surfaces (Wohlmuth
// 2000). With D_jk = int psi_j N_k of the slave side, which is diagonal, and M_jl = int psi_j N_l of the master side,
// the gap of node j is n_j . (x_j - sum_l (M_jl / D_jj) x_l): one contact a node, see mesh_mortar_sides.cpp. This file
// selects the candidates that mortars replace.
#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "../bodies/body.hpp"
#include "../detection/candidates.hpp"
#include "mortar_contacts.hpp"
#include "mortar_work.hpp"

namespace cairn {

namespace {

using Role = MeshSeats::Role;

// True if a is a node or a point, and b a side of another mesh.
bool is_on_side(const MeshSeats& seats, std::int32_t a, std::int32_t b) {
  if (!seats.carries(a) || !seats.carries(b)) return false;
  const MeshSeats::Seat &of = seats.seat(a), &on = seats.seat(b);
  return (of.role == Role::node || of.role == Role::point) && on.is_side() && of.mesh != on.mesh;
}

void resize(Candidates& c, std::int64_t count, int dim) {
  c.count = count;
  for (auto* array : {&c.contactor_a, &c.contactor_b, &c.image, &c.feature}) array->resize(std::size_t(count));
  c.gap.resize(std::size_t(count));
  c.normal.resize(std::size_t(dim * count));
  c.point.resize(std::size_t(dim * count));
}

bool has(const std::vector<std::int32_t>& rising, std::int32_t wanted) {
  return std::binary_search(rising.begin(), rising.end(), wanted);
}

// Candidate i in the place of `to`, which is not behind it.
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

} // namespace

bool MortarContacts::asks(const MeshSeats& seats, std::int32_t a, std::int32_t b) {
  return is_on_side(seats, a, b) && seats.seat(a).role == Role::node && seats.seat(a).body->model.mortar;
}

void MortarContacts::begin(const MeshList& meshes) {
  any_ = std::any_of(meshes.begin(), meshes.end(), [](const MeshBody& m) { return m.model.mortar; });
  work_.reset(); // it is of the meshes that were
}

void NodeMeans::map(Mapping& m, std::span<const std::int32_t> nodes, std::span<const double> weights) {
  const auto n = std::ptrdiff_t(nodes.size());
  std::int32_t heaviest[4];
  int kept = 0;
  const auto heavier = [&](std::int32_t i, std::int32_t j) {
    return std::abs(weights[std::size_t(i)]) > std::abs(weights[std::size_t(j)]);
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
    m.node[j] = nodes[std::size_t(heaviest[j])];
    m.weight[j] = weights[std::size_t(heaviest[j])];
  }
  if (n <= 4) return;
  if (start.empty()) start.push_back(0);
  m.mean = std::int32_t(count());
  node.insert(node.end(), nodes.begin(), nodes.end());
  weight.insert(weight.end(), weights.begin(), weights.end());
  start.push_back(std::int32_t(node.size()));
}

// Mortar of one mesh with another, as found in this step; null: none.
const MortarContacts::Taken* MortarContacts::taken_of(std::int32_t own, std::int32_t other) const {
  const auto begin = work_->taken.begin(), end = begin + std::ptrdiff_t(work_->used);
  const auto at = std::lower_bound(begin, end, std::pair{own, other}, [](const Taken& t, const auto& wanted) {
    return t.own != wanted.first ? t.own < wanted.first : t.other < wanted.second;
  });
  return at == end || at->own != own || at->other != other ? nullptr : &*at;
}

// True if a slave side at a node faces a side of another mesh, so that their mortar decides on contact. Sides that the
// mortar of the other mesh has taken as masters are no slaves.
bool MortarContacts::looks_towards(const Nodes& nodes, const Seat& node, const Seat& side) const {
  const MortarWork& work = *work_;
  const MortarSurface &surface = work.surfaces[std::size_t(node.mesh)], &there = work.surfaces[std::size_t(side.mesh)];
  const MeshBody &own = *node.body, &other = *side.body;
  const MortarPiece& facing = there.piece[std::size_t(there.piece_of_side[std::size_t(side.index)])];
  const Taken* reverse = taken_of(side.mesh, node.mesh);
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
bool MortarContacts::replaces(const MeshSeats& seats, const Nodes& nodes, std::int32_t a, std::int32_t b) const {
  if (!is_on_side(seats, a, b)) return false;
  const MortarWork& work = *work_;
  const Seat &of = seats.seat(a), &on = seats.seat(b);
  const MortarSurface &here = work.surfaces[std::size_t(of.mesh)], &there = work.surfaces[std::size_t(on.mesh)];
  if (const Taken* taken = taken_of(on.mesh, of.mesh)) {
    const MortarPiece& piece = there.piece[std::size_t(there.piece_of_side[std::size_t(on.index)])];
    if (has(taken->covered, piece.whole)) return true;
    bool in_front = false, looks = false;
    for (std::size_t e = of.role == Role::node ? std::size_t(here.wholes_start[std::size_t(of.index)]) : 0,
                     end = of.role == Role::node ? std::size_t(here.wholes_start[std::size_t(of.index) + 1]) : 0;
         e < end && !looks; ++e) {
      const MortarWhole& whole = here.whole[std::size_t(here.wholes_at[e])];
      in_front = in_front || has(taken->front, here.wholes_at[e]);
      for (std::int32_t k = whole.first_piece; k < whole.end_piece; ++k)
        looks = looks || face_each_other(nodes, *of.body, here.piece[std::size_t(k)], *on.body, piece);
    }
    if (in_front && !looks) return true; // round the corner from a side that is taken
  }
  if (!asks(seats, a, b)) return false;
  const Taken* taken = taken_of(of.mesh, on.mesh);
  return (taken && has(taken->nodes, of.index)) || looks_towards(nodes, of, on);
}

// Surfaces of meshes, and the sides all of whose nodes ask.
void MortarContacts::find_sides(const MeshList& meshes, const MeshSeats& seats) {
  MortarWork& work = *work_;
  for (const MeshBody& mesh : meshes) {
    work.meshes.push_back(&mesh);
    work.surfaces.emplace_back(mesh.model);
    work.contactor.emplace_back(std::size_t(mesh.model.nodes()), -1);
    work.contactor_of_piece.emplace_back(work.surfaces.back().piece.size(), -1);
  }
  for (std::size_t i = 0; i < seats.seats().size(); ++i) {
    const Seat& s = seats.seats()[i];
    if (s.role == Role::node) work.contactor[std::size_t(s.mesh)][std::size_t(s.index)] = seats.mapped().contactor[i];
    if (!s.is_side()) continue;
    std::int32_t& of =
        work.contactor_of_piece[std::size_t(s.mesh)]
                               [std::size_t(work.surfaces[std::size_t(s.mesh)].piece_of_side[std::size_t(s.index)])];
    if (of < 0) of = seats.mapped().contactor[i];
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
const Nodes& MortarContacts::seen_from(const Nodes& nodes, const Met& met, const Cell& cell) {
  double shift[3] = {0, 0, 0};
  if (cell.any()) image_shift(cell, met.image, shift);
  if (!std::any_of(shift, shift + 3, [](double x) { return x < 0 || x > 0; })) return nodes;
  std::optional<Nodes>& shifted = work_->shifted;
  shifted = nodes;
  const MeshBody& other = *work_->meshes[std::size_t(met.other)];
  for (std::int64_t i = 0; i < other.model.nodes(); ++i)
    for (int k = 0; k < nodes.dim; ++k) shifted->position[other.first_node() + i][k] += shift[k];
  return *shifted;
}

// Two meshes go by the mortar of the one that asks and whose sides between contact nodes face the other; where both do,
// a side goes by that of the first. Nodes on sides that are taken so have no contact of their own; all others keep it.
void MortarContacts::weigh(const MeshList& meshes, const MeshSeats& seats, const Nodes& nodes, const Search& search,
                           Candidates& c) {
  contacts_.clear();
  means_.clear();
  if (!any_) return;
  if (!work_) {
    work_ = std::make_shared<MortarWork>();
    find_sides(meshes, seats);
  }
  MortarWork& work = *work_;
  work.met.clear();
  for (std::int64_t i = 0; i < c.count; ++i) {
    const std::int32_t a = c.contactor_a[i], b = c.contactor_b[i];
    if (!asks(seats, a, b)) continue;
    const Seat &of = seats.seat(a), &on = seats.seat(b);
    work.met.push_back({of.mesh, on.mesh, of.index,
                        work.surfaces[std::size_t(on.mesh)].piece_of_side[std::size_t(on.index)], b, c.feature[i],
                        c.image[i], c.gap[i]});
  }
  seek_sides(nodes, search);
  std::sort(work.met.begin(), work.met.end(), [](const Met& x, const Met& y) {
    if (x.own != y.own) return x.own < y.own;
    if (x.other != y.other) return x.other < y.other;
    if (x.image != y.image) return x.image < y.image;
    if (x.node != y.node) return x.node < y.node;
    return x.edge != y.edge ? x.edge < y.edge : x.gap < y.gap;
  });
  kept_.clear();
  work.used = 0;
  for (std::size_t i = 0, end; i < work.met.size(); i = end) {
    const Met& met = work.met[i];
    const auto with = [&](const Met& m) { return m.own == met.own && m.other == met.other && m.image == met.image; };
    for (end = i; end < work.met.size() && with(work.met[end]);) ++end;
    weigh_pair(seen_from(nodes, met, search.cell), {&met, end - i});
  }
  std::int64_t to = 0;
  for (std::int64_t i = 0; i < c.count; ++i)
    if (!replaces(seats, nodes, c.contactor_a[i], c.contactor_b[i])) keep_candidate(c, to, i, nodes.dim);
  resize(c, to + std::int64_t(kept_.size()), nodes.dim);
  for (const Kept& m : kept_) {
    c.contactor_a[to] = m.node;
    c.contactor_b[to] = m.edge;
    c.feature[to] = m.feature;
    c.image[to] = m.image;
    c.gap[to] = m.gap;
    std::copy_n(m.normal, nodes.dim, &c.normal[std::size_t(nodes.dim) * std::size_t(to)]);
    std::copy_n(m.point, nodes.dim, &c.point[std::size_t(nodes.dim) * std::size_t(to)]);
    ++to;
  }
  std::sort(contacts_.begin(), contacts_.end(), [](const Contact& one, const Contact& two) {
    return one.node != two.node ? one.node < two.node : one.edge < two.edge;
  });
}

const MortarContacts::Contact* MortarContacts::find(std::int32_t node, std::int32_t edge) const {
  const auto at = std::lower_bound(contacts_.begin(), contacts_.end(), std::pair{node, edge},
                                   [](const Contact& m, const std::pair<std::int32_t, std::int32_t>& wanted) {
                                     return m.node != wanted.first ? m.node < wanted.first : m.edge < wanted.second;
                                   });
  return at == contacts_.end() || at->node != node || at->edge != edge ? nullptr : &*at;
}

const Mapping* MortarContacts::mapping(std::int32_t contactor, std::int32_t other) const {
  if (contacts_.empty() || other < 0) return nullptr;
  if (const Contact* contact = find(other, contactor)) return &contact->there;
  const Contact* contact = find(contactor, other);
  return contact && contact->here.mesh >= 0 ? &contact->here : nullptr;
}

} // namespace cairn
