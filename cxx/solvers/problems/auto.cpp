// Chooses by what it measures: sweeps with memory first, which solve most problems in some tens of sweeps and give
// every other method its start; proximal point around Newton's method where the errors foretell a long way. Where one
// goes on for longer than it was trusted to, the other has as much work, and each goes on from where it was.
#include <algorithm>
#include <cmath>
#include <optional>

#include "../sweeps/error_forecast.hpp"
#include "block_factors.hpp"
#include "nlgs_anderson.hpp"
#include "ppa_newton.hpp"

namespace cairn {

namespace {

class Auto {
public:
  Auto(const FrictionProblem& p, const ProblemOptions& options, double* r)
      : p_(p), options_(options), inner_(inner()), r_(r), monitor_(p, inner_, r), start_(p.unknowns()),
        far_((p.dim == 2 ? 40 : 10) * double(p.column.size()) / double(p.contacts)) {}
  ProblemReport solve();

private:
  ProblemOptions inner();
  void weigh_newton();
  // So many sweeps to come are no reason to leave: errors that stood still before foretell too little.
  double trusted() const { return newton_iterations_ > 0 ? std::min(far_, double(patience_)) : far_; }
  void sweep();
  bool turn_of_newton();
  void make_velocities_right();

  const FrictionProblem& p_;
  const ProblemOptions& options_;
  bool stopped_ = false;
  ProblemOptions inner_;
  double* r_;
  ProblemMonitor monitor_;
  Array<double> start_, found_; // what a turn begins from; what Newton's method found
  std::optional<ProximalNewton> newton_;
  bool has_newton_ = has_factorisations();
  std::string last_ = "nlgs_anderson";
  std::int64_t iterations_ = 0, newton_iterations_ = 0;
  // In sweeps: what Newton's method is expected to take, what an iteration of it takes (0: not known yet), what sweeps
  // are given before they are left, and what Newton's method is given.
  double far_, iteration_ = 0, turn_ = 1000;
  std::int64_t patience_ = 16;
  double newton_error_ = std::numeric_limits<double>::infinity();
};

ProblemOptions Auto::inner() {
  ProblemOptions inner = options_;
  if (options_.interrupted) inner.interrupted = [this] { return stopped_ = stopped_ || options_.interrupted(); };
  return inner;
}

// Measured on piles and vaults: an iteration takes as long as five sweeps and its factors, which run at three times
// the rate of sweeps; where these are most of it, some twenty iterations are needed.
void Auto::weigh_newton() {
  const double sweep = 2.0 * p_.dim * p_.dim * (double(p_.column.size()) + 40.0 * double(p_.contacts));
  try {
    const BlockFactors factors(p_.dim, p_.row_start, p_.column, options_.max_bytes);
    iteration_ = 5 + 0.3 * factors.operations() / sweep;
  } catch (const FactorsTooLarge&) {
    has_newton_ = false;
    return;
  }
  const double far = 30 * (iteration_ - 5);
  patience_ = std::max(patience_, std::int64_t(0.2 * (far - far_)));
  far_ = std::max(far_, far);
}

// Until they converge, or foretell that they take longer than Newton's method.
void Auto::sweep() {
  last_ = "nlgs_anderson";
  start_.assign(r_, r_ + p_.unknowns());
  ErrorForecast forecast(options_.tolerance);
  const std::int64_t begin = iterations_;
  iterations_ = sweep_with_memory(p_, inner_, monitor_, start_.data(), iterations_, [&](std::int64_t i, double error) {
    const double to_come = forecast.sweeps_to_come(i - begin, error);
    const auto leaves = [&] { return has_newton_ && i - begin >= patience_ && to_come > trusted(); };
    if (iteration_ == 0 && leaves()) weigh_newton();
    return leaves();
  });
}

// False: its factors have no room.
bool Auto::turn_of_newton() {
  const double sweeps = monitor_.best_error();
  if (newton_ && sweeps < 0.1 * newton_error_) newton_.reset();
  if (!newton_) {
    ProblemOptions options = inner_;
    options.max_seconds = options_.max_seconds - monitor_.seconds();
    // what sweeps found is worth a start from it where they came half the way, in digits
    options.warm_start = options_.warm_start || newton_iterations_ > 0 || sweeps < std::sqrt(options_.tolerance);
    found_.assign(r_, r_ + p_.unknowns());
    newton_iterations_ = 0;
    try {
      newton_.emplace(p_, options, found_.data());
    } catch (const FactorsTooLarge&) { return false; }
  }
  constexpr double least = 20;
  const std::int64_t most = options_.max_iterations - iterations_;
  const auto iterations = std::int64_t(std::min(double(most), std::max(least, turn_ / iteration_)));
  const ProblemReport report = newton_->turn(iterations, most);
  last_ = report.solver;
  iterations_ += report.iterations - newton_iterations_;
  newton_iterations_ = report.iterations;
  newton_error_ = report.error;
  if (report.status != ProblemStatus::iteration_limit) newton_.reset(); // it gave up, or there is nothing left to do
  monitor_.error_of(found_.data());
  patience_ = std::int64_t(0.5 * turn_);
  turn_ *= 2;
  return true;
}

// The error is met. Where the velocities of some contacts are far from what they shall be, Newton's method has as much
// work as there was to bring them right.
void Auto::make_velocities_right() {
  if (monitor_.best_error() > options_.tolerance || monitor_.best_power_error() <= std::sqrt(options_.tolerance))
    return;
  if (iteration_ == 0) weigh_newton();
  if (!has_newton_) return;
  constexpr double least = 10;
  ProblemOptions options = inner_;
  options.warm_start = true;
  const double left = double(options_.max_iterations - iterations_);
  options.max_iterations = int(std::min(left, std::max(least, double(iterations_) / iteration_)));
  if (options.max_iterations < 1) return;
  options.max_seconds = options_.max_seconds - monitor_.seconds();
  start_.assign(r_, r_ + p_.unknowns());
  try {
    const ProblemReport report = ProximalNewton(p_, options, start_.data()).solve();
    iterations_ += report.iterations;
    monitor_.hold(true);
    monitor_.error_of(start_.data());
    monitor_.hold(false);
    last_ = report.solver;
  } catch (const FactorsTooLarge&) { has_newton_ = false; }
}

ProblemReport Auto::solve() {
  monitor_.start_error();
  while (!monitor_.ended(iterations_)) {
    sweep();
    if (monitor_.ended(iterations_) || !has_newton_) break;
    has_newton_ = turn_of_newton();
  }
  if (has_newton_) make_velocities_right();
  return monitor_.finish(last_, iterations_);
}

} // namespace

ProblemReport solve_auto(const FrictionProblem& p, const ProblemOptions& options, double* r) {
  return Auto(p, options, r).solve();
}

} // namespace cairn
