// Proximal point method around Newton's method: W + alpha is regular however many contacts share a body, and alpha
// falls near the solution. Newton steps are whole: a line search on |f| crawls around the turns of the slip directions,
// where whole steps take a few iterations (measured on the problems of docs/problems.md: 30 to 200 against 10 to 40).
#include <algorithm>
#include <cmath>
#include <limits>

#include "../sweeps/light_error.hpp"
#include "cairn/core.h"
#include "ppa_newton.hpp"
#include "velocity_refinement.hpp"

namespace cairn {

namespace {

constexpr double largest = 10; // alpha
constexpr int most_steps = 12;
constexpr int most_failures = 12, few_failures = 2;
constexpr double alarm = 8; // velocities may err by so many tolerances

// True if no body weighs over 100 times another.
bool alike(const FrictionProblem& p) {
  if (!p.bodies || p.bodies->count == 0) return false;
  const std::size_t size = std::size_t(p.bodies->dofs) * p.bodies->dofs;
  double least = p.bodies->mass[0], most = least;
  for (std::size_t k = 0; k < p.bodies->mass.size(); k += size) {
    least = std::min(least, p.bodies->mass[k]);
    most = std::max(most, p.bodies->mass[k]);
  }
  return most <= 100 * least;
}

} // namespace

ProximalNewton::ProximalNewton(const FrictionProblem& p, const ProblemOptions& options, double* r)
    : given_(p), scaled_(p, options, r),
      newton_(scaled_.problem(), cairn_newton_alart_curnier, scaled_.monitor().diagonal(), options.max_bytes),
      smallest_(p.bodies ? 1e-16 : 1e-15), centre_(p.unknowns()), r_(p.unknowns()), u_(p.unknowns()),
      shifted_(p.unknowns()) {}

double ProximalNewton::error_of(const Array<double>& x) {
  product(scaled_.problem(), x.data(), u_.data(), 1);
  return scaled_.monitor().error_of(x.data(), u_.data());
}

// Newton's method for the proximal point of the centre, from it to r_. Returns true if |f| fell tenfold or to rounding.
// error: of r_ in the problem without the proximal term.
bool ProximalNewton::solve_around(double& error, int& steps) {
  ProblemMonitor& monitor = scaled_.monitor();
  r_ = centre_;
  error = error_of(r_);
  double first = 0, last[3] = {};
  for (steps = 0;; ++steps) {
    cairn_proximal_velocity(std::int64_t(r_.size()), alpha_, r_.data(), centre_.data(), u_.data(), shifted_.data());
    double merit = 0;
    if (steps == most_steps) {
      merit = newton_.merit(r_.data(), shifted_.data());
      return merit <= 0.01 * first;
    }
    if (!newton_.find(r_.data(), shifted_.data(), alpha_, merit)) return false;
    if (steps == 0) first = merit;
    const bool rounding = settling_ && error < 1e-4 * monitor.tolerance();
    if (rounding && steps > 1 && merit > 0.25 * last[(steps - 1) % 3]) return true;
    if (steps > 0 && merit <= 0.01 * first) return true;
    if (follows_sweeps_ && steps > 2 && merit > 10 * first) return false;
    if (steps > 6 && merit > first && merit > 0.5 * *std::min_element(last, last + 3)) return false;
    last[steps % 3] = merit;
    const Array<double>& step = newton_.step();
    for (std::size_t i = 0; i < r_.size(); ++i) r_[i] += step[i];
    ++iterations_;
    error = error_of(r_);
    if (!std::isfinite(error) || monitor.ended(iterations_) || iterations_ >= most_) return false;
    if (error <= monitor.tolerance() && !settling_) return true;
  }
}

void ProximalNewton::run() {
  ProblemMonitor& monitor = scaled_.monitor();
  // After the first failure alpha halves in one round, after the next in two, in four, ...: where many contacts
  // change, a fall by ten fails again and again.
  constexpr int most_careful = 32;
  constexpr double careful_fall = 0.5;
  while (!monitor.ended(iterations_) && iterations_ < pause_) {
    if (error_ <= monitor.tolerance())
      return given_.bodies && masses_differ(mass_ratio(*given_.bodies), true) ? refine() : settle();
    double next = 0;
    int steps = 0;
    const bool solved = solve_around(next, steps);
    if (std::isfinite(next) && (solved || next < error_)) centre_ = r_;
    if (solved || next < 0.3 * error_) {
      const double fall = steps <= 4 ? 0.1 : steps < 9 ? 0.3 : 1.0;
      alpha_ = std::max(smallest_, alpha_ * (careful_ > 0 ? careful_fall : fall));
      careful_ = std::max(0, careful_ - 1);
      failures_ = 0;
    } else {
      alpha_ = std::min(largest, 5 * alpha_);
      careful_ = next_careful_;
      next_careful_ = std::min(most_careful, 2 * next_careful_);
      if (++all_failures_ >= few_failures && follows_sweeps_) return;
      if (++failures_ > most_failures) monitor.give_up(ProblemStatus::stalled, "Newton's method does not converge");
    }
    if (std::isfinite(next) && (solved || next < error_)) error_ = next;
  }
}

// From a state in which every contact sticks: where little slips or opens Newton's method finds the rest in a few
// steps, also along columns so long that a small change of alpha at a time would take many.
void ProximalNewton::begin_sticking(double& error) {
  constexpr int most = 8;
  ProblemMonitor& monitor = scaled_.monitor();
  const double alpha = 1e-7;
  const int d = given_.dim;
  error_of(centre_);
  double push = 0;
  for (std::size_t i = 0; i < centre_.size(); ++i) push = std::max({push, std::abs(centre_[i]), std::abs(u_[i])});
  r_ = centre_;
  for (std::size_t i = 0; i < r_.size(); i += d) r_[i] += 1e6 * push;
  double merit = 0, now = error;
  bool found = newton_.find(r_.data(), u_.data(), alpha, merit);
  r_ = centre_;
  for (int steps = 0; found && steps < most && !monitor.ended(iterations_) && iterations_ < most_; ++steps) {
    for (std::size_t i = 0; i < r_.size(); ++i) r_[i] += newton_.step()[i];
    ++iterations_;
    const double last = now;
    now = error_of(r_);
    if (!(now > monitor.tolerance()) || (steps > 1 && !(now < last)) || !std::isfinite(now)) break;
    cairn_proximal_velocity(std::int64_t(r_.size()), alpha, r_.data(), centre_.data(), u_.data(), shifted_.data());
    found = newton_.find(r_.data(), shifted_.data(), alpha, merit);
  }
  if (!(monitor.best_error() < 0.5 * error)) return;
  std::copy_n(scaled_.best(), centre_.size(), centre_.begin());
  alpha_ = monitor.best_error() < 0.01 * error ? 100 * alpha : alpha_;
  error = monitor.best_error();
}

// The error is small enough. Where velocities are not, heavy bodies rest on light ones: with a far smaller alpha the
// impulses go all the way, until they change no more by what bodies feel of them, r'W r.
void ProximalNewton::settle() {
  ProblemMonitor& monitor = scaled_.monitor();
  const FrictionProblem& p = scaled_.problem();
  const double limit = alarm * monitor.tolerance(), enough = 0.1 * monitor.tolerance();
  error_of(centre_);
  double speed = monitor.fall_error(centre_.data(), u_.data()), change = 0, energy = 0, factor = 1e-3;
  constexpr double least = 3;  // iterations that show anything
  constexpr int most_vain = 3; // rounds; where one has helped, all that are needed
  const std::int64_t most = most_, begin = iterations_;
  const double work = before_ + double(iterations_), share = settle_share_ * work;
  const auto at_most = [&](double n) { most_ = iterations_ + std::int64_t(std::min(n, double(most - iterations_))); };
  bool doubted = settle_share_ > 0 && !(speed < far_); // whether more iterations help
  if (speed < far_) at_most(share < least ? 0 : share);
  if (doubted) at_most(std::max(settle_trial_, work));
  settling_ = true;
  Array<double> before(u_);
  int failures = 0;
  // rounding over alpha moves impulses on and on: where velocities are right, and no light body feels it, few are
  // enough
  const int few = alike(given_) ? std::min(3, settle_failures_) : settle_failures_;
  const auto most_failures = [&] { return speed > limit ? settle_failures_ : few; };
  for (int round = 0; round < 60 && failures < most_failures() && !monitor.ended(iterations_) && iterations_ < most_;
       ++round) {
    if ((!(speed > limit) && !(change > enough * enough * energy)) ||
        (doubted && round >= most_vain && double(iterations_ - begin) >= settle_trial_))
      break;
    alpha_ = std::max(smallest_, factor * alpha_);
    double error = 0, next = 0;
    int steps = 0;
    const bool solved = solve_around(error, steps) && error <= monitor.tolerance();
    if (solved) next = monitor.fall_error(r_.data(), u_.data());
    if (!solved || next > std::max(limit, 2 * speed)) {
      alpha_ = std::min(largest, 100 * alpha_);
      factor = 0.1;
      ++failures;
      continue;
    }
    if (doubted && next < 0.5 * speed) {
      doubted = false;
      most_ = most;
    }
    change = energy = 0;
    for (std::size_t i = 0; i < r_.size(); ++i) {
      change += (r_[i] - centre_[i]) * (u_[i] - before[i]);
      energy += r_[i] * (u_[i] - p.q[i]);
    }
    centre_ = r_;
    before = u_;
    speed = next;
    if (alpha_ <= smallest_ && !(change > enough * enough * energy)) break;
  }
  error_of(centre_); // the last one that was good
  monitor.hold(false);
}

// Refines velocities once the error is small enough, where heavy bodies lie on light ones: r has no digits left for the
// motion of the light bodies.
void ProximalNewton::refine() {
  VelocityRefinement refinement(scaled_.problem(), scaled_.monitor(), newton_, scaled_.unit());
  refinement.run(centre_, iterations_, most_);
  centre_ = refinement.impulses();
  velocity_ = refinement.velocities();
  scaled_.monitor().hold(false);
}

// Sweeps of NLGS while they cost less than one factorisation and go on halving the error: many contacts on one body
// fill the factors, and sweeps alone solve such problems. Returns the true error.
double ProximalNewton::begin_with_sweeps() {
  constexpr int batch = 20;
  const FrictionProblem& p = scaled_.problem();
  // a sweep's local solutions cost as much as some forty products with a block
  const double sweep = 2.0 * p.dim * p.dim * (double(p.column.size()) + 40.0 * double(p.contacts));
  double error = std::numeric_limits<double>::infinity();
  for (double done = 0;; done += batch) {
    const double before = error;
    scaled_.sweep(centre_.data(), batch);
    error = scaled_.monitor().error_of(centre_.data());
    if (!std::isfinite(error) || error <= scaled_.monitor().tolerance() || scaled_.monitor().ended(0)) return error;
    if ((done + 2 * batch) * sweep > newton_.operations() || error > 0.5 * before) return error;
  }
}

void ProximalNewton::begin() {
  ProblemMonitor& monitor = scaled_.monitor();
  begun_ = true;
  monitor.hold(true); // until velocities are right, too: see settle
  std::copy_n(scaled_.best(), given_.unknowns(), centre_.begin());
  error_ = monitor.error_of(centre_.data());
  if (error_ > monitor.tolerance() && !given_.bodies) error_ = begin_with_sweeps();
  const double start = error_;
  if (error_ > monitor.tolerance() && !follows_sweeps_ && sticks_first_) begin_sticking(error_);
  if (needs_sticking_ && error_ > monitor.tolerance() && !(error_ < 0.1 * start)) pause_ = 0;
}

ProblemReport ProximalNewton::solve() {
  begin();
  run();
  ProblemReport report = scaled_.finish("ppa_newton", iterations_);
  report.velocity = std::move(velocity_);
  return report;
}

ProblemReport ProximalNewton::turn(std::int64_t iterations, std::int64_t most) {
  pause_ = iterations_ + std::min(iterations, most);
  most_ = iterations_ + most;
  if (!begun_) begin();
  run();
  return scaled_.finish("ppa_newton", iterations_);
}

ProblemReport solve_ppa_newton(const FrictionProblem& p, const ProblemOptions& options, double* r) {
  need_factorisations("ppa_newton");
  return ProximalNewton(p, options, r).solve();
}

} // namespace cairn
