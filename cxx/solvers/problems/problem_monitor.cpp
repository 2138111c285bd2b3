#include "problem_monitor.hpp"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "cairn/core.h"

namespace cairn {

double cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

void product(const FrictionProblem& p, const double* r, double* u, int threads) {
  if (p.bodies) {
    ContactBodies& b = *p.bodies;
    return cairn_body_product(p.dim, b.dofs, p.contacts, b.count, b.body.data(), b.rows.data(), b.inverse.data(), r,
                              p.q.data(), b.velocity.data(), u);
  }
  cairn_block_product(p.dim, p.contacts, p.row_start.data(), p.column.data(), p.block.data(), p.q.data(), r, u,
                      threads);
}

ProblemMonitor::ProblemMonitor(const FrictionProblem& problem, const ProblemOptions& options, double* best)
    : problem_(problem), options_(options), best_(best), u_(problem.unknowns()), w_nn_(problem.contacts),
      place_(problem.contacts), begin_(std::isfinite(options.max_seconds) ? cpu_seconds() : 0),
      asked_(std::chrono::steady_clock::now()) {
  cairn_block_diagonal(problem.dim, problem.contacts, problem.row_start.data(), problem.column.data(),
                       problem.block.data(), place_.data(), w_nn_.data());
  double none = 0; // u_ holds zeros so far
  cairn_problem_error(problem.dim, problem.contacts, problem.mu.data(), w_nn_.data(), u_.data(), problem.q.data(),
                      &scale_, &none);
  if (!options.warm_start) std::fill_n(best_, problem.unknowns(), 0.0);
}

double ProblemMonitor::error_of(const double* r) {
  product(problem_, r, u_.data(), options_.threads);
  return error_of(r, u_.data());
}

double ProblemMonitor::start_error() {
  if (options_.warm_start || !std::isfinite(scale_)) return error_of(best_);
  u_ = problem_.q;
  u_is_of_best_ = true;
  return last_error_ = best_error_ = scale_ > 0 ? 1 : 0;
}

const double* ProblemMonitor::best_velocity() {
  if (!u_is_of_best_) product(problem_, best_, u_.data(), options_.threads);
  u_is_of_best_ = true;
  return u_.data();
}

double ProblemMonitor::error_of(const double* r, const double* u) {
  double residual = 0, size = 0;
  cairn_problem_error(problem_.dim, problem_.contacts, problem_.mu.data(), w_nn_.data(), r, u, &residual, &size);
  const double scale = std::max(size, scale_);
  last_error_ = scale > 0 ? std::sqrt(residual / scale) : std::sqrt(residual);
  if (!std::isfinite(size) || !std::isfinite(residual)) last_error_ = std::numeric_limits<double>::infinity();
  if (last_error_ < best_error_ || (held_ && last_error_ <= options_.tolerance)) {
    best_error_ = last_error_;
    if (r != best_) std::copy_n(r, problem_.unknowns(), best_);
    u_is_of_best_ = u == u_.data();
  } else if (u == u_.data()) {
    u_is_of_best_ = false;
  }
  return last_error_;
}

double ProblemMonitor::speed_error(const double* r, const double* u) {
  speed_.resize(problem_.contacts);
  cairn_problem_speeds(problem_.dim, problem_.contacts, problem_.mu.data(), w_nn_.data(), r, u, speed_.data());
  double fastest = 0;
  for (std::int64_t a = 0; a < problem_.contacts; ++a) {
    double square = 0;
    for (int i = 0; i < problem_.dim; ++i)
      square += problem_.q[problem_.dim * a + i] * problem_.q[problem_.dim * a + i];
    fastest = std::max(fastest, square);
  }
  const double speed = *std::max_element(speed_.begin(), speed_.end());
  return speed > 0 ? speed / std::sqrt(fastest) : 0;
}

double ProblemMonitor::fall_error(const double* r, const double* u) {
  constexpr double rounding = std::numeric_limits<double>::epsilon();
  const int d = problem_.dim;
  double power = 0, play = 0, noise = 0;
  for (std::int64_t a = 0; a < problem_.contacts; ++a) {
    const double own = rounding * r[d * a] * r[d * a] * w_nn_[a];
    power += r[d * a] * u[d * a];
    noise += own * own;
    double work = 0;
    for (int i = 0; i < d; ++i) work += r[d * a + i] * problem_.q[d * a + i];
    play += std::abs(work);
  }
  const double lost = std::abs(power) - std::sqrt(noise);
  return std::max(speed_error(r, u), lost > 0 ? lost / play : 0);
}

double ProblemMonitor::best_power_error() {
  const double speed = speed_error(best_, best_velocity());
  const int d = problem_.dim;
  double lost = 0, play = 0;
  for (std::int64_t a = 0; a < problem_.contacts; ++a) {
    double square = 0, work = 0;
    for (int i = 0; i < d; ++i) {
      square += best_[d * a + i] * best_[d * a + i];
      work += best_[d * a + i] * problem_.q[d * a + i];
    }
    lost += std::sqrt(square) * speed_[a];
    play += std::abs(work);
  }
  return lost > 0 ? std::max(speed, lost / play) : speed;
}

bool ProblemMonitor::ended(std::int64_t iterations) {
  if (status_) return true;
  if (best_error_ <= options_.tolerance && !held_) {
    status_ = ProblemStatus::converged;
  } else if (std::isinf(last_error_)) {
    give_up(ProblemStatus::diverged, "the impulses are not finite");
  } else if (iterations >= options_.max_iterations) {
    give_up(ProblemStatus::iteration_limit, "allow more iterations, a larger tol, or another solver");
  } else if (std::isfinite(options_.max_seconds) && seconds() >= options_.max_seconds) {
    give_up(ProblemStatus::time_limit, "allow more seconds, a larger tol, or another solver");
  } else if (options_.interrupted) {
    const auto now = std::chrono::steady_clock::now();
    if (now - asked_ < std::chrono::milliseconds(50)) return false;
    asked_ = now;
    if (options_.interrupted()) give_up(ProblemStatus::time_limit, "it was interrupted");
  }
  return status_.has_value();
}

void ProblemMonitor::give_up(ProblemStatus status, const std::string& hint) {
  status_ = status;
  hint_ = hint;
}

// The error is relative to the impulses, so that ever larger ones seem to obey the law where none do, as between walls
// that close. Then impulses are a million times those that velocities without them ask of each contact alone, and
// contacts close as fast as without any, or as far as digits of velocities go beside such impulses.
bool ProblemMonitor::unbounded() {
  constexpr double beyond = 1e12, half = 0.5;
  const int d = problem_.dim;
  double size = 0, fastest = 0;
  for (std::int64_t a = 0; a < problem_.contacts; ++a) {
    double square = 0, speed = 0;
    for (int i = 0; i < d; ++i) {
      square += best_[d * a + i] * best_[d * a + i];
      speed += problem_.q[d * a + i] * problem_.q[d * a + i];
    }
    size += w_nn_[a] * square;
    fastest = std::max(fastest, speed);
  }
  if (!(size > beyond * scale_) || !(scale_ > 0)) return false;
  const double* u = best_velocity();
  double closing = 0;
  for (std::int64_t a = 0; a < problem_.contacts; ++a) closing = std::max(closing, -u[d * a]);
  return closing > half * std::sqrt(fastest);
}

ProblemReport ProblemMonitor::finish(const std::string& solver, std::int64_t iterations) {
  ProblemReport report;
  report.solver = solver;
  report.iterations = iterations;
  if (!std::isfinite(best_error_)) { // nothing better than no impulse was seen
    std::fill_n(best_, problem_.unknowns(), 0.0);
    error_of(best_);
  }
  report.error = best_error_;
  if (problem_.contacts > 0) {
    double figures[5];
    cairn_problem_figures(problem_.dim, problem_.contacts, problem_.mu.data(), w_nn_.data(), problem_.q.data(), best_,
                          best_velocity(), figures);
    report.worst_error = std::sqrt(figures[0]);
    report.worst_contact = std::int64_t(figures[1]);
    report.penetration_rate = figures[2];
    report.cone_distance = figures[3];
    report.energy_created = figures[4];
  }
  report.status = status_.value_or(ProblemStatus::iteration_limit);
  if (best_error_ <= options_.tolerance) report.status = ProblemStatus::converged;
  if (report.status == ProblemStatus::converged && unbounded()) {
    report.status = ProblemStatus::stalled;
    hint_ =
        "impulses grow without end, and contacts close as without them: no motion obeys bodies that are squeezed, say; "
        "look for what is driven or held on both sides";
  }
  if (report.status != ProblemStatus::converged) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "error %.2e after %lld iterations, tol is %.2e, worst contact %lld: ", report.error,
                  static_cast<long long>(iterations), options_.tolerance, static_cast<long long>(report.worst_contact));
    report.hint = text + hint_;
  }
  return report;
}

} // namespace cairn
