// Proximal points: the step's problem with contacts that give way by a share of their own block, about impulses that it
// had before. Such a problem has an energy of the bodies' velocities alone, whose slope along a step of Newton's method
// says how far to go. The share falls while steps are whole, and impulses come to be those of the step's own problem.
#include <algorithm>
#include <cmath>
#include <limits>

#include "batch.hpp"
#include "contact_rows.hpp"
#include "solid_correction.hpp"

namespace cairn {

namespace {

constexpr double level = 0.25; // slope at which a step ends, over that at which it begins

} // namespace

// From the velocities and impulses at hand.
void SolidCorrection::begin_proximal(double share) {
  Proximal& p = proximal_point_;
  p.places.assign(1, {});
  for (const cairn_batch& b : system_.batches) {
    const auto n = std::size_t(b.count), c = std::size_t(b.components);
    const auto& [contact, value, block] = p.places.back();
    p.places.push_back({contact + n, value + n * c, block + n * c * c});
  }
  const auto& all = p.places.back();
  for (std::vector<double>* columns : {&p.free, &p.begun, &p.moved, &p.moving, &p.bias})
    columns->assign(all.value, 0.0);
  p.block.resize(all.block);
  p.params.resize(all.contact);
  for (std::vector<double>* unknowns : {&p.way, &p.mass_way, &p.mass_step}) unknowns->assign(velocity_.size(), 0.0);
  size_columns();
  p.speed = fastest();
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    const Proximal::Place& at = p.places[k];
    open_batch(std::int32_t(k), share);
    const std::size_t n = std::size_t(b.count * b.components);
    std::copy_n(q_.data(), n, &p.free[at.value]);
    std::copy_n(r_.data(), n, &p.begun[at.value]);
    std::copy_n(bias_.data(), n, &p.bias[at.value]);
    std::copy_n(w_.data(), n * std::size_t(b.components), &p.block[at.block]);
    std::copy_n(params_.data(), b.count, &p.params[at.contact]);
  }
}

SolidCorrection::Question SolidCorrection::question(std::size_t batch, const double* velocity) const {
  const Proximal& p = proximal_point_;
  const Proximal::Place& at = p.places[batch];
  return {&p.block[at.block], velocity, &p.begun[at.value], &p.bias[at.value], &p.params[at.contact]};
}

void SolidCorrection::linearise_proximal() {
  const Proximal& p = proximal_point_;
  std::vector<double>& none = w_true_;
  std::fill(none.begin(), none.end(), 0.0);
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    const std::size_t at = p.places[k].value;
    for (std::size_t i = 0; i < std::size_t(b.components * b.count); ++i) q_[i] = p.free[at + i] + p.moved[at + i];
    respond(std::int32_t(k), question(k, q_.data()), p.speed, none.data(), 0);
  }
}

void SolidCorrection::mass_times(const std::vector<double>& x, std::vector<double>& y) const {
  std::fill(y.begin(), y.end(), 0.0);
  const double* matrix = clique_matrix_.data();
  for (std::size_t c = 0; c + 1 + contacts_.size() < clique_start_.size(); ++c) {
    const std::int32_t* unknown = &clique_[std::size_t(clique_start_[c])];
    const std::int64_t m = clique_start_[c + 1] - clique_start_[c];
    for (std::int64_t j = 0; j < m; ++j)
      for (std::int64_t i = 0; i < m; ++i) y[std::size_t(unknown[i])] += matrix[m * j + i] * x[std::size_t(unknown[j])];
    matrix += m * m;
  }
}

// Relative velocities of contacts by the step at hand.
void SolidCorrection::velocities_of_contacts() {
  Proximal& p = proximal_point_;
  std::int64_t clique = clique_start_[clique_start_.size() - 1 - contacts_.size()];
  for (const Contact& contact : contacts_) {
    const std::size_t batch = std::size_t(contact.batch), c = std::size_t(contact.components);
    const std::size_t n = std::size_t(system_.batches[batch].count);
    double* u = &p.moving[p.places[batch].value + std::size_t(contact.lane)];
    for (std::size_t k = 0; k < c; ++k) u[k * n] = 0;
    for (std::size_t j = 0; j < std::size_t(contact.unknowns); ++j) {
      const double v = velocity_[std::size_t(clique_[std::size_t(clique) + j])];
      for (std::size_t k = 0; k < c; ++k) u[k * n] += rows_[contact.rows + c * j + k] * v;
    }
    clique += contact.unknowns;
  }
  for (std::size_t k = 0; k < system_.batches.size(); ++k)
    repeat_last(system_.batches[k], &p.moving[p.places[k].value], system_.batches[k].components);
}

// Slope of the energy at a share of the step at hand.
double SolidCorrection::slope(double step) {
  const Proximal& p = proximal_point_;
  double sum = 0;
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    const std::size_t at = p.places[k].value, n = std::size_t(b.count);
    for (std::size_t i = 0; i < n * std::size_t(b.components); ++i)
      q_[i] = p.free[at + i] + p.moved[at + i] + step * p.moving[at + i];
    ask(b, question(k, q_.data()), target_.data());
    for (std::size_t c = 0; c < std::size_t(b.components); ++c)
      for (std::size_t lane = 0; lane < std::size_t(b.contacts); ++lane)
        if (p.bias[at + lane] < never())
          sum -= p.moving[at + c * n + lane] * (target_[c * n + lane] - p.begun[at + c * n + lane]);
  }
  for (std::size_t i = 0; i < velocity_.size(); ++i) sum += velocity_[i] * (p.mass_way[i] + step * p.mass_step[i]);
  return sum;
}

// 1, or where the slope of the energy is small, by false position; 0 where a step may not be cut, or leads upwards.
double SolidCorrection::step_length(bool cut) {
  constexpr int most = 12;
  const double begin = slope(0), least = level * std::abs(begin);
  if (begin > 0) return 0;
  double low = 0, high = 1, at_low = begin, at_high = slope(1);
  if (!(at_high > least)) return 1;
  if (!cut) return 0;
  double step = 1;
  for (int look = 0; look < most; ++look) {
    // every third one in the middle, as an end of a curve that bends may stay
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
int SolidCorrection::find_proximal_point(double share, int most) {
  Proximal& p = proximal_point_;
  begin_proximal(share);
  for (int pass = 1; pass <= most; ++pass) {
    linearise_proximal();
    mass_times(p.way, p.mass_way);
    for (std::size_t i = 0; i < velocity_.size(); ++i) velocity_[i] = -p.mass_way[i];
    if (!factor()) return 0;
    velocities_of_contacts();
    mass_times(velocity_, p.mass_step);
    const double step = step_length(pass < most);
    if (!(step < 1)) {
      change_impulses();
      return pass;
    }
    if (!(step > 0)) return 0;
    for (std::size_t i = 0; i < p.way.size(); ++i) p.way[i] += step * velocity_[i];
    for (std::size_t i = 0; i < p.moved.size(); ++i) p.moved[i] += step * p.moving[i];
  }
  return 0;
}

// The best impulses are kept. Returns how many passes led to them, 0: none did.
int SolidCorrection::improve_by_proximal_points(double& error_square, double wanted_square,
                                                const std::function<double()>& measure) {
  constexpr int most = 48, many = 12; // passes; for a point
  constexpr double first = 0x1p-10, least = 0x1p-40;
  double share = first;
  int best = 0, points = 0, failures = 0;
  for (int passes = 0; passes < most;) {
    // where not even the first one is found by a whole step, as where laws soften, the others are not worth it
    const int found = find_proximal_point(share, points == 0 ? 1 : many);
    if (found == 0) {
      if (points == 0 || ++failures > 2) break;
      passes += many;
      share = std::min(1.0, 16 * share);
      continue;
    }
    passes += found;
    ++points;
    refresh();
    drop_self_stress();
    const double now = measure();
    if (!std::isfinite(now)) break;
    if (now < error_square) {
      error_square = now;
      best = passes;
      copy_impulses(false);
    }
    if (now <= wanted_square) break;
    share = std::clamp(share * (found == 1 ? 0.25 : found <= 3 ? 0.5 : found <= 5 ? 1 : 4), least, 1.0);
  }
  return best;
}

} // namespace cairn
