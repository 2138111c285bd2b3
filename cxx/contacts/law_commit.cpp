// Commit of laws after an accepted step: their state, their stored and dissipated energy.
#include "law_commit.hpp"

#include <omp.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "../laws/law_info.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "surface_motion.hpp"

namespace cairn {
namespace {

int parameter_of(const LawInfo& law, const std::string& name) {
  const auto at = std::find_if(law.parameters.begin(), law.parameters.end(),
                               [&](const LawParameter& parameter) { return parameter.name == name; });
  return at == law.parameters.end() ? -1 : int(at - law.parameters.begin());
}

} // namespace

// Marks whether bonds that hold fast correct their errors: they do where the last step converged; behind a step that
// ended early corrections would come too late, and positions swing ever more.
void LawCommit::mark_bonds(bool converged) const {
  for (const cairn_batch& b : system_.batches) {
    if (!law_infos()[std::size_t(b.law)].holds) continue;
    for (int lane = 0; lane < b.contacts; ++lane)
      if (b.state[lane] > 1) b.state[lane] = converged ? 2 : 3;
  }
}

void LawCommit::commit() {
  const int batches = int(system_.batches.size()), threads = system_.schedule(omp_get_max_threads()).threads;
  if (!classes_.laws_commit || batches == 0) return;
  const cairn_schedule schedule = system_.schedule(threads);
  fit(sums_, system_.batches.size());
  if (system_.colours > 0) system_.law_energy.assign(8 * system_.candidate.size(), 0.0);
  brittle_.share();
#pragma omp parallel for num_threads(threads) schedule(static) if (threads > 1)
  for (int k = 0; k < batches; ++k) commit_batch(schedule, std::size_t(k), omp_get_thread_num());
  plugged_.refuse_noted();
  for (const Sums& c : sums_) {
    energy_.normal -= c.taken_normal;
    energy_.tangential -= c.taken_tangential;
    energy_.stored += c.stored;
    energy_.stored_change += c.taken_normal + c.taken_tangential - c.released;
    energy_.released += c.released;
    energy_.created += c.created;
    energy_.turned_over += c.turned_over;
    energy_.tangential += c.driven_tangential;
    energy_.normal += c.driven_normal;
    energy_.driven += c.driven_tangential + c.driven_normal;
  }
}

void LawCommit::Sums::add(const Sums& one) {
  stored += one.stored;
  taken_normal += one.taken_normal;
  taken_tangential += one.taken_tangential;
  released += one.released;
  created += one.created;
  turned_over += one.turned_over;
  driven_tangential += one.driven_tangential;
  driven_normal += one.driven_normal;
}

void LawCommit::commit_batch(const cairn_schedule& schedule, std::size_t which, int thread) {
  const cairn_batch& b = system_.batches[which];
  const LawInfo& law = law_infos()[b.law];
  const BatchStorage::LawColumns& own = storage_.of_law[which];
  sums_[which] = {};
  if (!law.commit && !law.energy) return;
  const int n = b.count, c = b.components, parameters = int(law.parameters.size()),
            states = law.state_columns(in_.dim());
  alignas(64) double u[6 * 128], r[6 * 128], gap[128], params[(LawTable::max_parameters + 4) * 128];
  alignas(64) double before[LawTable::max_states * 128];
  cairn_relative_velocities(&schedule, std::int32_t(which), thread, u);
  for (int lane = 0; lane < b.contacts; ++lane) {
    const std::int64_t i = system_.candidate[b.first + lane];
    if (in_.has_jumps()) add_jump(in_, system_, b, lane, u);
    gap[lane] = in_.candidates->gap[i];
    for (int p = 0; p < parameters; ++p) params[p * n + lane] = classes_.rule(i).params[p];
    if (in_.temperature) classes_.vary(i, n, params + lane);
    const double* shared = brittle_.at_place(b.first + lane);
    for (int k = 0; k < c; ++k) r[k * n + lane] = at(b, b.r, lane, k);
    if (shared && shared[0] == shared[0]) // not NaN: of a brittle joint of a face
      for (int k = 0; k < c; ++k) r[k * n + lane] = shared[k];
  }
  // as prepare and solve saw it: in the middle of the flight
  for (int k = 0; k < n * c; ++k) u[k] += own.flight[k];
  repeat_last(b, u, c);
  repeat_last(b, gap, 1);
  repeat_last(b, params, parameters);
  repeat_last(b, r, c);
  if (b.state) repeat_last(b, b.state, states);
  std::copy_n(b.state, b.state ? states * n : 0, before);
  if (law.commit) law.commit(n, c, &own.context, gap, u, r, params, b.state);
  for (int s = 0; s < states && law.plugged(); ++s)
    for (int lane = 0; lane < b.contacts; ++lane)
      if (!std::isfinite(b.state[s * n + lane]))
        plugged_.note(std::int32_t(which), lane, s, "state", b.state[s * n + lane]);
  if (!law.energy) return;
  const int outside = law.state_column("driven", in_.dim()), released = law.state_column("released", in_.dim());
  const int coordinate =
      law.joins ? parameter_of(law, "coordinate") : -1; // coordinate of a joint; other drives act along n
  law.energy(n, c, &own.context, gap, u, r, params, before, b.state, own.energy);
  for (int lane = 0; lane < b.contacts; ++lane) {
    const double* e = own.energy + lane;
    const double driven = outside < 0 ? 0 : b.state[outside * n + lane]; // by a motor, by a pressure
    const double taken = e[n] + e[2 * n] - driven, given = 0.5 * b.scale[lane];
    const bool along = coordinate < 0 || params[coordinate * n + lane] == 1;
    for (int k = 0; k < 4 && law.plugged(); ++k)
      if (!std::isfinite(e[k * n])) plugged_.note(std::int32_t(which), lane, k, "energy", e[k * n]);
    if (released >= 0) {
      double& since = b.state[released * n + lane];
      since += e[3 * n] - (since - before[released * n + lane]);
    }
    // what a spring gives back is not made from nothing
    const Sums one = {.stored = e[0],
                      .taken_normal = e[n],
                      .taken_tangential = e[2 * n],
                      .released = e[3 * n],
                      .created = std::max(0.0, given + taken) - std::max(0.0, given),
                      .turned_over = std::abs(given + taken) + std::abs(taken) - std::abs(given),
                      .driven_tangential = along ? 0 : driven,
                      .driven_normal = along ? driven : 0};
    sums_[which].add(one);
    if (system_.colours > 0)
      std::ranges::copy(std::bit_cast<std::array<double, 8>>(one),
                        &system_.law_energy[8 * (std::size_t(b.first) + std::size_t(lane))]);
  }
}

} // namespace cairn
