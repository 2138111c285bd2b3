// Sweeps that begin beyond the last one (Nesterov 1983), begun again where that leads astray (O'Donoghue & Candes
// 2015): what plain sweeps carry through a pile contact by contact takes the square root of as many of them.
#include "extrapolation.hpp"

#include <algorithm>

#include "../policy.hpp"
#include "../sweeps/batch.hpp"
#include "../sweeps/light_error.hpp"
#include "../sweeps/nesterov_sequence.hpp"
#include "nlgs_part.hpp"

namespace cairn {

namespace {

// A light body under a heavy one feels the rounding of an impulse that is extrapolated, and its velocity, extrapolated
// beside it, does not: what differs grows with the ratio of masses.

// Between faces a step often has several right answers: plain sweeps stay with the one that is near, and a panel that
// may stand stands; extrapolated ones leap over it, and it falls.
bool faced(const cairn_batch& b) {
  const auto has_faces = [](bool moves, bool mapped, std::int32_t side) {
    return moves && !mapped && !is_radial(side);
  };
  // on meshes over-relaxed plain sweeps carry impulses from contact to contact along an edge
  return b.in_turn != 0 || has_faces(b.moves_a, b.mapped_a, b.side_a) || has_faces(b.moves_b, b.mapped_b, b.side_b);
}

} // namespace

bool ExtrapolationGrounds::extrapolates() const {
  return mass_ratio <= policy().extrapolation_mass_ratio && faced_share <= policy().extrapolation_faces;
}

ExtrapolationGrounds extrapolation_grounds(const ContactSystem& system) {
  double faces = 0, contacts = 0;
  for (const cairn_batch& b : system.batches) {
    contacts += b.contacts;
    if (!system.clumps && faced(b)) faces += b.contacts;
  }
  return {mass_ratio(system), contacts > 0 ? faces / contacts : 0};
}

namespace {

class Extrapolation final : public NlgsPart {
public:
  explicit Extrapolation(NlgsState& s) : s_(s), system_(s.system) {
    for (const cairn_batch& b : system_.batches) {
      stride_ = std::max(stride_, b.components);
      contacts_ += b.contacts;
    }
    std::size_t velocities = std::size_t(system_.velocities()) * system_.bodies;
    for (const CondensedBody& c : system_.condensed) velocities += c.moving();
    fit(system_.before, velocities);
    fit(system_.r_before, std::size_t(stride_) * system_.places());
    fit(system_.along, system_.batches.size());
    fit(system_.chosen, system_.first_batch.size());
  }

  void prepare(SweepPass& pass) override {
    const int done = s_.report.iterations;
    if (s_.extrapolates && system_.clumps && done >= policy().clump_sweeps) {
      s_.extrapolates = false;
      s_.cycles = true;
    }
    if (!s_.extrapolates) return;
    if (done >= policy().plain_sweeps)
      pass.by = this;
    else
      pass.sweeps = std::min(pass.sweeps, policy().plain_sweeps - done);
  }

  void measured(StepError& error) override {
    if (s_.above(error)) sequence_.follow_error(s_.report.iterations);
  }

  // Sweeps, some of whose work is done where most is left to do.
  int sweep(int sweeps) override {
    if (s_.changed) sequence_.restart(); // they begin from impulses and velocities as they are
    s_.changed = false;
    s_.schedule.relaxation = 1;
    for (int k = 0; k < sweeps; ++k) {
      factor_ = sequence_.factor();
      lean_condensed();
      cairn_extrapolated_sweep(&s_.schedule, factor_, system_.bodies, system_.velocities(), system_.before.data(),
                               stride_, system_.r_before.data(), system_.change.data(), system_.along.data());
      sequence_.follow(total(system_.change, system_.batches.size(), 1, 0),
                       total(system_.along, system_.batches.size(), 1, 0), s_.schedule.associated != 0);
      sweep_slow_tasks();
    }
    const int more = int(swept_beside_);
    swept_beside_ -= more;
    return sweeps + more;
  }

private:
  void lean_condensed() {
    double* before = system_.before.data() + std::size_t(system_.velocities()) * system_.bodies;
    for (const CondensedBody& c : system_.condensed)
      for (std::size_t i = 0; i < c.moving(); ++i, ++before) {
        const double now = c.dofs.velocity[i];
        if (factor_ > 0) c.dofs.velocity[i] = now + factor_ * (now - *before);
        *before = now;
      }
  }

  // A few grains that wedge or slide keep a whole pile from its answer: of the work most goes where most is left to do.
  void sweep_slow_tasks() {
    const double above_mean = policy().slow_task_change;
    const int times = policy().slow_task_sweeps;
    const std::size_t tasks = system_.first_batch.size() - 1;
    const double change = total(system_.change, system_.batches.size(), 1, 0);
    double share = 0;
    for (std::size_t t = 0; t < tasks; ++t) {
      double of_task = 0, contacts = 0;
      for (std::int32_t b = system_.first_batch[t]; b < system_.first_batch[t + 1]; ++b) {
        of_task += system_.change[b];
        contacts += system_.batches[b].contacts;
      }
      system_.chosen[t] = of_task * contacts_ > above_mean * change * contacts;
      if (system_.chosen[t]) share += contacts / contacts_;
    }
    if (!(share > 0) || share > policy().slow_task_share) return;
    cairn_sweep_chosen(times, &s_.schedule, system_.chosen.data(), system_.along.data());
    swept_beside_ += times * share;
  }

  NlgsState& s_;
  ContactSystem& system_;
  std::int32_t stride_ = 1; // components of a contact, at most
  NesterovSequence sequence_;
  double factor_ = 0, contacts_ = 0;
  double swept_beside_ = 0; // in sweeps, that were not yet counted
};

} // namespace

void add_extrapolation(NlgsState& s, NlgsParts& parts) {
  s.extrapolates = s.extrapolates && !s.system.cell && extrapolation_grounds(s.system).extrapolates();
  if (s.extrapolates) parts.add<Extrapolation>(s);
}

} // namespace cairn
