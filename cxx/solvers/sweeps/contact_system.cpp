#include "contact_system.hpp"

#include <algorithm>

#include "../../laws/law_info.hpp"
#include "batch.hpp"
#include "body_speed.hpp"
#include "cairn/rows/side.h"
#include "contact_rows.hpp"
#include "side_names.hpp"

namespace cairn {

const cairn_side* sides() {
  static const cairn_side rows[] = {
#define CAIRN_SIDE(name, dimension, lever, width)                                                                      \
  {cairn_side_##name##_gather, cairn_side_##name##_scatter, cairn_side_##name##_delassus, lever, width},
#define CAIRN_MAPPED_SIDE(name, dimension, lever, width) {cairn_side_##name##_gather, nullptr, nullptr, lever, width},
#include "../../../core_f90/sides/sides.def"
#undef CAIRN_SIDE
#undef CAIRN_MAPPED_SIDE
  };
  return rows;
}

bool is_radial(std::int32_t side) { return side == radial2 || side == radial3; }

cairn_schedule ContactSystem::schedule(int threads) {
  // a thread that has less than a few tasks waits longer than it works
  threads = serial ? 1 : std::clamp(int(first_batch.size()) / 8, 1, std::max(threads, 1));
  work.resize(std::max(work.size(), std::size_t(cairn_batch_workspace) * threads));
  sums.resize(std::max(sums.size(), 6 * batches.size()));
  change.resize(std::max(change.size(), batches.size()));
  cairn_schedule s{};
  s.stages = std::int32_t(first_task.size()) - 1;
  s.batches = std::int32_t(batches.size());
  s.threads = threads;
  s.relaxation = s.softening_relaxation = 1;
  s.first_task = first_task.data();
  s.first_batch = first_batch.data();
  s.batch = batches.data();
  s.side = sides();
  s.record = record.data();
  s.general = general.empty() ? record.data() : general.data();
  s.work = work.data();
  return s;
}

namespace {

template <int n, class F>
void each(std::int64_t bodies, F&& f) {
  for (std::int64_t b = 0; b < bodies; ++b)
    for (int k = 0; k < n; ++k) f(b, k);
}

} // namespace

void ContactSystem::load(const Velocities& velocity) {
  const auto copy = [&, v = velocity.bodies.values.data()](int n) {
    return [=, this](std::int64_t b, int k) { record[b].x[k] = v[n * b + k]; };
  };
  dim == 2 ? each<3>(bodies, copy(3)) : each<6>(bodies, copy(6));
  if (!condensed.empty()) load_condensed(*velocity.nodes);
}

void ContactSystem::load_condensed(const Field<double>& velocity) {
  for (const CondensedBody& c : condensed) {
    if (c.dofs.reach) std::fill_n(c.reach.y, c.reach.numbers, 0.0);
    for (std::size_t i = 0; i < c.node.size() + c.means(); ++i) {
      double* v = c.dofs.velocity + std::size_t(dim) * i;
      if (i < c.node.size()) {
        std::copy_n(velocity[c.node[i]], dim, v);
        continue;
      }
      std::fill_n(v, dim, 0.0);
      c.each_node(i, [&](std::int32_t node, double weight) {
        for (int k = 0; k < dim; ++k) v[k] += weight * velocity[node][k];
      });
    }
  }
}

void ContactSystem::add_condensed(const Field<double>& velocity) {
  for (const CondensedBody& c : condensed)
    for (std::size_t i = 0; i < c.node.size() + c.means(); ++i)
      c.each_node(i, [&](std::int32_t node, double weight) {
        for (int k = 0; k < dim; ++k)
          c.dofs.velocity[std::size_t(dim) * i + std::size_t(k)] += weight * velocity[node][k];
      });
}

void ContactSystem::clear_condensed() {
  for (const CondensedBody& c : condensed) std::fill_n(c.dofs.velocity, c.moving(), 0.0);
}

void ContactSystem::read_condensed(std::int32_t body, std::int32_t row, double* velocity) const {
  const cairn_condensed& of = condensed[std::size_t(body)].dofs;
  double made[3] = {0, 0, 0};
  if (of.reach) cairn_reached_velocity(dim, &of, row, made);
  for (int k = 0; k < dim; ++k) velocity[k] = of.velocity[dim * row + k] + made[k];
}

void ContactSystem::clear_velocities() {
  for (std::int64_t b = 0; b < bodies; ++b) std::fill_n(record[b].x, velocities(), 0.0);
  clear_condensed();
}

void ContactSystem::clear_touched() {
  for (const cairn_batch& b : batches)
    for (int lane = 0; lane < b.contacts; ++lane) {
      if (b.moves_a && !b.mapped_a) std::fill_n(record[b.body_a[lane]].x, velocities(), 0.0);
      if (b.moves_b && !b.mapped_b) std::fill_n(record[b.body_b[lane]].x, velocities(), 0.0);
      for (int end = 0; end < 2 && b.rope; ++end)
        if (moves_by_rope(b, lane, end)) std::fill_n(record[b.rope_body[2 * lane + end]].x, velocities(), 0.0);
    }
  clear_condensed();
}

void ContactSystem::unload(Field<double>& velocity, Field<double>* of_nodes) const {
  const auto copy = [&, v = velocity.values.data()](int n) {
    return [=, this](std::int64_t b, int k) { v[n * b + k] = record[b].x[k]; };
  };
  dim == 2 ? each<3>(bodies, copy(3)) : each<6>(bodies, copy(6));
  for (std::size_t c = 0; of_nodes && c < condensed.size(); ++c)
    for (std::size_t i = 0; i < condensed[c].node.size(); ++i)
      read_condensed(std::int32_t(c), std::int32_t(i), (*of_nodes)[condensed[c].node[i]]);
}

void ContactSystem::unload_and_add(Field<double>& velocity, const Velocities& more) {
  const auto both = [&, v = velocity.values.data(), w = more.bodies.values.data()](int n) {
    return [=, this](std::int64_t b, int k) {
      v[n * b + k] = record[b].x[k];
      record[b].x[k] += w[n * b + k];
    };
  };
  dim == 2 ? each<3>(bodies, both(3)) : each<6>(bodies, both(6));
  if (!condensed.empty()) add_condensed(*more.nodes);
}

cairn_law_solve* local_solver(const cairn_batch& b, int dim) {
  if (law_infos()[b.law].solve) return law_infos()[b.law].solve;
  if (b.block) return dim == 2 ? cairn_cone_full2 : cairn_cone_full3;
  return dim == 2 ? cairn_cone_isotropic2 : cairn_cone_isotropic3;
}

bool begins_from_nothing(const ContactSystem& system) {
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane)
      for (int c = 0; c < b.components; ++c)
        if (at(b, b.r, lane, c) != 0) return false;
  return true;
}

bool ContactSystem::may_hold() const {
  return std::any_of(batches.begin(), batches.end(), [](const cairn_batch& b) {
    const LawInfo& law = law_infos()[b.law];
    return law.joins || (law.keeps && law.has_solve);
  });
}

double ContactSystem::speed() const {
  double sum = mesh_speed_square;
  for (std::int64_t b = 0; b < bodies; ++b) each_speed(*this, b, general.empty(), [&](double term) { sum += term; });
  return std::sqrt(std::max(sum, weight_speed_square));
}

} // namespace cairn
