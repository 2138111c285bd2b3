#include "extrapolation.hpp"

#include <algorithm>
#include <limits>

#include "batch.hpp"
#include "light_error.hpp"
#include "step_error.hpp"

namespace cairn {

namespace {

// A light body under a heavy one feels the rounding of an impulse that is extrapolated, and its velocity, extrapolated
// beside it, does not: what differs grows with the ratio of masses.
constexpr double largest_ratio = 0x1p20;

// Between faces a step often has several right answers: plain sweeps stay with the one that is near, and a panel that
// may stand stands; extrapolated ones leap over it, and it falls.
bool faced(const cairn_batch& b) {
  const auto has_faces = [](bool moves, bool mapped, std::int32_t side) {
    return moves && !mapped && !is_radial(side);
  };
  // on meshes over-relaxed plain sweeps carry impulses from contact to contact along an edge
  return b.in_turn != 0 || has_faces(b.moves_a, b.mapped_a, b.side_a) || has_faces(b.moves_b, b.mapped_b, b.side_b);
}

// f(impulses, their number, place of the first) for every row of impulses there is, those of dummies too
template <class F>
void each_row(const ContactSystem& system, F&& f) {
  std::size_t place = 0;
  const auto row = [&](double* r, std::size_t n) {
    f(r, n, place);
    place += n;
  };
  for (const cairn_batch& b : system.batches) {
    const std::size_t lanes = std::size_t(b.count), components = std::size_t(b.components);
    if (!b.pack) row(b.r, lanes * components);
    for (std::size_t first = 0; b.pack && first < lanes; first += 8)
      row(b.r + first * std::size_t(b.pack), 8 * components); // they stand at the end of a pack
  }
}

} // namespace

bool ExtrapolationGrounds::extrapolates() const { return mass_ratio <= largest_ratio && 2 * faced_share <= 1; }

ExtrapolationGrounds extrapolation_grounds(const ContactSystem& system) {
  double faces = 0, contacts = 0;
  for (const cairn_batch& b : system.batches) {
    contacts += b.contacts;
    if (!system.clumps && faced(b)) faces += b.contacts;
  }
  return {mass_ratio(system), contacts > 0 ? faces / contacts : 0};
}

Extrapolation::Extrapolation(ContactSystem& system, const cairn_schedule& schedule)
    : system_(system), schedule_(schedule), allowed_(extrapolation_grounds(system).extrapolates()) {
  for (const cairn_batch& b : system.batches) stride_ = std::max(stride_, b.components);
  std::size_t velocities = std::size_t(system.velocities()) * system.bodies;
  for (const CondensedBody& c : system.condensed) velocities += c.moving();
  fit(system.before, velocities);
  for (const cairn_batch& b : system.batches) contacts_ += b.contacts;
  fit(system.r_before, std::size_t(stride_) * system.places());
  fit(system.along, system.batches.size());
  fit(system.chosen, system.first_batch.size());
}

int Extrapolation::sweep(int sweeps) {
  for (int k = 0; k < sweeps; ++k) {
    factor_ = sequence_.factor();
    lean_condensed();
    cairn_extrapolated_sweep(&schedule_, factor_, system_.bodies, system_.velocities(), system_.before.data(), stride_,
                             system_.r_before.data(), system_.change.data(), system_.along.data());
    sequence_.follow(total(system_.change, system_.batches.size(), 1, 0),
                     total(system_.along, system_.batches.size(), 1, 0), schedule_.associated != 0);
    sweep_slow_tasks();
  }
  const int more = int(swept_beside_);
  swept_beside_ -= more;
  return sweeps + more;
}

// A few grains that wedge or slide keep a whole pile from its answer: of the work most goes where most is left to do.
void Extrapolation::sweep_slow_tasks() {
  constexpr double above_mean = 4, largest_share = 0.25; // change of a contact; of the contacts
  constexpr int times = 4;
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
  if (!(share > 0) || share > largest_share) return;
  cairn_sweep_chosen(times, &schedule_, system_.chosen.data(), system_.along.data());
  swept_beside_ += times * share;
}

void Extrapolation::lean_condensed() {
  double* before = system_.before.data() + std::size_t(system_.velocities()) * system_.bodies;
  for (const CondensedBody& c : system_.condensed)
    for (std::size_t i = 0; i < c.moving(); ++i, ++before) {
      const double now = c.dofs.velocity[i];
      if (factor_ > 0) c.dofs.velocity[i] = now + factor_ * (now - *before);
      *before = now;
    }
}

BestImpulses::BestImpulses(ContactSystem& system) : system_(system), least_(std::numeric_limits<double>::infinity()) {}

void BestImpulses::offer(double error_square, bool goes_on) {
  if (!(error_square < least_)) return;
  least_ = goes_on ? error_square : std::numeric_limits<double>::infinity(); // the last ones are at hand
  if (!goes_on) return;
  std::size_t numbers = 0;
  for (const cairn_batch& b : system_.batches) numbers += std::size_t(b.count) * b.components;
  fit(system_.best, numbers);
  each_row(system_, [&](double* r, std::size_t n, std::size_t place) { std::copy_n(r, n, &system_.best[place]); });
}

bool BestImpulses::give_back(double error_square, const Velocities& velocity_free, const cairn_schedule& schedule) {
  if (!(least_ < std::numeric_limits<double>::infinity()) || error_square <= least_) return false;
  each_row(system_, [&](double* r, std::size_t n, std::size_t place) { std::copy_n(&system_.best[place], n, r); });
  system_.load(velocity_free);
  cairn_add_impulses(&schedule);
  return true;
}

} // namespace cairn
