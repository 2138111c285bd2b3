// From places to forces: a batch of pairs goes through its narrow phase, its law, and onto its bodies.
#include <algorithm>

#include "../../contacts/surface_motion.hpp"
#include "cairn/smooth_bodies.h"
#include "lanes.hpp"

namespace cairn {
namespace {

constexpr auto in_turn = [] {
  std::array<std::int32_t, NeighbourList::lanes> numbers{};
  for (int i = 0; i < NeighbourList::lanes; ++i) numbers[std::size_t(i)] = i;
  return numbers;
}();

} // namespace

// Centres and directions of contactors, where they are not those of the bodies. sides: of triangles in contact too,
// which find_shaped places otherwise.
void SmoothDem::place_contactors(Simulation& s, bool sides) {
  const Bodies& b = s.scene.bodies;
  const Contactors& c = s.scene.contactors;
  const double* rotation = b.rotation.active ? b.rotation.values.data() : nullptr;
  if (!centred_) {
    centre_.resize(c.count * dim_);
    for (const auto& [first, last] : placed_) place_centres(s, first, last);
    if (sides) place_sides(s);
    if (clumps_) place_clumps(s);
  }
  if (!c.direction.active) return;
  direction_.resize(c.count * (dim_ + 1));
  for (const std::int32_t k : directed_)
    cairn_contactor_directions(dim_, k, k + 1, c.body.values.data(), c.direction.values.data(), b.rotation.active,
                               rotation, direction_.data());
}

void SmoothDem::place_centres(const Simulation& s, std::int64_t first, std::int64_t last) {
  const Bodies& b = s.scene.bodies;
  const Contactors& c = s.scene.contactors;
  std::int64_t wrong = -1;
  cairn_contactor_centres(dim_, first, last, c.body.values.data(), b.position.values.data(), c.offset.active,
                          c.offset.values.data(), b.rotation.active,
                          b.rotation.active ? b.rotation.values.data() : nullptr, centre_.data(), &wrong);
}

// Records of the spheres of clumps, where these now are.
void SmoothDem::place_clumps(const Simulation& s) {
  const Bodies& b = s.scene.bodies;
  const Contactors& c = s.scene.contactors;
  for (const auto& [first, last] : placed_) {
    const std::int64_t begin = first, end = last, n = (end - begin + BodyTiles::size - 1) / BodyTiles::size;
#pragma omp parallel for schedule(static)
    for (std::int64_t t = 0; t < n; ++t) {
      const std::int64_t from = begin + t * BodyTiles::size;
      cairn_clump_records(from, std::min(from + BodyTiles::size, end), c.body.values.data(), centre_.data(),
                          c.radius.values.data(), grain_.data(), b.position.values.data(), b.velocity.values.data(),
                          record_.data(), offset_.data());
    }
  }
}

// Of triangles those alone that have a contact.
void SmoothDem::place_sides(const Simulation& s) {
  for (std::int64_t p = 0; p < shaped_.pairs; ++p)
    for (const std::int32_t k : {shaped_.a[p], shaped_.b[p]})
      if (is_facet(s, k)) place_centres(s, k, k + 1);
}

void SmoothDem::batch_geometry(const Simulation& s, const NeighbourList& list, const NeighbourList::Batch& batch,
                               Lanes& w) const {
  if (batch.kind < 0) return shaped_geometry(s, list, batch, w);
  const Bodies& b = s.scene.bodies;
  const Contactors& c = s.scene.contactors;
  const std::int64_t p = batch.first;
  const SmoothPairKind& kind = smooth_pair_kinds()[batch.kind];
  const double* centre = centred_ ? b.position.values.data() : centre_.data();
  cairn_pair_gather(dim_, batch.count, &list.a[p], &list.b[p], &list.image[p], centre, c.radius.values.data(),
                    info(kind.b).directed, direction_.data(), s.scene.cell.any(), s.scene.cell.vectors, w.between,
                    w.radius_a, w.radius_b, w.direction_b);
  kind.contact(batch.count, w.between, w.radius_a, w.radius_b, w.direction_b, w.gap, w.normal, w.point, w.status);
}

void SmoothDem::fill_records(const Simulation& s, std::int64_t first, std::int64_t last) {
  const Bodies& b = s.scene.bodies;
  cairn_sphere_records(first, last, b.position.values.data(), b.velocity.values.data(), body_radius_.data(),
                       b.inverse_mass.values.data(), record_.data());
  for (std::int64_t i = first; b.driven.active && i < last; ++i)
    if (held(s, i)) record_[12 * i + 11] = 0;
}

// Bodies, or the pairs of the batch one after the other.
SmoothDem::Target SmoothDem::target_of(Simulation& s, NeighbourList& list, const NeighbourList::Batch& batch) const {
  const std::int64_t nd = s.scene.bodies.dofs();
  if (batch.kept >= 0) {
    double* kept = &list.kept[2 * batch.kept * nd];
    return {in_turn.data(), kept, kept + batch.count * nd};
  }
  double* other = batch.other < 0 ? nullptr : &list.other[batch.other * nd];
  if (other) std::fill_n(other, batch.count * nd, 0.0);
  return {&list.body_a[batch.first], s.scene.bodies.contact_force.values.data(), other};
}

// Kernels add to what is kept of pairs in contact; that of others is not read.
void SmoothDem::clear_kept(const NeighbourList::Batch& batch, const Target& to, const Lanes& w, std::int32_t count,
                           int dofs) const {
  for (std::int32_t i = 0; i < count && batch.kept >= 0; ++i)
    for (double* side : {to.force, to.other}) std::fill_n(side + std::int64_t(w.lane[i] - 1) * dofs, dofs, 0.0);
}

// Adds what the pairs of a batch that is kept exert on bodies that are on few ranks.
void SmoothDem::add_to_roaming(NeighbourList& list, const NeighbourList::Batch& batch, std::int32_t count,
                               const Lanes& w, Bodies& bodies) const {
  const int nd = bodies.dofs();
  for (std::int32_t i = 0; i < count; ++i) {
    const std::int64_t l = w.lane[i] - 1;
    const double* push = &list.kept[(2 * batch.kept + l) * nd];
    for (const std::int32_t body : {list.body_a[batch.first + l], list.body_b[batch.first + l]}) {
      double* total = bodies.contact_force[body];
      for (int k = 0; k < nd && !shared->everywhere[std::size_t(body)]; ++k) total[k] += push[k];
      push += std::int64_t(batch.count) * nd;
    }
  }
}

// The fast way of batch_forces for spheres; -1 if the batch has to go the general one.
int SmoothDem::sphere_forces(Simulation& s, NeighbourList& list, const NeighbourList::Batch& batch, const Target& to,
                             Lanes& w, double h, double* sums) {
  const std::int64_t p = batch.first;
  const LawTable::Entry& entry = s.laws.entry(batch.entry);
  std::int32_t count = 0, m = 0;
  const double* force = s.scene.bodies.contact_force.values.data();
  const std::int32_t* with_record = (clumps_ ? list.b : list.body_b).data();
  for (std::int64_t q = p + batch.count; q < std::min(p + batch.count + NeighbourList::lanes, list.pairs); ++q) {
    const std::int64_t body = list.body_b[q]; // of the next batch: on its way while this one is computed
    __builtin_prefetch(&record_[12 * with_record[q]]);
    __builtin_prefetch(&record_[12 * with_record[q] + 8]);
    __builtin_prefetch(&force[6 * body]);
    if (states_ > 3) { // wider than what the processor foresees by itself
      const std::int64_t acting = list.active[q] ? q : p;
      __builtin_prefetch(&list.state[states_ * acting]);
      __builtin_prefetch(&list.state[states_ * acting + states_ - 1]);
    }
  }
  const EntryShape& shape = entries_[batch.entry];
  double *state = list.state.data() + states_ * p, *lane_force = &list.force[3 * p];
  const std::int32_t *a = clumps_ ? &list.a[p] : nullptr, *b = clumps_ ? &list.b[p] : nullptr;
  const std::int32_t *of_a = clumps_ ? a : &list.body_a[p], *of_b = clumps_ ? b : &list.body_b[p]; // records
  const double* offset = clumps_ ? offset_.data() : nullptr;
  const bool one_spring = !clumps_ && states_ == 3 && shape.scalars == 0 && shape.vectors == 1 && !shape.turns;
  if (one_spring)
    cairn_sphere_gather(batch.count, of_a, of_b, record_.data(), shape.reach, h, state, &list.active[p], w.lane, &count,
                        &m, w.frame, w.arm, w.u, w.lane_gap, w.geometry, w.state);
  else
    cairn_sphere_gather_states(batch.count, of_a, of_b, record_.data(), shape.reach, h, shape.scalars, shape.vectors,
                               states_, state, &list.active[p], w.lane, &count, &m, w.frame, w.arm, w.u, w.lane_gap,
                               w.geometry, w.state);
  if (count <= 0) return count;
  const cairn_law_context context{h, 0.5, w.geometry, nullptr, 0};
  double* energy = counts_loss_ ? w.energy : nullptr;
  law_infos()[std::size_t(entry.law)].force(m, shape.turns ? 6 : 3, &context, w.lane_gap, w.u, entry.params, w.state,
                                            w.f, energy);
  clear_kept(batch, to, w, count, 6);
  if (one_spring)
    cairn_sphere_scatter(batch.count, count, m, w.lane, to.body_a, &list.body_b[p], w.frame, w.arm, w.f, w.state, state,
                         lane_force, to.force, to.other);
  else
    cairn_sphere_scatter_states(batch.count, count, m, w.lane, to.body_a, &list.body_b[p], w.frame, w.arm, w.f,
                                shape.scalars, shape.vectors, states_, w.state, state, lane_force, to.force, to.other,
                                shape.turns ? &w.f[3 * m] : nullptr, shape.turns ? &list.moment[3 * p] : nullptr, a, b,
                                offset);
  cairn_smooth_sums(count, m, w.lane_gap, w.geometry, energy, &sums[2], &sums[3], &sums[16]);
  if (energy) keep_loss(list, batch, count, m, w);
  return count;
}

void SmoothDem::keep_loss(NeighbourList& list, const NeighbourList::Batch& batch, std::int32_t count, std::int32_t m,
                          const Lanes& w) {
  for (std::int32_t i = 0; i < count; ++i)
    list.loss[batch.first + w.lane[i] - 1] = w.energy[m + i] + w.energy[2 * m + i];
}

// Velocities of surfaces and of the images of B.
void SmoothDem::batch_jumps(const Simulation& s, const NeighbourList& list, const NeighbourList::Batch& batch,
                            int count, bool belts, Lanes& w) const {
  const bool sheared = s.scene.cell.any();
  for (int i = 0; sheared && i < batch.count; ++i) {
    double jump[3];
    image_velocity(s.scene.cell, list.image[batch.first + i], jump);
    for (int k = 0; k < dim_; ++k) w.jump[k * batch.count + i] = jump[k];
  }
  if (belts) add_belts(s, list, batch, count, !sheared, w);
}

void SmoothDem::load_rows(const NeighbourList& list, const NeighbourList::Batch& batch, int count, int numbers,
                          Lanes& w) const {
  const double* rows = list.state.data() + batch.first * states_;
  for (int i = 0; i < count; ++i) {
    const std::int64_t l = w.lane[i] - 1;
    std::copy_n(rows + l * states_, numbers, w.rows + l * numbers);
  }
}

void SmoothDem::store_rows(NeighbourList& list, const NeighbourList::Batch& batch, int count, int numbers,
                           const Lanes& w) const {
  double* rows = list.state.data() + batch.first * states_;
  for (int i = 0; i < count; ++i) {
    const std::int64_t l = w.lane[i] - 1;
    std::copy_n(w.rows + l * numbers, numbers, rows + l * states_);
  }
}

// sums: see sums_of_tile
void SmoothDem::batch_forces(Simulation& s, NeighbourList& list, const NeighbourList::Batch& batch, Lanes& w, double h,
                             double* sums) {
  Bodies& b = s.scene.bodies;
  const std::int64_t p = batch.first;
  const int n = batch.count, nd = b.dofs();
  const EntryShape& shape = entries_[batch.entry];
  const LawTable::Entry& entry = s.laws.entry(batch.entry);
  Target to = target_of(s, list, batch);
  const bool belts = has_belts(s, list, batch);
  if ((spheres_alone_ || clumps_) && batch.spheres && !belts)
    if (const int acting = sphere_forces(s, list, batch, to, w, h, sums); acting >= 0) {
      if (batch.kept >= 0) add_to_roaming(list, batch, acting, w, b);
      return;
    }
  batch_geometry(s, list, batch, w);
  std::int32_t count = 0, m = 0;
  cairn_smooth_admit(n, w.gap, w.status, shape.reach, states_, list.state.data() + p * states_, &list.active[p], w.lane,
                     &count, &m);
  if (count == 0) return;
  cairn_smooth_sides(dim_, n, &list.a[p], &list.b[p], &list.body_a[p], &list.body_b[p], grain_.data(), w.between,
                     w.point, s.scene.contactors.offset.active, centre_.data(), b.position.values.data(), w.lever_a,
                     w.lever_b, w.grain_a, w.grain_b);
  if (batch.kind < 0) shaped_grains(s, list, batch, w);
  const bool sheared = s.scene.cell.any();
  if (sheared || belts) batch_jumps(s, list, batch, count, belts, w);
  // rows of the list are as long as the longest state; kernels take them as long as their law's
  const int own = shape.scalars + shape.vectors * (dim_ == 2 ? 1 : 3);
  double* const stored = own < states_ ? w.rows : list.state.data() + p * states_;
  if (own < states_) load_rows(list, batch, count, own, w);
  (dim_ == 2 ? cairn_smooth_gather2 : cairn_smooth_gather3)(
      n, m, w.lane, &list.body_a[p], &list.body_b[p], b.velocity.values.data(), w.grain_a, w.grain_b, w.gap, w.normal,
      w.lever_a, w.lever_b, h, shape.scalars, shape.vectors, stored, w.frame, w.u, w.lane_gap, w.geometry, w.state,
      sheared || belts ? w.jump : nullptr);
  const cairn_law_context context{h, 0.5, w.geometry, nullptr, 0};
  double* energy = counts_loss_ ? w.energy : nullptr;
  if (shape.turns)
    cairn_smooth_spins(dim_, n, m, w.lane, &list.body_a[p], &list.body_b[p], b.velocity.values.data(), w.frame,
                       &w.u[dim_ * m]);
  const int components = shape.turns ? nd : dim_;
  law_infos()[std::size_t(entry.law)].force(m, components, &context, w.lane_gap, w.u, entry.params, w.state, w.f,
                                            energy);
  clear_kept(batch, to, w, count, nd);
  // Force and moment of a pair reach its bodies together, so that sums do not depend on where batches begin.
  const Target bodies = to;
  const bool together = shape.turns && batch.kept < 0;
  if (together) {
    to = {in_turn.data(), w.push, w.push + std::int64_t(n) * nd};
    std::fill_n(w.push, std::int64_t(n) * nd, 0.0);
  }
  (dim_ == 2 ? cairn_smooth_scatter2 : cairn_smooth_scatter3)(
      n, count, m, w.lane, to.body_a, &list.body_b[p], w.lever_a, w.lever_b, w.frame, w.f, shape.scalars, shape.vectors,
      w.state, stored, &list.force[p * dim_], to.force, to.other);
  if (own < states_) store_rows(list, batch, count, own, w);
  if (shape.turns)
    cairn_smooth_moments(dim_, n, count, m, w.lane, to.body_a, &list.body_b[p], w.frame, &w.f[dim_ * m],
                         &list.moment[p * (nd - dim_)], to.force, to.other);
  if (together) add_pushes(list, batch, count, nd, w, bodies);
  if (batch.kept >= 0) add_to_roaming(list, batch, count, w, b);
  cairn_smooth_sums(count, m, w.lane_gap, w.geometry, energy, &sums[2], &sums[3], &sums[16]);
  if (b.stretch.active) sums[14] += growth_work(s, list, batch, count, w);
  if (sheared) add_cell_forces(s, list, batch, count, m, w, sums);
  for (int i = 0; (belts || sheared) && i < count; ++i)
    for (int k = 0; k < dim_; ++k)
      sums[13] += h * list.force[(p + w.lane[i] - 1) * dim_ + k] * w.jump[k * n + w.lane[i] - 1];
  if (energy) keep_loss(list, batch, count, m, w);
}

// Adds what the pairs of a batch exert to their bodies; what acts on a body of another tile goes to `to.other`.
void SmoothDem::add_pushes(const NeighbourList& list, const NeighbourList::Batch& batch, std::int32_t count, int dofs,
                           const Lanes& w, const Target& to) const {
  for (std::int32_t i = 0; i < count; ++i) {
    const std::int64_t l = w.lane[i] - 1;
    const double *on_a = w.push + l * dofs, *on_b = w.push + (batch.count + l) * dofs;
    double* a = to.force + std::int64_t(list.body_a[batch.first + l]) * dofs;
    double* b = to.other ? to.other + l * dofs : to.force + std::int64_t(list.body_b[batch.first + l]) * dofs;
    for (int k = 0; k < dofs; ++k) a[k] += on_a[k];
    for (int k = 0; k < dofs; ++k) b[k] += on_b[k];
  }
}

// Work of surfaces that grew after the last step against the forces of their contacts.
double SmoothDem::growth_work(const Simulation& s, const NeighbourList& list, const NeighbourList::Batch& batch,
                              int count, const Lanes& w) const {
  double work = 0;
  for (int i = 0; i < count; ++i) {
    const int l = w.lane[i] - 1;
    const std::int64_t p = batch.first + l;
    const double grown_a = *s.scene.bodies.stretch[list.body_a[p]], grown_b = *s.scene.bodies.stretch[list.body_b[p]];
    for (int k = 0; k < dim_; ++k)
      work += list.force[p * dim_ + k] *
              (grown_b * w.lever_b[k * batch.count + l] - grown_a * w.lever_a[k * batch.count + l]);
  }
  return work;
}

// Forces of contacts with images times the shifts of these, and their effective masses.
void SmoothDem::add_cell_forces(const Simulation& s, NeighbourList& list, const NeighbourList::Batch& batch, int count,
                                int m, const Lanes& w, double* sums) const {
  for (int i = 0; i < count; ++i) {
    const std::int64_t p = batch.first + w.lane[i] - 1;
    if (list.image[p] == own_image) continue;
    double shift[3];
    image_shift(s.scene.cell, list.image[p], shift);
    for (int j = 0; j < dim_; ++j)
      for (int k = 0; k < dim_; ++k) sums[24 + k + 3 * j] -= list.force[p * dim_ + k] * shift[j];
    sums[33] += w.geometry[2 * m + i];
    if (shared) list.across[std::size_t(p)] = w.geometry[2 * m + i];
  }
}

// Rates of a cell that follows a stress, for the next step: L_ij += h (-sum f_i s_j - P_ij V)/(m H_jj^2), see
// moving_cell.hpp, less a share against the rate (Cundall 1987): the cell is as heavy as all bodies, so that dashpots
// of contacts hardly damp it, and the stress swings by the root of stiffness over pressure. Its inertia is at least
// twice the effective masses of the contacts across its sides, so that it is as stable as these.
void SmoothDem::follow_stress(Cell& cell, const double sum[10]) const {
  const double volume = cell.volume(dim_), mass = std::max(settings.mass_scale * cell.mass, 2 * sum[9]);
  for (int j = 0; j < dim_; ++j)
    for (int i = 0; i < dim_; ++i) {
      const int e = i + 3 * j;
      const double length = cell.vectors[4 * j];
      if (volume > 0) cell.stress[e] = sum[e] / volume;
      if (!cell.follows[e] || !(mass > 0)) continue;
      double& rate = cell.velocity_gradient[e];
      const double push = (sum[e] - cell.pressure[e] * volume) / (mass * length * length), along = rate * push;
      const double share = along > 0 ? 1 - settings.cell_damping : along < 0 ? 1 + settings.cell_damping : 1;
      rate += h_ * share * push;
    }
}

bool SmoothDem::has_belts(const Simulation& s, const NeighbourList& list, const NeighbourList::Batch& batch) const {
  const auto& field = s.scene.bodies.surface_velocity;
  const auto moves = [](double v) { return v < 0 || v > 0; };
  for (std::int64_t q = batch.first; field.active && q < batch.first + batch.count; ++q)
    for (const double* own : {field[list.body_a[q]], field[list.body_b[q]]})
      if (std::any_of(own, own + field.components, moves)) return true;
  return false;
}

// Adds the velocities of surfaces, B less A, to those of the images of B.
void SmoothDem::add_belts(const Simulation& s, const NeighbourList& list, const NeighbourList::Batch& batch, int count,
                          bool first, Lanes& w) const {
  const int n = batch.count;
  if (first) std::fill_n(w.jump, dim_ * n, 0.0);
  for (int i = 0; i < count; ++i) {
    const int l = w.lane[i] - 1;
    const std::int64_t q = batch.first + l;
    double normal[3], arm[3], own[3], jump[3] = {0, 0, 0};
    for (int k = 0; k < dim_; ++k) normal[k] = w.normal[k * n + l];
    for (const int side : {0, 1}) {
      for (int k = 0; k < dim_; ++k) arm[k] = (side ? w.lever_b : w.lever_a)[k * n + l];
      const std::int32_t body = (side ? list.body_b : list.body_a)[q];
      if (!belt_velocity(s.scene.bodies, dim_, body, arm, normal, own)) continue;
      for (int k = 0; k < dim_; ++k) jump[k] += side ? own[k] : -own[k];
    }
    for (int k = 0; k < dim_; ++k) w.jump[k * n + l] += jump[k];
  }
}

void SmoothDem::tile_forces(Simulation& s, std::int64_t tile, Lanes& w, double h, double* sums) {
  Bodies& b = s.scene.bodies;
  const std::int64_t first = tiles(s).first(tile), last = tiles(s).last(tile);
  std::fill(b.contact_force[first], b.contact_force[last], 0.0);
  std::fill_n(sums, sums_of_tile, 0.0);
  each_list([&](NeighbourList& list) {
    const auto& batches = list.tile_batches;
    if (counts_loss_ && batches[tile] < batches[tile + 1]) {
      const auto &one = list.batches[batches[tile]], &end = list.batches[batches[tile + 1] - 1];
      std::fill(&list.loss[one.first], &list.loss[end.first] + end.count, 0.0);
    }
    for (std::int64_t k = batches[tile]; k < batches[tile + 1]; ++k) batch_forces(s, list, list.batches[k], w, h, sums);
  });
}

} // namespace cairn
