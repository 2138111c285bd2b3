// Methods of first order over products with W: conjugate projected gradient, accelerated gradient, extragradient.
#include <algorithm>
#include <cmath>

#include "../../base/vectors.hpp"
#include "cairn/core.h"
#include "problem_monitor.hpp"

namespace cairn {

namespace {

// W p, without q
void apply(const FrictionProblem& p, const Array<double>& x, Array<double>& y, const Array<double>& zero, int threads) {
  cairn_block_product(p.dim, p.contacts, p.row_start.data(), p.column.data(), p.block.data(), zero.data(), x.data(),
                      y.data(), threads);
}

Array<double> contact_scales(const FrictionProblem& p, const ProblemMonitor& monitor) {
  Array<double> rho(p.contacts);
  cairn_contact_scales(p.dim, p.contacts, p.block.data(), monitor.diagonal().data(), rho.data());
  return rho;
}

ProblemReport solve_conjugate(const char* name, bool preconditioned, const FrictionProblem& p,
                              const ProblemOptions& options, double* best) {
  ProblemMonitor monitor(p, options, best);
  Array<double> rho(p.contacts, 1.0);
  if (preconditioned) rho = contact_scales(p, monitor);
  const std::size_t n = p.unknowns();
  Array<double> r(best, best + n), w(n), direction(n), image(n), zero(n);
  std::int64_t iterations = 0;
  double curvature = 0, steepest = 0, watched = monitor.error_of(r.data());
  int since_restart = 0, plain_steps = 10, watched_for = 0;
  while (!monitor.ended(iterations)) {
    cairn_tangent_gradient(p.dim, p.contacts, p.mu.data(), rho.data(), r.data(), monitor.velocity().data(), w.data());
    const double b = since_restart > 0 && curvature > 0 ? -dot(w, image) / curvature : 0;
    cairn_conjugate_direction(p.dim, p.contacts, p.mu.data(), r.data(), w.data(), b, direction.data());
    if (!(dot(direction, monitor.velocity()) < 0)) { // no descent: begin anew
      cairn_conjugate_direction(p.dim, p.contacts, p.mu.data(), r.data(), w.data(), 0.0, direction.data());
      since_restart = 0;
    }
    apply(p, direction, image, zero, options.threads);
    curvature = dot(direction, image);
    const double slope = -dot(direction, monitor.velocity());
    const bool descends = slope > 0 && curvature > 0;
    if (descends) {
      cairn_disk_step(p.dim, p.contacts, p.mu.data(), slope / curvature, direction.data(), r.data());
      ++iterations;
      ++since_restart;
      double size = 0;
      for (std::size_t i = 0; i < n; ++i) size += direction[i] * direction[i] / rho[i / p.dim];
      steepest = std::max(steepest, curvature / size);
      if (monitor.error_of(r.data()) < 0.5 * watched) {
        watched = monitor.last_error();
        watched_for = 0;
      }
      if (++watched_for < 20) continue;
    } else if (!(steepest > 0) || (watched <= monitor.last_error() && plain_steps >= 100000)) {
      monitor.give_up(ProblemStatus::stalled, "no direction is left that lessens the energy; try nlgs_anderson");
      continue;
    }
    // conjugate directions circle, or end in rounding: a run of plain projected gradient steps, each time longer, leads
    // on
    for (int k = 0; k < plain_steps && !monitor.ended(iterations); ++k, ++iterations) {
      cairn_gradient_step(p.dim, p.contacts, p.mu.data(), rho.data(), 0.7 / steepest, r.data(),
                          monitor.velocity().data(), w.data());
      r.swap(w);
      monitor.error_of(r.data());
    }
    plain_steps = std::min(2 * plain_steps, 100000);
    watched = monitor.last_error();
    since_restart = watched_for = 0;
  }
  return monitor.finish(name, iterations);
}

} // namespace

ProblemReport solve_conjugate_gradient(const FrictionProblem& p, const ProblemOptions& options, double* r) {
  return solve_conjugate("conjugate_gradient", false, p, options, r);
}

ProblemReport solve_preconditioned_conjugate_gradient(const FrictionProblem& p, const ProblemOptions& options,
                                                      double* r) {
  return solve_conjugate("preconditioned_conjugate_gradient", true, p, options, r);
}

ProblemReport solve_accelerated_gradient(const FrictionProblem& p, const ProblemOptions& options, double* best) {
  ProblemMonitor monitor(p, options, best);
  const Array<double> rho = contact_scales(p, monitor);
  const std::size_t n = p.unknowns();
  Array<double> r(best, best + n), y(r), u(n), next(n), difference(n), image(n), zero(n);
  std::int64_t iterations = 0, next_check = 0;
  double step = 1, theta = 1;
  monitor.error_of(r.data());
  while (!monitor.ended(iterations)) {
    product(p, y.data(), u.data(), options.threads);
    for (int tries = 0; tries < 60; ++tries) { // the energy along the step must lie below its bound
      cairn_gradient_step(p.dim, p.contacts, p.mu.data(), rho.data(), step, y.data(), u.data(), next.data());
      for (std::size_t i = 0; i < n; ++i) difference[i] = next[i] - y[i];
      apply(p, difference, image, zero, options.threads);
      double size = 0;
      for (std::size_t i = 0; i < n; ++i) size += difference[i] * difference[i] / rho[i / p.dim];
      if (!(step * dot(difference, image) > size)) break;
      step *= 0.6;
    }
    const double last = theta;
    theta = (std::sqrt(theta * theta * theta * theta + 4 * theta * theta) - theta * theta) / 2;
    std::int32_t turned_back = 0;
    cairn_extrapolate(std::int64_t(n), last * (1 - last) / (last * last + theta), next.data(), r.data(), y.data(),
                      &turned_back);
    if (turned_back) theta = 1;
    r.swap(next);
    step *= 1.05;
    ++iterations;
    if (iterations < next_check && iterations < options.max_iterations) continue;
    monitor.error_of(r.data());
    next_check = iterations + 1 + std::min<std::int64_t>(20, iterations / 16);
  }
  return monitor.finish("accelerated_gradient", iterations);
}

ProblemReport solve_extragradient(const FrictionProblem& p, const ProblemOptions& options, double* best) {
  ProblemMonitor monitor(p, options, best);
  const Array<double> rho = contact_scales(p, monitor);
  const std::size_t n = p.unknowns();
  Array<double> r(best, best + n), u(n), trial(n), trial_u(n), next(n);
  std::int64_t iterations = 0;
  double step = 1;
  while (true) {
    product(p, r.data(), u.data(), options.threads);
    monitor.error_of(r.data(), u.data());
    if (monitor.ended(iterations)) break;
    double ratio = 0;
    for (int tries = 0; tries < 60; ++tries) {
      cairn_gradient_step(p.dim, p.contacts, p.mu.data(), rho.data(), step, r.data(), u.data(), trial.data());
      product(p, trial.data(), trial_u.data(), options.threads);
      ratio = step * cairn_gradient_ratio(p.dim, p.contacts, p.mu.data(), rho.data(), r.data(), u.data(), trial.data(),
                                          trial_u.data());
      if (!(ratio > 0.9)) break;
      step *= std::min(0.67, 0.6 / ratio);
    }
    cairn_gradient_step(p.dim, p.contacts, p.mu.data(), rho.data(), step, r.data(), trial_u.data(), next.data());
    r.swap(next);
    if (ratio < 0.3) step *= 1.5;
    ++iterations;
  }
  return monitor.finish("extragradient", iterations);
}

} // namespace cairn
