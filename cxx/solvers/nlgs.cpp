#include "nlgs.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>

#include "../interaction_state.hpp"
#include "active_set.hpp"

namespace cairn {

namespace {

// In the order of batches, whatever thread did them.
double total(const Array<double>& values, std::size_t n, std::size_t stride, std::size_t offset) {
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) sum += values[stride * i + offset];
  return sum;
}

// Squares, relative to the sum of free energies.
struct Error {
  double square = 0;
  bool finite = true;
};

// The free velocity of contacts: scale of their error, and the part of it that the rounding of the bodies' velocities
// hides.
struct FreeScale {
  double energy = 0, rounding = 0;
};

// Velocities of bodies are known to some epsilons, so the relative velocity of a contact is; its square over W_NN.
double rounding_of(const ContactSystem& system) {
  double sum = 0;
  const int dim = system.dim, n = system.velocities();
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane) {
      const auto add = [&](std::int32_t body, double* lever, std::int32_t side) {
        const double* v = system.record[body].x;
        double speed = 0, spin = 0, arm = 0;
        for (int k = 0; k < dim; ++k) speed += v[k] * v[k];
        for (int k = dim; k < n; ++k) spin += v[k] * v[k];
        for (int k = 0; k < sides()[side].lever; ++k) arm += at(b, lever, lane, k) * at(b, lever, lane, k);
        sum += b.rho[lane] * (speed + spin * arm);
      };
      add(b.body_a[lane], b.lever_a, b.side_a);
      add(b.body_b[lane], b.lever_b, b.side_b);
    }
  constexpr double some = 16 * std::numeric_limits<double>::epsilon();
  return some * some * sum;
}

Error measure(ContactSystem& system, const cairn_schedule& schedule, FreeScale free, bool last, SolveReport& report) {
  // a millionth of what a contact has on average, in impulse
  const double least_scale = 0x1p-40 * free.energy / double(report.contacts);
  cairn_contact_error(&schedule, last, least_scale, system.sums.data());
  ++report.checks;
  const std::size_t n = system.batches.size();
  const double residual = total(system.sums, n, 6, 0), size = total(system.sums, n, 6, 1);
  double worst = 0, outside = 0;
  for (std::size_t b = 0; b < n; ++b) {
    const double* s = &system.sums[6 * b];
    if (s[2] > worst) {
      worst = s[2];
      report.worst_contact = system.candidate[system.batches[b].first + std::int64_t(s[3]) - 1];
    }
    outside = std::max(outside, s[4]);
  }
  const double scale = std::max(size, free.energy);
  // the projection on a cone can swallow a velocity that is no number, so bodies are asked too
  bool finite = std::isfinite(residual) && std::isfinite(size);
  for (const cairn_record& r : system.record)
    finite = finite && std::isfinite(r.x[0] + r.x[1] + r.x[2] + r.x[3] + r.x[5]);
  Error e{residual > free.rounding && scale > 0 ? residual / scale : 0, finite};
  report.error = std::sqrt(e.square);
  report.worst_error = std::sqrt(worst);
  report.cone_distance = std::sqrt(outside);
  return e;
}

std::string hint_of(const SolveReport& r, const SolverOptions& options) {
  char text[256];
  if (r.status == SolveStatus::diverged)
    std::snprintf(text, sizeof text,
                  "impulses are not finite after %d iterations, so none were given: look for velocities, masses or "
                  "gaps of absurd size near "
                  "contact %lld, or lower dt",
                  r.iterations, static_cast<long long>(r.worst_contact));
  else
    std::snprintf(
        text, sizeof text,
        "error %.2e after %d iterations, tol is %.2e: allow more iterations, a larger tol or a smaller dt; the "
        "worst contact is %lld",
        r.error, r.iterations, options.tolerance, static_cast<long long>(r.worst_contact));
  return text;
}

// Projected over-relaxation (Cryer 1971): an impulse changes by more than its contact alone would ask, and stays in its
// cone. It is the same as blocks of W divided by the factor; bonds keep theirs. A few contacts are solved sooner, and
// to rounding, without it. Between Coulomb's cones convergence is not proved beyond 1: where an error did not fall the
// factor is lowered, down to 1.
class Relaxation {
public:
  explicit Relaxation(double& factor) : factor_(factor) { factor_ = 1; }
  void follow(int iterations, double error_square) {
    if (!begun_ && iterations >= plain_sweeps) {
      begun_ = true;
      factor_ = first;
    } else if (!(error_square < least_fall * best_)) {
      factor_ = std::max(1.0, factor_ - decrement);
    }
    best_ = std::min(best_, error_square);
  }

private:
  static constexpr int plain_sweeps = 9;
  static constexpr double first = 1.625, decrement = 0.125, least_fall = 0.98;
  double& factor_;
  bool begun_ = false;
  double best_ = std::numeric_limits<double>::infinity();
};

} // namespace

SolveReport solve_nlgs(ContactSystem& system, const Field<double>& velocity_free, const SolverOptions& options) {
  SolveReport report;
  report.penetration = system.penetration;
  for (const cairn_batch& b : system.batches) report.contacts += b.contacts;
  system.load(velocity_free);
  if (system.batches.empty()) return report;
  cairn_schedule schedule = system.schedule(options.threads > 0 ? options.threads : omp_get_max_threads());
  cairn_contact_scale(&schedule, system.sums.data());
  const FreeScale free{total(system.sums, system.batches.size(), 6, 0), rounding_of(system)};
  cairn_add_impulses(&schedule);

  // The change of a sweep costs nothing; the error costs about a sweep. Between two errors their squares keep about the
  // same ratio to the change, which tells when the next error is worth its cost.
  const double wanted = options.tolerance * options.tolerance;
  double ratio = 0; // error^2 per change
  Relaxation relaxation(schedule.relaxation);
  int next_check = std::max(options.min_iterations, 1), next_newton = 64;
  const auto square = [&] { return measure(system, schedule, free, false, report).square; };
  ActiveSet newton(system, schedule, velocity_free, std::ref(square)); // by reference: nothing is allocated
  report.status = SolveStatus::iteration_limit;
  while (report.iterations < options.max_iterations) {
    const int sweeps = std::min(options.max_iterations - report.iterations,
                                std::max({1, report.iterations / 16, options.min_iterations - report.iterations}));
    cairn_nlgs_sweep(sweeps, &schedule, system.change.data());
    report.iterations += sweeps;
    const double change = total(system.change, system.batches.size(), 1, 0);
    const bool promising = ratio > 0 && change * ratio <= wanted;
    if (std::isfinite(change) && !promising && report.iterations < next_check) continue;
    Error error = measure(system, schedule, free, false, report);
    if (error.finite && error.square > wanted && report.iterations >= next_newton) {
      newton.improve(error.square, wanted);
      error = measure(system, schedule, free, false, report);
      next_newton = 4 * report.iterations;
    }
    if (!error.finite || !std::isfinite(change)) {
      report.status = SolveStatus::diverged;
      for (const cairn_batch& b : system.batches) // bodies keep velocities that are numbers
        for (int lane = 0; lane < b.contacts; ++lane)
          for (int k = 0; k < b.components; ++k) at(b, b.r, lane, k) = 0;
      system.load(velocity_free);
      break;
    }
    if (error.square <= wanted && report.iterations >= options.min_iterations) {
      report.status = SolveStatus::converged;
      break;
    }
    relaxation.follow(report.iterations, error.square);
    ratio = change > 0 ? error.square / change : 0;
    next_check = report.iterations + std::max(8, report.iterations / 2);
  }
  measure(system, schedule, free, true, report);
  if (report.status != SolveStatus::converged) report.hint = hint_of(report, options);
  return report;
}

} // namespace cairn
