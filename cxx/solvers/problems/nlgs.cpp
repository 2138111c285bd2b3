#include "nlgs.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "../sweeps/active_set.hpp"
#include "../sweeps/associated_start.hpp"
#include "../sweeps/extrapolation.hpp"
#include "../sweeps/light_error.hpp"
#include "../sweeps/step_error.hpp"
#include "../sweeps/velocity_error.hpp"

namespace cairn {

namespace {

constexpr int plain_sweeps = 9; // few contacts are solved by as many, and what is nearly solved stays as it is

// For what is not extrapolated. Projected over-relaxation (Cryer 1971): an impulse changes by more than its contact
// alone would ask, and stays in its cone. It is the same as blocks of W divided by the factor; bonds keep theirs. A few
// contacts are solved sooner, and to rounding, without it. Between Coulomb's cones convergence is not proved beyond 1:
// where an error did not fall the factor is lowered, down to 1.
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
  static constexpr double first = 1.625, decrement = 0.125, least_fall = 0.98;
  double& factor_;
  bool begun_ = false;
  double best_ = std::numeric_limits<double>::infinity();
};

// Whether contacts move by so little that the tolerance does not tell it from rest. Errors of one sign would move what
// stands by a margin below the tolerance, step by step, until it falls (a stack at the edge of toppling).
bool near_rest(const ContactSystem& system, const cairn_schedule& schedule, double energy, double tolerance) {
  constexpr double tolerances = 64;
  double u[6 * 128], moving = 0;
  for (std::size_t k = 0; k < system.batches.size(); ++k) {
    const cairn_batch& b = system.batches[k];
    cairn_relative_velocities(&schedule, std::int32_t(k), 0, u);
    for (int c = 0; c < system.dim; ++c)
      for (int lane = 0; lane < b.contacts; ++lane)
        moving += b.rho[lane] * u[c * b.count + lane] * u[c * b.count + lane];
  }
  return moving <= tolerances * tolerances * tolerance * tolerance * energy;
}

constexpr int settled_unknowns = 80; // as many take as long as some dozen sweeps

// What stands still is solved to rounding, where it is little.
void settle(ActiveSet& newton, const ContactSystem& system, const cairn_schedule& schedule, std::int64_t contacts,
            double error_square, double energy, const SolverOptions& options) {
  constexpr double settled = 0x1p-80; // the square of an error that only rounding is left of
  if (contacts <= settled_unknowns && error_square > settled && near_rest(system, schedule, energy, options.tolerance))
    newton.improve(error_square, settled, settled_unknowns);
}

// Sweeps, whose last change is left in system.change; returns how many that was in work.
int sweep_on(ContactSystem& system, cairn_schedule& schedule, int sweeps, Extrapolation* extrapolation) {
  if (extrapolation) {
    schedule.relaxation = 1;
    return extrapolation->sweep(sweeps);
  }
  cairn_nlgs_sweep(sweeps, &schedule, system.change.data());
  return sweeps;
}

} // namespace

SolveReport solve_nlgs(ContactSystem& system, const Velocities& velocity_free, const SolverOptions& options,
                       SweepHelp* help) {
  SolveReport report;
  report.penetration = system.penetration;
  for (const cairn_batch& b : system.batches) report.contacts += b.contacts;
  system.load(velocity_free);
  if (std::isfinite(options.accuracy)) report.velocity_error = 0;
  if (system.batches.empty()) return report;
  cairn_schedule schedule = system.schedule(options.threads > 0 ? options.threads : omp_get_max_threads());
  schedule.softening_relaxation = options.softening_relaxation;
  const FreeScale free = measure_free(system, schedule);
  cairn_add_impulses(&schedule);

  // The change of a sweep costs nothing; the error costs about a sweep. Between two errors their squares keep about the
  // same ratio to the change, which tells when the next error is worth its cost.
  double wanted = options.tolerance * options.tolerance; // less where velocities have to be more exact
  double ratio = 0;                                      // error^2 per change
  Relaxation relaxation(schedule.relaxation);
  Extrapolation extrapolation(system, schedule);
  if (!options.extrapolates) extrapolation.forbid();
  // Velocities follow errors a thousand times smaller.
  const double aim = std::isfinite(options.accuracy) ? 1e-3 * options.accuracy : options.tolerance;
  AssociatedStart start(system, options.associated_start && extrapolation.allowed(), aim, options.max_iterations,
                        free.energy);
  BestImpulses best(system);
  VelocityError velocity(system, schedule, velocity_free, options);
  int next_check = std::max(options.min_iterations, 1), next_newton = 64;
  const auto square = [&] { return measure(system, schedule, free, false, report).square; };
  const std::function<double()> error_square = std::ref(square); // by reference: nothing is allocated
  ActiveSet newton(system, schedule, velocity_free, error_square);
  const bool uneven = system.keeps_velocity = masses_differ(mass_ratio(system), help != nullptr);
  const auto light_error = [&] {
    if (uneven) note(measure_light(system, schedule, velocity_free), report);
    return report.light_error;
  };
  // Where faces meet a sweep shifts impulses among the points of a face, and what rests comes to tremble, step by step:
  // impulses of the last step that meet the tolerance stay as they are.
  const bool stays = help && !help->given_up() && !uneven && !extrapolation.allowed() &&
                     !std::isfinite(options.accuracy) && options.min_iterations <= 1 &&
                     report.contacts > settled_unknowns && square() <= wanted;
  while (!stays && report.iterations < options.max_iterations) {
    const bool extrapolates = extrapolation.allowed() && report.iterations >= plain_sweeps;
    int sweeps = std::max({1, report.iterations / 16, options.min_iterations - report.iterations});
    if (extrapolation.allowed() && !extrapolates) sweeps = std::min(sweeps, plain_sweeps - report.iterations);
    sweeps = std::min(sweeps, options.max_iterations - report.iterations);
    schedule.associated = extrapolates && start.on();
    report.iterations += std::min(sweep_on(system, schedule, sweeps, extrapolates ? &extrapolation : nullptr),
                                  options.max_iterations - report.iterations);
    const double change = total(system.change, system.batches.size(), 1, 0);
    const bool promising = ratio > 0 && change * ratio <= wanted;
    const bool last = help && report.iterations >= options.max_iterations; // it is asked before the step fails
    if (std::isfinite(change) && !promising && !last && report.iterations < next_check) continue;
    StepError error = measure(system, schedule, free, false, report);
    if (error.finite && error.square > wanted && report.iterations >= next_newton) {
      newton.improve(error.square, wanted, help && !help->given_up() ? help->few_unknowns() : ActiveSet::most_unknowns);
      extrapolation.restart();
      error = measure(system, schedule, free, false, report);
      next_newton = 4 * report.iterations;
    }
    if (help && error.finite && error.square > wanted && help->pays(report.iterations, std::sqrt(error.square))) {
      if (help->improve(schedule, std::sqrt(error.square), error_square)) report.solver = help->name();
      extrapolation.restart();
      error = measure(system, schedule, free, false, report);
    }
    if (!error.finite || !std::isfinite(change)) {
      if (extrapolates && best.give_back(error.square, velocity_free, schedule)) {
        extrapolation.forbid();
        continue;
      }
      report.status = SolveStatus::diverged;
      give_none(system, velocity_free);
      break;
    }
    const bool due = velocity.due(report.iterations) && error.square <= options.tolerance * options.tolerance;
    if ((error.square <= wanted || due) && report.iterations >= options.min_iterations) {
      if (help && !uneven) settle(newton, system, schedule, report.contacts, error.square, free.energy, options);
      double light = light_error();
      if (help && !help->accepts(report.iterations, light)) {
        if (help->improve(schedule, options.tolerance, error_square)) report.solver = help->name();
        extrapolation.restart();
        error = measure(system, schedule, free, false, report);
        light = light_error();
      }
      if (light <= options.tolerance && (error.square <= wanted || due)) {
        velocity.follow(std::sqrt(error.square));
        const double before = error.square;
        if (velocity.holds(report.iterations, error.square, error_square)) break;
        if (error.square < before) extrapolation.restart();
        const double next = velocity.wanted(std::sqrt(error.square));
        wanted = next * next;
        if (help) help->aim(next);
      }
    }
    best.offer(error.square, report.iterations < options.max_iterations);
    velocity.follow(std::sqrt(error.square));
    if (!extrapolation.allowed()) relaxation.follow(report.iterations, error.square);
    ratio = change > 0 ? error.square / change : 0;
    if (extrapolates && start.ends(report.iterations, error.square, change)) {
      extrapolation.restart();
      ratio = 0;
    }
    next_check = report.iterations + std::max(8, report.iterations / (extrapolates ? 8 : 2));
  }
  StepError end = measure(system, schedule, free, true, report);
  if (report.iterations >= options.max_iterations && end.square > wanted && !velocity.held() &&
      best.give_back(end.square, velocity_free, schedule))
    end = measure(system, schedule, free, true, report);
  light_error();
  if (!velocity.held()) velocity.follow(report.error);
  report.velocity_error = velocity.value();
  conclude(report, end, options);
  return report;
}

} // namespace cairn
