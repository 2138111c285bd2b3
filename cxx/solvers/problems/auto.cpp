// Automatic choice of solver by measurement. Sweeps with memory come first: they solve most problems in some tens of
// sweeps, and give every other method its start. Proximal points around Newton's method follow where errors predict
// many sweeps. A method that exceeds its budget gives way to the other, and each resumes where it stopped. Decisions
// count work, not time: the same problem has the same bits.
#include <algorithm>
#include <cmath>
#include <optional>

#include "../policy.hpp"
#include "../sweeps/error_forecast.hpp"
#include "../sweeps/light_error.hpp"
#include "block_factors.hpp"
#include "nlgs_anderson.hpp"
#include "ppa_newton.hpp"

namespace cairn {

namespace {

class Auto {
public:
  Auto(const FrictionProblem& p, const ProblemOptions& options, double* r)
      : p_(p), options_(options), inner_(inner()), r_(r), monitor_(p, inner_, r), start_(p.unknowns()),
        sweep_(double(p.column.size()) + 10.0 * double(p.contacts)),
        iteration_(newton_work(0.5 * (double(p.column.size()) - double(p.contacts)), 0) / sweep_) {
    const auto [least, most] = std::minmax_element(monitor_.w_nn().begin(), monitor_.w_nn().end());
    differ_ = p.contacts > 0 && masses_differ(*most / *least, false);
  }
  ProblemReport solve();

private:
  ProblemOptions inner();
  double newton_work(double blocks, double operations) const;
  void weigh_newton();
  bool leaves(std::int64_t sweeps, const ErrorForecast& forecast, double to_come) const;
  bool many_slip() const;
  void sweep();
  bool turn_of_newton();
  void make_velocities_right();
  // Iterations of Newton's method that velocities far from right have at least: as much work as so many sweeps.
  double trial() const { return std::clamp(80 / iteration_, 3.0, 10.0); }

  // Share of all work so far for the correction of velocities once the error is met. Unbounded for velocity errors
  // above so many roots of the tolerance: a body then falls that rests on light bodies.
  const double settling = policy().problem_settling, falling = policy().problem_falling;

  const FrictionProblem& p_;
  const ProblemOptions& options_;
  bool stopped_ = false;
  ProblemOptions inner_;
  double* r_;
  ProblemMonitor monitor_;
  Array<double> start_, found_; // what a turn begins from; what Newton's method found
  std::optional<ProximalNewton> newton_;
  bool has_newton_ = has_factorisations();
  bool weighed_ = false, differ_; // whether Newton's iteration is known; whether masses differ much
  std::string last_ = "nlgs_anderson";
  std::int64_t iterations_ = 0, sweeps_ = 0, newton_iterations_ = 0, all_newton_iterations_ = 0;
  double sweep_;     // work of one
  double iteration_; // work of one of Newton's method in sweeps; before it is weighed, what blocks of W alone take
  double turn_ = 0;  // work of the last turn of Newton's method in sweeps
  double newton_error_ = std::numeric_limits<double>::infinity();
};

ProblemOptions Auto::inner() {
  ProblemOptions inner = options_;
  if (options_.interrupted) inner.interrupted = [this] { return stopped_ = stopped_ || options_.interrupted(); };
  return inner;
}

// An iteration, in units of what a block of W takes in a sweep, where a contact takes ten: fitted to the times of both
// on piles, vaults and disks. Blocks of the factors beside the diagonal, and operations on them.
double Auto::newton_work(double blocks, double operations) const {
  const double of_contact = policy().problem_contact, of_block = policy().problem_block,
               of_operation = policy().problem_operation;
  return of_contact * double(p_.contacts) + of_block * blocks + of_operation * operations / (p_.dim * p_.dim);
}

void Auto::weigh_newton() {
  weighed_ = true;
  try {
    const BlockFactors factors(p_.dim, p_.row_start, p_.column, options_.max_bytes);
    iteration_ = newton_work(factors.blocks(), factors.operations()) / sweep_;
  } catch (const FactorsTooLarge&) { has_newton_ = false; }
}

// True if Newton's method is expected to be cheaper than further sweeps. Its number of iterations grows with the square
// root of the cost of an iteration (measured), as both grow with the coupling of contacts. Forecasts by few sweeps are
// unreliable: the less work was done compared to Newton's, and the more digits are to come compared to those done, the
// earlier sweeps end. In 3D half of Newton's cost is compared without regard to digits; and once as much was done, the
// rate of the last quarter counts, so that errors that stand still predict no end however fast they fell before.
// Between turns of Newton's method sweeps take a tenth of the work of the last turn.
bool Auto::leaves(std::int64_t sweeps, const ErrorForecast& forecast, double to_come) const {
  constexpr double largest = 0.9;
  const double patience = policy().problem_patience, trial = policy().problem_trial, few = policy().problem_few;
  const auto done = double(sweeps);
  if (turn_ > 0) return done >= std::max(patience, trial * turn_);
  if (done < patience) return false;
  const auto foretells = [done](double more, double newton) { return more > newton * std::max(1.0, newton / done); };
  const double newton = few * iteration_ * std::sqrt(iteration_), half = 0.5 * newton;
  const double error = std::min(largest, monitor_.best_error());
  const double ahead = std::max(1.0, std::log(error / options_.tolerance) / -std::log(error));
  if (foretells(ahead * ahead * ahead * to_come, newton)) return true;
  if (p_.dim == 2) return false;
  return foretells(done >= half ? std::max(to_come, forecast.by_last_quarter()) : to_come, half);
}

// Until they converge, or foretell that they take longer than Newton's method.
void Auto::sweep() {
  last_ = "nlgs_anderson";
  start_.assign(r_, r_ + p_.unknowns());
  ErrorForecast forecast(options_.tolerance);
  const std::int64_t begin = iterations_;
  iterations_ = sweep_with_memory(p_, inner_, monitor_, start_.data(), iterations_, [&](std::int64_t i, double error) {
    const double to_come = forecast.sweeps_to_come(i - begin, error);
    if (!has_newton_ || !leaves(i - begin, forecast, to_come)) return false;
    if (!weighed_) weigh_newton();
    return has_newton_ && leaves(i - begin, forecast, to_come);
  });
  sweeps_ += iterations_ - begin;
}

// True if many of the closed contacts slip, in the best impulses.
bool Auto::many_slip() const {
  const double edge = policy().problem_edge, many = policy().problem_many_slip;
  std::int64_t press = 0, slip = 0;
  for (std::int64_t a = 0; a < p_.contacts; ++a) {
    const double* r = r_ + p_.dim * a;
    if (!(r[0] > 0)) continue;
    const double tangential = p_.dim == 2 ? std::abs(r[1]) : std::hypot(r[1], r[2]);
    ++press;
    if (tangential >= edge * p_.mu[a] * r[0]) ++slip;
  }
  return double(slip) > many * double(press);
}

// False: its factors have no room.
bool Auto::turn_of_newton() {
  const double sweeps = monitor_.best_error();
  if (newton_ && sweeps < 0.1 * newton_error_) newton_.reset();
  if (!newton_) {
    ProblemOptions options = inner_;
    options.max_seconds = options_.max_seconds - monitor_.seconds();
    // impulses of sweeps are a warm start once they have half of the digits
    options.warm_start = options_.warm_start || all_newton_iterations_ > 0 || sweeps < std::sqrt(options_.tolerance);
    found_.assign(r_, r_ + p_.unknowns());
    newton_iterations_ = 0;
    try {
      newton_.emplace(p_, options, found_.data());
    } catch (const FactorsTooLarge&) { return false; }
    if (many_slip()) newton_->begin_without_sticking();
    const double before = double(sweeps_) / iteration_ + double(all_newton_iterations_);
    newton_->settle_share(settling, before, differ_ ? 0 : falling * std::sqrt(options_.tolerance), trial());
  }
  const std::int64_t most = options_.max_iterations - iterations_;
  const auto iterations = std::int64_t(std::min(double(most), turn_ / iteration_));
  const ProblemReport report = newton_->turn(iterations, most);
  last_ = report.solver;
  iterations_ += report.iterations - newton_iterations_;
  all_newton_iterations_ += report.iterations - newton_iterations_;
  newton_iterations_ = report.iterations;
  newton_error_ = report.error;
  if (report.status != ProblemStatus::iteration_limit) newton_.reset(); // it gave up, or there is nothing left to do
  monitor_.error_of(found_.data());
  return true;
}

// Corrects velocities once the error is met. Where velocities of some contacts are far from the solution, Newton's
// method has a share of the work so far; where a body falls, or masses differ much, as much again.
void Auto::make_velocities_right() {
  const double power = monitor_.best_error() > options_.tolerance ? 0 : monitor_.best_power_error();
  const double enough = std::sqrt(options_.tolerance);
  if (power <= enough) return;
  const bool all = differ_ || power >= falling * enough;
  const auto pays = [&] { return all || settling * double(iterations_) >= iteration_; };
  if (all_newton_iterations_ > 0 && (!all || newton_error_ <= options_.tolerance)) return; // it had its share
  if (pays() && !weighed_) weigh_newton();
  if (!has_newton_ || !pays()) return;
  ProblemOptions options = inner_;
  options.warm_start = true;
  const double left = double(options_.max_iterations - iterations_);
  const double share = settling * double(iterations_) / iteration_;
  options.max_iterations = int(all ? left : std::min(left, share));
  if (options.max_iterations < 1) return;
  options.max_seconds = options_.max_seconds - monitor_.seconds();
  start_.assign(r_, r_ + p_.unknowns());
  try {
    ProximalNewton newton(p_, options, start_.data());
    newton.settle_share(settling, double(iterations_) / iteration_, 0, trial());
    const ProblemReport report = newton.solve();
    iterations_ += report.iterations;
    monitor_.hold(true);
    monitor_.error_of(start_.data());
    monitor_.hold(false);
    last_ = report.solver;
  } catch (const FactorsTooLarge&) { has_newton_ = false; }
}

ProblemReport Auto::solve() {
  const double least = policy().problem_turn;
  monitor_.start_error();
  while (!monitor_.ended(iterations_)) {
    sweep();
    if (monitor_.ended(iterations_) || !has_newton_) break;
    turn_ = std::max({least * iteration_, double(sweeps_), 2 * turn_});
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
