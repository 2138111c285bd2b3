// Views of the contacts of a step.
#include <algorithm>
#include <limits>

#include "../laws/law_info.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "interaction_state.hpp"

namespace cairn {

std::span<Anchor> Interactions::anchors() { return s_->memory.anchors; }

std::span<double> Interactions::states(std::size_t key) {
  const auto each = std::size_t(s_->memory.state_components);
  return std::span<double>(s_->memory.states).subspan(key * each, each);
}

std::string Interactions::name_of_joint(std::int64_t contact) const {
  const State& s = *s_;
  const std::string name = s.in.laws->name(*s.in.contactors->material[s.in.candidates->contactor_a[contact]]);
  return name.substr(0, name.find(" (")); // its group has the same name
}

void Interactions::joints_projected() { s_->memory.joints_came = false; }

void Interactions::stored(double* out) const {
  std::fill(out, out + count(), 0.0);
  for (std::size_t k = 0; k < s_->system.batches.size(); ++k) {
    const cairn_batch& b = s_->system.batches[k];
    for (int lane = 0; lane < b.contacts && s_->storage.of_law[k].energy; ++lane)
      out[s_->system.candidate[b.first + lane]] = s_->storage.of_law[k].energy[lane];
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
    const int column = law_infos()[std::size_t(b.law)].state_column(name, s_->in.dim());
    for (int lane = 0; lane < b.contacts && column >= 0; ++lane)
      out[s_->system.candidate[b.first + lane]] = b.state[column * b.count + lane];
  }
}

void Interactions::attraction(double* out) const {
  std::fill(out, out + count(), 0.0);
  for (const cairn_batch& b : s_->system.batches)
    for (int lane = 0; lane < b.contacts && law_infos()[std::size_t(b.law)].attracts; ++lane)
      if (b.status[lane] != cairn_open) out[s_->system.candidate[b.first + lane]] = b.params[lane];
}

} // namespace cairn
