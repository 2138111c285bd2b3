// Compliance of a mesh between the nodes that contacts rest on.
#include "mesh_compliance.hpp"

#include <omp.h>

#include <algorithm>
#include <cstdio>
#include <new>

#include "../base/call.hpp"
#include "../bodies/condensed_body.hpp"

namespace cairn {

namespace {

void make_room(Array<double>& numbers, std::size_t rows) {
  try {
    numbers.resize(rows * rows);
  } catch (const std::bad_alloc&) {
    char told[400];
    std::snprintf(
        told, sizeof told,
        "the compliance between %zu dofs that contacts rest on takes %.3g GB, which this machine has not: let fewer "
        "nodes be in contact, or leave out ties, rigid parts, modal damping, mortars, storages other than 'sparse' and "
        "integrators other than Theta and Newmark of beta = gamma/2, without which it is not formed",
        rows, 8e-9 * double(rows) * double(rows));
    throw Error(told);
  }
}

} // namespace

std::vector<std::int32_t> MeshCompliance::dofs_of(std::span<const std::int32_t> nodes) const {
  std::vector<std::int32_t> dofs;
  dofs.reserve(nodes.size() * std::size_t(model_.dim));
  for (const std::int32_t node : nodes)
    for (int k = 0; k < model_.dim; ++k) dofs.push_back(model_.dim * node + k);
  return dofs;
}

// Which kind it is depends on these nodes alone, and so do its numbers: a run that goes on from a file has the same.
void MeshCompliance::rest_on(const std::vector<std::int32_t>& nodes, const Bytes& of, bool may_reach) {
  if (nodes.empty()) return; // compliance stays known for the next contact
  IterationFactors& by = *factors_.now;
  ContactNodes& f = by.contact;
  const auto bytes = [&](std::size_t of_nodes) {
    const double rows = double(model_.dim) * double(of_nodes);
    return 8 * rows * rows;
  };
  bool reached = false;
  // contacts on few nodes keep columns of the compliance
  const bool few = std::int64_t(model_.dim) * std::int64_t(nodes.size()) <= small_condensed;
  if (may_reach && !few && by_units() && bytes(nodes.size()) > of.easy) {
    if (f.asked != nodes) {
      f.asked = nodes;
      f.asked_numbers = by.soe->reach_numbers(dofs_of(nodes), model_.dim);
    }
    const double share = bytes(nodes.size()) > of.most ? 1 : 0.25;
    reached = f.asked_numbers >= 0 && 8.0 * double(f.asked_numbers) < share * bytes(nodes.size());
  }
  std::vector<std::int32_t> more;
  for (const std::int32_t node : nodes)
    if (f.place[std::size_t(node)] < 0) more.push_back(node);
  const std::size_t all = f.active.size() + more.size();
  const double kept = f.reached ? double(f.reaches.bytes()) : bytes(all);
  const bool idle = by_units() && all > 2 * nodes.size() && kept > of.most;
  if (reached != f.reached || idle) {
    f.forget(model_.nodes());
    more = nodes;
    if (reached) Array<double>().swap(f.compliance);
  }
  f.reached = reached;
  if (!reached) return touch(more);
  if (more.empty()) return;
  factors_.solves += (std::int64_t(model_.dim) * std::int64_t(more.size()) + 7) / 8;
  for (const std::int32_t node : more) {
    f.place[std::size_t(node)] = std::int32_t(f.active.size());
    f.active.push_back(node);
  }
  by.soe->add_reaches(dofs_of(more), model_.dim, f.reaches, omp_get_max_threads());
}

void MeshCompliance::touch(const std::vector<std::int32_t>& more) {
  IterationFactors& by = *factors_.now;
  ContactNodes& f = by.contact;
  const int dim = model_.dim;
  const std::size_t known = f.active.size();
  for (const std::int32_t node : more)
    if (f.place[node] < 0) {
      f.place[node] = std::int32_t(f.active.size());
      f.active.push_back(node);
    }
  const std::size_t now = f.active.size();
  if (now == known) return;
  // a little spare room, so that known columns are seldom copied
  const std::size_t size = dim * now, old = dim * known, leading = std::size_t(f.leading);
  const std::size_t room =
      size <= leading ? leading : std::min(size + (known > 0 ? size / 8 : 0), std::size_t(model_.dofs()));
  const std::vector<std::int32_t> dofs = dofs_of(f.active);
  Array<double> made;
  if (room > leading) {
    make_room(made, room);
    for (std::size_t c = 0; c < old; ++c) std::copy_n(&f.compliance[leading * c], old, &made[room * c]);
    f.compliance.swap(made);
    f.leading = std::int64_t(room);
  }
  if (by_units()) {
    if (known > 0) factors_.solves += (std::int64_t(size - old) + 7) / 8;
    return by.soe->add_units(dofs, std::int64_t(old), f.compliance.data(), std::int64_t(room), omp_get_max_threads());
  }
  f.order.push_back(std::int32_t(now));
  constexpr std::size_t most = 8; // columns that the factors are gone through for at once
  const auto n = std::size_t(model_.dofs());
  for (std::size_t first = old; first < size; first += most) { // one solution for each dof that is new
    const std::size_t end = std::min(first + most, size);
    columns_.assign(n * (end - first), 0.0);
    for (std::size_t c = first; c < end; ++c)
      if (!model_.held[dofs[c]]) columns_[n * (c - first) + dofs[c]] = 1;
    factors_.respond(columns_.data(), std::int64_t(end - first));
    for (std::size_t c = first; c < end; ++c) {
      const double* x = &columns_[n * (c - first)];
      for (std::size_t r = 0; r < size; ++r) f.compliance[room * c + r] = model_.held[dofs[r]] ? 0 : x[dofs[r]];
      for (std::size_t r = 0; r < old; ++r) f.compliance[room * r + c] = f.compliance[room * c + r];
    }
  }
}

} // namespace cairn
