// Commit of laws after an accepted step: their state, their stored and dissipated energy.
#include <omp.h>

#include <algorithm>
#include <cmath>

#include "../laws/law_names.hpp"
#include "interaction_state.hpp"

namespace cairn {
namespace {

int parameter_of(const LawInfo& law, const std::string& name) {
  const auto at = std::find_if(law.parameters.begin(), law.parameters.end(),
                               [&](const LawParameter& parameter) { return parameter.name == name; });
  return at == law.parameters.end() ? -1 : int(at - law.parameters.begin());
}

} // namespace

void Interactions::stored(double* out) const {
  std::fill(out, out + count(), 0.0);
  for (std::size_t k = 0; k < s_->system.batches.size(); ++k) {
    const cairn_batch& b = s_->system.batches[k];
    for (int lane = 0; lane < b.contacts && s_->of_law[k].energy; ++lane)
      out[s_->system.candidate[b.first + lane]] = s_->of_law[k].energy[lane];
  }
}

void Interactions::kept(double* out) const {
  std::fill(out, out + count(), 0.0);
  for (const cairn_batch& b : s_->system.batches)
    for (int lane = 0; lane < b.contacts && law_infos()[std::size_t(b.law)].keeps; ++lane)
      // what a pressure in a crack keeps a pair, broken as it is, has less
      out[s_->system.candidate[b.first + lane]] = b.state[lane] > 0x1p-40 ? std::min(b.state[lane], 1.0) : 0;
}

void Interactions::law_state(const std::string& name, double* out) const {
  std::fill(out, out + count(), 0.0);
  for (const cairn_batch& b : s_->system.batches) {
    const int column = law_infos()[std::size_t(b.law)].state_column(name, s_->dim());
    for (int lane = 0; lane < b.contacts && column >= 0; ++lane)
      out[s_->system.candidate[b.first + lane]] = b.state[column * b.count + lane];
  }
}

void Interactions::attraction(double* out) const {
  std::fill(out, out + count(), 0.0);
  for (const cairn_batch& b : s_->system.batches)
    for (int lane = 0; lane < b.contacts && Law(b.law) == Law::wet; ++lane)
      if (b.status[lane] != cairn_open) out[s_->system.candidate[b.first + lane]] = b.params[lane];
}

// Marks whether bonds that hold fast correct their errors: they do where the last step converged; behind a step that
// ended early corrections would come too late, and positions swing ever more.
void Interactions::State::mark_steps_of_bonds(bool converged) const {
  for (const cairn_batch& b : system.batches) {
    if (!law_infos()[std::size_t(b.law)].holds) continue;
    for (int lane = 0; lane < b.contacts; ++lane)
      if (b.state[lane] > 1) b.state[lane] = converged ? 2 : 3;
  }
}

void Interactions::State::commit_laws() {
  const int batches = int(system.batches.size()), threads = system.schedule(omp_get_max_threads()).threads;
  if (!laws_commit || batches == 0) return;
  const cairn_schedule schedule = system.schedule(threads);
  fit(commits, system.batches.size());
  share_joints();
#pragma omp parallel for num_threads(threads) schedule(static) if (threads > 1)
  for (int k = 0; k < batches; ++k) commit_batch(schedule, std::size_t(k), omp_get_thread_num());
  if (fault.batch >= 0) refuse_fault();
  for (const Commits& c : commits) {
    energy.normal -= c.taken_normal;
    energy.tangential -= c.taken_tangential;
    energy.stored += c.stored;
    energy.stored_change += c.taken_normal + c.taken_tangential - c.released;
    energy.released += c.released;
    energy.created += c.created;
    energy.turned_over += c.turned_over;
    energy.tangential += c.driven_tangential;
    energy.normal += c.driven_normal;
    energy.driven += c.driven_tangential + c.driven_normal;
  }
}

void Interactions::State::commit_batch(const cairn_schedule& schedule, std::size_t which, int thread) {
  const cairn_batch& b = system.batches[which];
  const LawInfo& law = law_infos()[b.law];
  const LawColumns& own = of_law[which];
  commits[which] = {};
  if (!law.commit && !law.energy) return;
  const int n = b.count, c = b.components, parameters = int(law.parameters.size()), states = law.state_columns(dim());
  alignas(64) double u[6 * 128], r[6 * 128], gap[128], params[(LawTable::max_parameters + 4) * 128];
  alignas(64) double before[LawTable::max_states * 128];
  cairn_relative_velocities(&schedule, std::int32_t(which), thread, u);
  for (int lane = 0; lane < b.contacts; ++lane) {
    const std::int64_t i = system.candidate[b.first + lane];
    if (sheared) add_image_jump(b, lane, 1, u);
    gap[lane] = candidates->gap[i];
    for (int p = 0; p < parameters; ++p) params[p * n + lane] = laws->entry(entry[i]).params[p];
    if (temperature) vary(i, n, params + lane);
    const double* shared = shared_of.empty() ? nullptr : &shared_of[3 * std::size_t(b.first + lane)];
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
        fault.note(std::int32_t(which), lane, s, "state", b.state[s * n + lane]);
  if (!law.energy) return;
  const int outside = law.state_column("driven", dim()), released = law.state_column("released", dim());
  const int coordinate =
      law.joins ? parameter_of(law, "coordinate") : -1; // coordinate of a joint; other drives act along n
  law.energy(n, c, &own.context, gap, u, r, params, before, b.state, own.energy);
  for (int lane = 0; lane < b.contacts; ++lane) {
    const double* e = own.energy + lane;
    const double driven = outside < 0 ? 0 : b.state[outside * n + lane]; // by a motor, by a pressure
    const double taken = e[n] + e[2 * n] - driven, given = 0.5 * b.scale[lane];
    const bool along = coordinate < 0 || params[coordinate * n + lane] == 1;
    (along ? commits[which].driven_normal : commits[which].driven_tangential) += driven;
    for (int k = 0; k < 4 && law.plugged(); ++k)
      if (!std::isfinite(e[k * n])) fault.note(std::int32_t(which), lane, k, "energy", e[k * n]);
    commits[which].stored += e[0];
    commits[which].taken_normal += e[n];
    commits[which].taken_tangential += e[2 * n];
    commits[which].released += e[3 * n];
    if (released >= 0) {
      double& since = b.state[released * n + lane];
      since += e[3 * n] - (since - before[released * n + lane]);
    }
    // what a spring gives back is not made from nothing
    commits[which].created += std::max(0.0, given + taken) - std::max(0.0, given);
    commits[which].turned_over += std::abs(given + taken) + std::abs(taken) - std::abs(given);
  }
}

} // namespace cairn
