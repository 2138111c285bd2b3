#include "newton_correction.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../policy.hpp"
#include "../problems/newton_step.hpp"
#include "../problems/ppa_newton.hpp"
#include "../problems/scaled_problem.hpp"

namespace cairn {

namespace {

// Weight of the proximal term relative to the mean diagonal of W. A step cannot find motions with less resistance;
// without the term redundant contacts have no resistance.
constexpr double proximal_weight = 0x1p-24;

} // namespace

// Measured: on one core 800 take about as long as a full block in space.
double sweep_operations(const ContactSystem& system) {
  const double packed = system.dim == 2 ? policy().sweep_packed_plane : policy().sweep_packed,
               full = system.dim == 2 ? policy().sweep_full_plane : policy().sweep_full;
  double sum = 0;
  for (const cairn_batch& b : system.batches) sum += b.contacts * (b.pack ? packed : full);
  return sum;
}

NewtonCorrection::NewtonCorrection(ContactSystem& system, const cairn_schedule& schedule,
                                   const Velocities& velocity_free, const SolverOptions& options)
    : system_(system), schedule_(schedule), velocity_free_(velocity_free), options_(options) {}

void NewtonCorrection::refresh() {
  system_.load(velocity_free_);
  cairn_add_impulses(&schedule_);
}

bool NewtonCorrection::make_problem() {
  if (problem_ || !possible_) return possible_;
  possible_ = has_factorisations() && StepProblem::obstacle(system_).empty();
  if (!possible_) return false;
  problem_.emplace(system_, schedule_, velocity_free_);
  possible_ = problem_->problem().contacts > 0 && (!system_.needs_blocks() || problem_->bytes() <= options_.max_bytes);
  operations_ = least_operations();
  if (possible_ && system_.needs_blocks()) problem_->form_blocks();
  refresh();
  return possible_;
}

// Least cost of factors: those of the last separator of a pile alone, a full layer of bodies across it.
double NewtonCorrection::least_operations() const {
  const ContactBodies& bodies = *problem_->problem().bodies;
  const double layer = bodies.dofs * std::pow(double(bodies.count), 1 - 1.0 / system_.dim);
  return 2.0 / 3 * layer * layer * layer;
}

double NewtonCorrection::find(int sweeps) {
  const double times = policy().correction_cost;
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  const double allowed = times * sweeps * sweep_operations(system_);
  if (!make_problem() || operations_ > allowed) return unknown;
  const FrictionProblem& given = problem_->problem();
  start_.resize(given.unknowns());
  problem_->read(start_.data());
  ProblemOptions options;
  options.warm_start = true;
  Array<double> unused(start_);
  ScaledProblem scaled(given, options, unused.data());
  try {
    NewtonStep newton(scaled.problem(), cairn_newton_alart_curnier, scaled.monitor().diagonal(), options_.max_bytes);
    operations_ = newton.operations();
    return operations_ > allowed ? unknown : follow(scaled, newton);
  } catch (const FactorsTooLarge&) {
    possible_ = false;
    return unknown;
  }
}

// Steps until the error falls to a quarter: the first may only tell which contacts stick, slip and open.
double NewtonCorrection::follow(ScaledProblem& scaled, NewtonStep& newton) {
  constexpr int most = 3;
  constexpr double fall = 4;
  const FrictionProblem& p = scaled.problem();
  Array<double> r(p.unknowns()), u(p.unknowns()), first(p.unknowns());
  std::copy_n(scaled.best(), r.size(), r.begin());
  step_.assign(r.size(), 0.0);
  product(p, r.data(), first.data(), 1);
  u = first;
  const double error = scaled.monitor().error_of(r.data(), u.data());
  double largest = 0, merit = 0;
  close_ = false;
  for (int k = 0; k < most && !close_; ++k) {
    if (!newton.find(r.data(), u.data(), proximal_weight, merit)) return std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < r.size(); ++i) {
      r[i] += newton.step()[i];
      step_[i] += newton.step()[i];
    }
    product(p, r.data(), u.data(), 1);
    double square = 0;
    for (std::size_t i = 0; i < u.size(); ++i) square += step_[i] * (u[i] - first[i]);
    if (!std::isfinite(square)) return std::numeric_limits<double>::infinity();
    largest = std::max(largest, square);
    close_ = scaled.monitor().error_of(r.data(), u.data()) * fall <= error;
  }
  for (std::size_t i = 0; i < r.size(); ++i) step_[i] *= scaled.impulse_unit(std::int64_t(i) / p.dim);
  return std::sqrt(largest * scaled.energy_unit());
}

bool NewtonCorrection::take(double& error_square, const std::function<double()>& measure) {
  constexpr double fall = 16;
  if (!close_) return false;
  for (std::size_t i = 0; i < step_.size(); ++i) step_[i] += start_[i];
  return give(fall, error_square, measure);
}

// step_ if it brings the square of the error down by so much.
bool NewtonCorrection::give(double fall, double& error_square, const std::function<double()>& measure) {
  problem_->write(step_.data());
  refresh();
  const double now = measure();
  const bool better = now * fall <= error_square;
  if (!better) {
    problem_->write(start_.data());
    refresh();
    measure(); // for the report
  } else {
    error_square = now;
  }
  return better;
}

bool NewtonCorrection::solve_on(int sweeps, double& error_square, double wanted,
                                const std::function<double()>& measure) {
  constexpr double of_contact = 2000, fall = 256, least = 0x1p-43, most = 1000;
  if (!problem_ || !possible_) return false;
  const FrictionProblem& given = problem_->problem();
  const double iterations = sweeps * sweep_operations(system_) / (operations_ + of_contact * double(given.contacts));
  if (iterations < 2) return false;
  problem_->read(start_.data());
  step_ = start_;
  ProblemOptions options;
  options.tolerance = std::max(least, std::min(wanted, std::sqrt(error_square / fall)));
  options.max_iterations = int(std::min(iterations, most));
  options.warm_start = true;
  options.threads = schedule_.threads;
  options.max_bytes = options_.max_bytes;
  try {
    ProximalNewton newton(given, options, step_.data());
    newton.settle_failures(1);
    newton.begin_without_sticking();
    newton.solve();
  } catch (const FactorsTooLarge&) {
    possible_ = false;
    return false;
  }
  return give(fall, error_square, measure);
}

} // namespace cairn
