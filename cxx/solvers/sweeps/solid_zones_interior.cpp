// Interior points for the contacts beside zones. A node on a side, and a node of that side on the first body, often
// bear the same load: multipliers of an augmented Lagrangian pass it from one to the other slowly, and contacts that
// close or open cut its steps short. Here every contact presses a little and stands off a little, the product of both
// shrinks from pass to pass (Wright 1997), and friction is smoothed by as much.
#include <algorithm>
#include <cmath>

#include "batch.hpp"
#include "contact_rows.hpp"
#include "solid_zones.hpp"

namespace cairn {

namespace {

constexpr double inside = 1 - 0x1p-7; // share of the way to the boundary

} // namespace

// True if the contact has an impulse besides that of its springs. One that no unknown moves has none: it would grow
// without bound.
bool SolidZones::stands_free(const SolidSystem::Contact& contact) const {
  const cairn_batch& b = solid_.system.batches[std::size_t(contact.batch)];
  return moves_[std::size_t(&contact - solid_.contacts().data())] && at(b, b.bias, contact.lane, 0) < never();
}

// Impulses and distances that are at least as far from their bounds as `barrier` [J] asks.
void SolidZones::begin_inside(double barrier) {
  find_velocities();
  for (const SolidSystem::Contact& contact : solid_.contacts()) {
    const cairn_batch& b = solid_.system.batches[std::size_t(contact.batch)];
    const std::size_t first = place_[std::size_t(contact.batch)] + std::size_t(contact.lane);
    const double rho = b.rho[contact.lane];
    multiplier_[first] = std::max(multiplier_[first], std::sqrt(barrier * rho));
    shift_[first] = std::max(velocity_[first], std::sqrt(barrier / rho));
  }
}

// Adds the impulse of a contact beside its zone to `bears` [N s], without what the barrier adds, and its stiffness (c,
// c) [kg] to `answer`. Friction is f w + limit u = 0 with w^2 = |u|^2 + barrier/rho, linearised in f and u with f
// within the limit (Chan, Golub & Mulet 1999): steps need not be cut where a contact begins or ends to slide.
void SolidZones::bear_inside(const double* u, double* multiplier, int n, int c, double rho, double distance, double mu,
                             double barrier, double* bears, double* answer) const {
  const double slope = multiplier[0] / distance;
  bears[0] -= slope * (u[0] - distance);
  answer[0] += slope;
  const double limit = mu * multiplier[0];
  if (!(limit > 0)) {
    for (int k = 1; k < c; ++k) multiplier[k * n] = 0;
    return;
  }
  double square = 0, speed = barrier / rho;
  for (int k = 1; k < c; ++k) square += multiplier[k * n] * multiplier[k * n], speed += u[k * n] * u[k * n];
  speed = std::sqrt(speed);
  const double shrink = square > limit * limit ? limit / std::sqrt(square) : 1;
  for (int k = 1; k < c; ++k) bears[k * n] -= limit / speed * u[k * n];
  for (int l = 1; l < c; ++l)
    for (int k = 1; k < c; ++k)
      answer[c * l + k] += ((k == l ? limit : 0) +
                            shrink * (multiplier[k * n] * u[l * n] + multiplier[l * n] * u[k * n]) / (2 * speed)) /
                           speed;
}

void SolidZones::linearise_inside(double barrier, Stiffness by) {
  std::size_t contact = 0;
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k) {
    const cairn_batch& b = solid_.system.batches[k];
    if (b.contacts == 0) continue;
    const int n = b.count, c = b.components;
    const std::size_t begin = place_[k];
    const double* u = &velocity_[begin];
    bear_springs(k, u, by, &bears_[begin], &solid_.answer[solid_.contacts()[contact].answer]);
    for (int lane = 0; lane < b.contacts; ++lane, ++contact) {
      const SolidSystem::Contact& own = solid_.contacts()[contact];
      double *answer = &solid_.answer[own.answer], *known = &solid_.known[own.known];
      double *bears = &bears_[begin + std::size_t(lane)], *presses = &presses_[begin + std::size_t(lane)];
      for (int i = 0; i < c; ++i) presses[i * n] = 0;
      std::fill_n(stays_, 36, 0.0);
      if (!(at(b, b.bias, lane, 0) < never())) {
        std::fill_n(answer, c * c, 0.0);
        for (int i = 0; i < c; ++i) known[i] = -at(b, b.r, lane, i), bears[i * n] = 0;
      } else {
        if (stands_free(own))
          bear_inside(u + lane, &multiplier_[begin + std::size_t(lane)], n, c, b.rho[lane],
                      shift_[begin + std::size_t(lane)], mu_[lane], barrier, presses, stays_);
        for (int i = 0; i < c; ++i) known[i] = bears[i * n] + presses[i * n] - at(b, b.r, lane, i);
      }
      std::copy_n(stays_, c * c, &stiffness_[own.answer]);
      for (int i = 0; i < c * c; ++i) answer[i] += stays_[i];
    }
  }
}

// How far impulses and distances may go along the step at hand.
double SolidZones::room_of_step() const {
  double most = 1;
  for (const SolidSystem::Contact& contact : solid_.contacts()) {
    if (!stands_free(contact)) continue;
    const std::size_t first = place_[std::size_t(contact.batch)] + std::size_t(contact.lane);
    const double rise = presses_[first] + pressed_[first] - multiplier_[first];
    const double away = velocity_[first] + moving_[first] - shift_[first];
    if (most * -rise > inside * multiplier_[first]) most = inside * multiplier_[first] / -rise;
    if (most * -away > inside * shift_[first]) most = inside * shift_[first] / -away;
  }
  return most;
}

// Mean product of impulse and distance [J] after a share of the step at hand.
double SolidZones::mean_inside(double step) const {
  double sum = 0, count = 0;
  for (const SolidSystem::Contact& contact : solid_.contacts()) {
    if (!stands_free(contact)) continue;
    const std::size_t first = place_[std::size_t(contact.batch)] + std::size_t(contact.lane);
    sum += (multiplier_[first] + step * (presses_[first] + pressed_[first] - multiplier_[first])) *
           (shift_[first] + step * (velocity_[first] + moving_[first] - shift_[first]));
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

// The step at hand, which aims at none, mended by what its product of impulse and distance would be, and by how the
// limits of friction change with the pressure (Mehrotra 1992); the same factors serve.
void SolidZones::correct_inside(double barrier, double mean) {
  for (const SolidSystem::Contact& contact : solid_.contacts()) {
    if (!stands_free(contact)) continue;
    const std::size_t n = std::size_t(solid_.system.batches[std::size_t(contact.batch)].count);
    const std::size_t first = place_[std::size_t(contact.batch)] + std::size_t(contact.lane);
    const double rise = presses_[first] + pressed_[first] - multiplier_[first];
    const double away = velocity_[first] + moving_[first] - shift_[first];
    double more = (barrier - std::clamp(rise * away, -mean, mean)) / shift_[first];
    presses_[first] += more, solid_.known[contact.known] += more;
    const double share = std::clamp(1 + rise / multiplier_[first], 0.125, 8.0) - 1;
    for (std::size_t i = 1; i < std::size_t(contact.components); ++i) {
      more = share * presses_[first + i * n];
      presses_[first + i * n] += more, solid_.known[contact.known + i] += more;
    }
  }
  std::fill(solid_.velocity.begin(), solid_.velocity.end(), 0.0);
  solid_.add_momentum(solid_.known, 1, solid_.velocity);
  solid_.solve();
  follow_step();
}

// Goes along the step at hand.
void SolidZones::move_inside(double step) {
  for (const SolidSystem::Contact& contact : solid_.contacts()) {
    if (!stands_free(contact)) continue;
    const std::size_t n = std::size_t(solid_.system.batches[std::size_t(contact.batch)].count);
    const std::size_t first = place_[std::size_t(contact.batch)] + std::size_t(contact.lane);
    for (std::size_t at = first; at < first + n * std::size_t(contact.components); at += n)
      multiplier_[at] += step * (presses_[at] + pressed_[at] - multiplier_[at]);
    shift_[first] += step * (velocity_[first] + moving_[first] - shift_[first]);
  }
  move(step);
}

int SolidZones::go_inside(double& error_square, double wanted_square, const std::function<double()>& measure,
                          bool& reached) {
  constexpr int most = 16, least_passes = 5;
  constexpr double share = 0.25, long_step = 0.75, near = 0x1p-4, start = 0.25;
  const double many = double(solid_.contacts().size());
  const auto accurate = [&] { // barrier that leaves an error of half the one that is wanted
    const double speed = solid_.system.speed();
    return share * wanted_square * speed * speed / many;
  };
  double last = measure(), least = accurate(), barrier = least * std::max(1.0, std::min(1.0, last) / wanted_square);
  begin_inside(barrier / share);
  int pass = 0;
  while (pass < most) {
    find_velocities();
    linearise_inside(barrier, pass == 0 ? Stiffness::start : Stiffness::tangent);
    std::fill(solid_.velocity.begin(), solid_.velocity.end(), 0.0);
    if (!solid_.factor()) { // the solid gives way by what softens
      linearise_inside(barrier, Stiffness::secant);
      std::fill(solid_.velocity.begin(), solid_.velocity.end(), 0.0);
      if (!solid_.factor()) break;
    }
    ++pass;
    follow_step();
    const double mean = mean_inside(0), ahead = mean_inside(room_of_step()) / mean;
    correct_inside(std::max(least, mean * ahead * ahead * ahead), mean);
    const double step = room_of_step();
    move_inside(step);
    solid_.refresh();
    const double now = measure();
    if (!std::isfinite(now)) break;
    if (now < error_square) {
      error_square = now;
      solid_.keep_impulses();
    }
    if ((reached = now <= wanted_square)) break;
    // near the end augmented Lagrangians take fewer passes
    if (pass >= least_passes && now < near * near && (step < long_step || now >= last)) break;
    last = now;
    least = accurate();
    barrier = std::max(least, start * mean_inside(0));
  }
  find_velocities();
  std::fill(shift_.begin(), shift_.end(), 0.0);
  return pass;
}

} // namespace cairn
