// Mortar contact of two meshes: whole slave sides meet the sides of the other mesh. Each slave node has one contact,
// between its value in the basis of its side and the mean M_jl / D_jj of the master nodes.
#include <algorithm>
#include <cmath>
#include <utility>

#include "../base/call.hpp"
#include "../bodies/body.hpp"
#include "../detection/candidates.hpp"
#include "mortar_contacts.hpp"
#include "mortar_work.hpp"

namespace cairn {

// Contacts of one mesh with another: whole sides that have a node that was seen in front of it, and those beside them,
// all of whose nodes may be just beyond an edge; then their nodes.
void MortarContacts::weigh_pair(const Nodes& nodes, std::span<const Met> met) {
  MortarWork& work = *work_;
  const std::int32_t which = met.front().own, there = met.front().other;
  const MortarSurface& surface = work.surfaces[std::size_t(which)];
  const auto of_node = [&](std::int32_t node) { // candidates that detection saw of it
    const auto low = std::lower_bound(met.begin(), met.end(), node,
                                      [](const Met& m, std::int32_t wanted) { return m.node < wanted; });
    auto high = low;
    while (high != met.end() && high->node == node) ++high;
    return std::pair{low, high};
  };
  const auto nearest = [&](auto from, auto to, std::int64_t before) {
    for (auto m = from; m != to; ++m)
      if (before < 0 || std::abs(m->gap) < std::abs(met[std::size_t(before)].gap)) before = m - met.begin();
    return before;
  };
  work.pair.start(nodes, *work.meshes[std::size_t(which)], surface, *work.meshes[std::size_t(there)],
                  work.surfaces[std::size_t(there)]);
  // of another image of the same mesh there is one already
  const bool goes_on =
      work.used > 0 && work.taken[work.used - 1].own == which && work.taken[work.used - 1].other == there;
  if (!goes_on && work.taken.size() == work.used) work.taken.emplace_back();
  Taken& taken = work.taken[goes_on ? work.used - 1 : work.used];
  if (!goes_on) taken.clear(which, there);
  work.added.resize(surface.whole.size());
  for (std::size_t k = 0; k < work.added.size(); ++k) work.added[k] = !work.asks[std::size_t(which)][k];
  if (const Taken* reverse = taken_of(there, which))
    for (const std::int32_t whole : reverse->front) work.added[std::size_t(whole)] = 1;
  work.covered.clear();
  work.front.clear();
  work.front_start.assign(1, 0);
  const auto each_whole = [&](std::int32_t node, auto&& use) {
    for (auto e = surface.wholes_start[std::size_t(node)]; e < surface.wholes_start[std::size_t(node) + 1]; ++e)
      if (const std::int32_t whole = surface.wholes_at[std::size_t(e)]; !work.added[std::size_t(whole)]) use(whole);
  };
  const auto add = [&](std::int32_t whole, std::int64_t seen) {
    work.added[std::size_t(whole)] = 1;
    if (!work.pair.add_side(whole, work.seeds, seen)) return false;
    taken.covered.push_back(whole);
    for (const std::int32_t piece : work.pair.front())
      taken.front.push_back(work.surfaces[std::size_t(there)].piece[std::size_t(piece)].whole);
    return true;
  };
  for (const Met& m : met)
    each_whole(m.node, [&](std::int32_t whole) {
      const MortarWhole& w = surface.whole[std::size_t(whole)];
      work.seeds.clear();
      std::int64_t seen = -1;
      for (int j = 0; j < w.nodes; ++j) {
        const auto [from, to] = of_node(w.node[j]);
        seen = nearest(from, to, seen);
        for (auto k = from; k != to; ++k) work.seeds.push_back(k->piece);
      }
      if (!add(whole, seen)) return;
      work.covered.push_back({whole, seen});
      work.front.insert(work.front.end(), work.pair.front().begin(), work.pair.front().end());
      work.front_start.push_back(work.front.size());
    });
  for (std::size_t i = 0; i < work.covered.size(); ++i) {
    const MortarWhole& w = surface.whole[std::size_t(work.covered[i].whole)];
    work.seeds.assign(work.front.begin() + std::ptrdiff_t(work.front_start[i]),
                      work.front.begin() + std::ptrdiff_t(work.front_start[i + 1]));
    for (int j = 0; j < w.nodes; ++j)
      each_whole(w.node[j], [&](std::int32_t whole) { add(whole, work.covered[i].seen); });
  }
  if (taken.covered.empty()) return;
  for (const MortarRow& row : work.pair.rows()) taken.nodes.push_back(row.node);
  taken.sort();
  work.used += goes_on ? 0 : 1;
  for (const MortarRow& row : work.pair.rows()) {
    const auto [from, to] = of_node(row.node);
    put_row(nodes, which, there, row, met[std::size_t(nearest(from, to, from == to ? row.seen : -1))]);
  }
}

// The contact of a node, with the side there that stands for all that it faces.
void MortarContacts::put_row(const Nodes& nodes, std::int32_t which, std::int32_t there, const MortarRow& row,
                             const Met& seen) {
  MortarWork& work = *work_;
  const MeshBody &own = *work.meshes[std::size_t(which)], &other = *work.meshes[std::size_t(there)];
  const MortarSurface& surface = work.surfaces[std::size_t(which)];
  const double size =
      std::sqrt(row.normal[0] * row.normal[0] + row.normal[1] * row.normal[1] + row.normal[2] * row.normal[2]);
  const std::int32_t contactor = work.contactor[std::size_t(which)][std::size_t(row.node)];
  if (contactor < 0 || !(row.diagonal > 0) || !(size > 0)) return;
  Kept kept{contactor, seen.edge, seen.feature, seen.image, 0, {0, 0, 0}, {0, 0, 0}};
  Contact contact{contactor, seen.edge, {}, {}};
  contact.there.mesh = there;
  const double* x = nodes.position[own.node(row.node)];
  std::copy_n(x, nodes.dim, kept.point);
  for (int k = 0; k < nodes.dim; ++k) kept.normal[k] = row.normal[k] / size;

  const MortarWhole& w =
      surface.whole[std::size_t(surface.wholes_at[std::size_t(surface.wholes_start[std::size_t(row.node)])])];
  int place[most_side_nodes];
  double weight[most_side_nodes];
  std::int32_t node[most_side_nodes];
  const int count =
      basis_value(nodes.dim, w.nodes, int(std::find(w.node, w.node + w.nodes, row.node) - w.node), place, weight);
  for (int j = 0; j < count; ++j) {
    node[j] = w.node[place[j]];
    const double* y = nodes.position[own.node(node[j])];
    for (int k = 0; k < nodes.dim; ++k) kept.gap += weight[j] * kept.normal[k] * (y[k] - x[k]);
  }
  if (count > 1) {
    contact.here.mesh = which;
    means_.map(contact.here, {node, std::size_t(count)}, {weight, std::size_t(count)});
  }
  work.nodes.clear();
  work.weights.clear();
  for (std::size_t l = 0; l < row.there.size(); ++l) {
    const double part = row.weight[l] / row.diagonal;
    if (std::abs(part) < 1e-14) continue; // what rounding left of an end
    work.nodes.push_back(row.there[l]);
    work.weights.push_back(part);
    const double* y = nodes.position[other.node(row.there[l])];
    for (int k = 0; k < nodes.dim; ++k) kept.gap += part * kept.normal[k] * (x[k] - y[k]);
  }
  means_.map(contact.there, work.nodes, work.weights);
  kept_.push_back(kept);
  contacts_.push_back(contact);
}

} // namespace cairn
