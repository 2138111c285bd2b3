// Proximal points: the step's problem with contacts that give way by a share of their own block, about impulses that it
// had before. Such a problem has an energy of the bodies' velocities alone, whose slope along a step of Newton's method
// says how far to go. The share falls while steps are whole, and impulses come to be those of the step's own problem.
#include <algorithm>
#include <cmath>
#include <limits>

#include "batch.hpp"
#include "contact_rows.hpp"
#include "solid_proximal.hpp"

namespace cairn {

namespace {

constexpr double level = 0.25; // slope at which a step ends, over that at which it begins

} // namespace

// From the velocities and impulses at hand.
void ProximalPoints::begin(double share) {
  places_.assign(1, {});
  for (const cairn_batch& b : solid_.system.batches) {
    const auto n = std::size_t(b.count), c = std::size_t(b.components);
    const auto& [contact, value, block] = places_.back();
    places_.push_back({contact + n, value + n * c, block + n * c * c});
  }
  const auto& all = places_.back();
  for (std::vector<double>* columns : {&free_, &begun_, &moved_, &moving_, &bias_}) columns->assign(all.value, 0.0);
  block_.resize(all.block);
  params_.resize(all.contact);
  for (std::vector<double>* unknowns : {&way_, &mass_way_, &mass_step_}) unknowns->assign(solid_.velocity.size(), 0.0);
  tangent_.size_columns();
  none_.assign(tangent_.w.size(), 0.0);
  speed_ = tangent_.fastest();
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k) {
    const cairn_batch& b = solid_.system.batches[k];
    const Place& at = places_[k];
    tangent_.open_batch(std::int32_t(k), share);
    const std::size_t n = std::size_t(b.count * b.components);
    std::copy_n(tangent_.q.data(), n, &free_[at.value]);
    std::copy_n(tangent_.r.data(), n, &begun_[at.value]);
    std::copy_n(tangent_.bias.data(), n, &bias_[at.value]);
    std::copy_n(tangent_.w.data(), n * std::size_t(b.components), &block_[at.block]);
    std::copy_n(tangent_.params.data(), b.count, &params_[at.contact]);
  }
}

LawTangent::Question ProximalPoints::question(std::size_t batch, const double* velocity) const {
  const Place& at = places_[batch];
  return {&block_[at.block], velocity, &begun_[at.value], &bias_[at.value], &params_[at.contact]};
}

void ProximalPoints::linearise() {
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k) {
    const cairn_batch& b = solid_.system.batches[k];
    const std::size_t at = places_[k].value;
    for (std::size_t i = 0; i < std::size_t(b.components * b.count); ++i)
      tangent_.q[i] = free_[at + i] + moved_[at + i];
    tangent_.respond(std::int32_t(k), question(k, tangent_.q.data()), speed_, none_.data(), 0);
  }
}

// Relative velocities of contacts by the step at hand.
void ProximalPoints::velocities_of_contacts() {
  for (const SolidSystem::Contact& contact : solid_.contacts()) {
    const std::size_t batch = std::size_t(contact.batch), n = std::size_t(solid_.system.batches[batch].count);
    double du[SolidSystem::most_components];
    solid_.relative_velocity(contact, du);
    double* u = &moving_[places_[batch].value + std::size_t(contact.lane)];
    for (int k = 0; k < contact.components; ++k) u[std::size_t(k) * n] = du[k];
  }
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k)
    repeat_last(solid_.system.batches[k], &moving_[places_[k].value], solid_.system.batches[k].components);
}

// Slope of the energy at a share of the step at hand.
double ProximalPoints::slope(double step) {
  double sum = 0;
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k) {
    const cairn_batch& b = solid_.system.batches[k];
    const std::size_t at = places_[k].value, n = std::size_t(b.count);
    for (std::size_t i = 0; i < n * std::size_t(b.components); ++i)
      tangent_.q[i] = free_[at + i] + moved_[at + i] + step * moving_[at + i];
    tangent_.ask(b, question(k, tangent_.q.data()), tangent_.target.data());
    for (std::size_t c = 0; c < std::size_t(b.components); ++c)
      for (std::size_t lane = 0; lane < std::size_t(b.contacts); ++lane)
        if (bias_[at + lane] < never())
          sum -= moving_[at + c * n + lane] * (tangent_.target[c * n + lane] - begun_[at + c * n + lane]);
  }
  for (std::size_t i = 0; i < solid_.velocity.size(); ++i)
    sum += solid_.velocity[i] * (mass_way_[i] + step * mass_step_[i]);
  return sum;
}

// 1, or where the slope of the energy is small, by false position; 0 where a step may not be cut, or leads upwards.
double ProximalPoints::step_length(bool cut) {
  constexpr int most = 12;
  const double begin = slope(0), least = level * std::abs(begin);
  if (begin > 0) return 0;
  double low = 0, high = 1, at_low = begin, at_high = slope(1);
  if (!(at_high > least)) return 1;
  if (!cut) return 0;
  double step = 1;
  for (int look = 0; look < most; ++look) {
    // every third point bisects: by secants alone one end of the interval may stay where the slope is curved
    step = look % 3 == 0 ? 0.5 * (low + high) : low - at_low * (high - low) / (at_high - at_low);
    const double now = slope(step);
    if (std::abs(now) <= least) break;
    (now > 0 ? high : low) = step;
    (now > 0 ? at_high : at_low) = now;
  }
  return step;
}

// Impulses of contacts at the proximal point, in balance with the velocities. Returns after how many passes; 0: not in
// as many as are worth it.
int ProximalPoints::find(double share, int most) {
  begin(share);
  for (int pass = 1; pass <= most; ++pass) {
    linearise();
    solid_.mass_times(way_, mass_way_);
    for (std::size_t i = 0; i < solid_.velocity.size(); ++i) solid_.velocity[i] = -mass_way_[i];
    if (!solid_.factor()) return 0;
    velocities_of_contacts();
    solid_.mass_times(solid_.velocity, mass_step_);
    const double step = step_length(pass < most);
    if (!(step < 1)) {
      solid_.change_impulses();
      return pass;
    }
    if (!(step > 0)) return 0;
    for (std::size_t i = 0; i < way_.size(); ++i) way_[i] += step * solid_.velocity[i];
    for (std::size_t i = 0; i < moved_.size(); ++i) moved_[i] += step * moving_[i];
  }
  return 0;
}

// The best impulses are kept. Returns how many passes led to them, 0: none did.
int ProximalPoints::improve(double& error_square, double wanted_square, const std::function<double()>& measure) {
  constexpr int most = 48, many = 12; // passes; for a point
  constexpr double first = 0x1p-10, least = 0x1p-40;
  double share = first;
  int best = 0, points = 0, failures = 0;
  for (int passes = 0; passes < most;) {
    // where not even the first one is found by a whole step, as where laws soften, the others are not worth it
    const int found = find(share, points == 0 ? 1 : many);
    if (found == 0) {
      if (points == 0 || ++failures > 2) break;
      passes += many;
      share = std::min(1.0, 16 * share);
      continue;
    }
    passes += found;
    ++points;
    solid_.refresh();
    self_stress_.drop();
    const double now = measure();
    if (!std::isfinite(now)) break;
    if (now < error_square) {
      error_square = now;
      best = passes;
      solid_.keep_impulses();
    }
    if (now <= wanted_square) break;
    share = std::clamp(share * (found == 1 ? 0.25 : found <= 3 ? 0.5 : found <= 5 ? 1 : 4), least, 1.0);
  }
  return best;
}

} // namespace cairn
