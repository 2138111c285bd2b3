#include "nlgs.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "../sweeps/active_set.hpp"
#include "../sweeps/associated_start.hpp"
#include "../sweeps/batch.hpp"
#include "../sweeps/contact_rows.hpp"
#include "../sweeps/extrapolation.hpp"
#include "../sweeps/light_error.hpp"
#include "../sweeps/moving_cell.hpp"
#include "../sweeps/step_error.hpp"
#include "../sweeps/velocity_error.hpp"

namespace cairn {

namespace {

constexpr int astray = 128;     // sweeps after which extrapolated sweeps of clumps may cycle
constexpr int plain_sweeps = 9; // without acceleration: few contacts are solved by then, good impulses stay as they are

// Projected over-relaxation (Cryer 1971), where sweeps are not extrapolated: an impulse changes by more than its
// contact alone asks, and stays in its cone. It equals blocks of W divided by the factor; bonds keep theirs. A few
// contacts are solved sooner, and to rounding, without it. For Coulomb's cones convergence is not proved above 1: where
// an error did not fall the factor is lowered, down to 1.
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

// True if contacts move too little for the tolerance to tell it from rest. Errors of one sign would move standing
// bodies by a margin below the tolerance, step by step, until they fall (a stack at the edge of toppling).
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

// True if each rigid body has at most a share of the speed that loads alone give it in the step (energy norm). False
// with condensed bodies, or if a driven body moves.
bool resting(const ContactSystem& system, const Velocities& velocity_free, double share) {
  if (!system.condensed.empty()) return false;
  const int dim = system.dim, n = system.velocities();
  for (std::int64_t b = 0; b < system.bodies; ++b) {
    double mass[36], inverse[36], energy = 0, loaded = 0;
    const double* v = system.record[std::size_t(b)].x;
    bool still = true;
    for (int k = 0; k < n; ++k) still = still && !(v[k] < 0 || v[k] > 0);
    if (still) continue;
    body_mass(system, std::int32_t(b), mass, inverse);
    for (int k = 0; k < n; ++k)
      if (!(inverse[(n + 1) * k] > 0)) return false;
    for (int k = 0; k < n; ++k)
      for (int l = 0; l < n; ++l) energy += v[k] * mass[n * l + k] * v[l];
    for (int k = 0; k < dim; ++k) loaded += mass[(n + 1) * k] * velocity_free.bodies[b][k] * velocity_free.bodies[b][k];
    if (!(energy <= share * share * loaded)) return false;
  }
  return true;
}

constexpr int settled_unknowns = 80; // as many take as long as some dozen sweeps

// Solves small systems at rest to rounding.
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
  for (int k = 0; system.cell && k < sweeps; ++k) { // its rates follow each sweep
    cairn_nlgs_sweep(1, &schedule, system.change.data());
    system.cell->follow(system);
  }
  if (!system.cell) cairn_nlgs_sweep(sweeps, &schedule, system.change.data());
  return sweeps;
}

// Notes in their status, which is written at the end, which contacts begin with an impulse.
void mark_loaded(const ContactSystem& system) {
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane) b.status[lane] = at(b, b.r, lane, 0) > 0;
}

// Full blocks of cones in space are refined from the sweep before, in less than half of the time of their solution.
void refine_cones(ContactSystem& system) {
  for (cairn_batch& b : system.batches)
    if (b.solve == cairn_cone_full3 && b.relaxes == 1 && b.components == 3) b.relaxes = 2;
}

// True of a dense pack: many contacts press, and most of them did in the last step. In impacts most of them are new.
bool persists(const ContactSystem& system) {
  constexpr std::int64_t many = 100;
  std::int64_t press = 0, persist = 0;
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane) {
      const bool presses = at(b, b.r, lane, 0) > 0;
      press += presses;
      persist += presses && b.status[lane] != 0;
    }
  return press >= many && 2 * persist > press;
}

std::int64_t contacts_of(const ContactSystem& system) {
  std::int64_t sum = 0;
  for (const cairn_batch& b : system.batches) sum += b.contacts;
  return sum;
}

// One step's sweeps, and when to measure the error: the change of a sweep costs nothing; the error costs about a sweep.
// Between two errors their squares keep about the same ratio to the change, which tells when the next one is worth it.
class Sweeps {
public:
  Sweeps(ContactSystem& system, const Velocities& velocity_free, const SolverOptions& options, SweepHelp* help,
         SolveReport& report)
      : system_(system), velocity_free_(velocity_free), options_(options), help_(help), report_(report),
        schedule_(system.schedule(options.threads > 0 ? options.threads : omp_get_max_threads())),
        free_(measure_free(system, schedule_, options.tolerance)), extrapolation_(system, schedule_),
        start_(system, options.associated_start && options.extrapolates, aim(options), options.max_iterations,
               free_.energy),
        best_(system), velocity_(system, schedule_, velocity_free, options),
        newton_(system, schedule_, velocity_free, error_square_) {
    schedule_.softening_relaxation = options.softening_relaxation;
    if (!options.extrapolates || system.cell) extrapolation_.forbid();
    if (system.rest && system.rest->idle > 0)
      --system.rest->idle;
    else
      rests_ = system.rest;
    may_end_early_ = options.enough > options.tolerance && !std::isfinite(options.accuracy);
    if (may_end_early_) mark_loaded(system);
    if (may_end_early_ && system.clumps) refine_cones(system);
    uneven_ = system.keeps_velocity = masses_differ(mass_ratio(system), help && !system.pack);
    cairn_add_impulses(&schedule_);
  }

  void run() {
    if (stays()) return;
    while (report_.iterations < options_.max_iterations) {
      if (system_.clumps && report_.iterations >= astray) extrapolation_.forbid();
      const bool extrapolates = extrapolation_.allowed() && report_.iterations >= plain_sweeps;
      schedule_.associated = extrapolates && start_.on();
      report_.iterations +=
          std::min(sweep_on(system_, schedule_, sweeps(extrapolates), extrapolates ? &extrapolation_ : nullptr),
                   options_.max_iterations - report_.iterations);
      const double change = total(system_.change, system_.batches.size(), 1, 0);
      lose_patience();
      const bool promising = ratio_ > 0 && change * ratio_ <= wanted_;
      const bool last = help_ && report_.iterations >= options_.max_iterations; // it is asked before the step fails
      if (std::isfinite(change) && !promising && !last && report_.iterations < next_check_) continue;
      StepError error = improve(measure_now());
      if (!error.finite || !std::isfinite(change)) {
        if (extrapolates && best_.give_back(error.square, velocity_free_, schedule_)) {
          extrapolation_.forbid();
          continue;
        }
        report_.status = SolveStatus::diverged;
        give_none(system_, velocity_free_);
        break;
      }
      if (enough(error)) break;
      follow(change, extrapolates);
    }
  }

  void finish() {
    StepError end = measure(system_, schedule_, free_, true, report_);
    if (report_.iterations >= options_.max_iterations && end.square > wanted_ && !velocity_.held() &&
        best_.give_back(end.square, velocity_free_, schedule_)) {
      if (system_.cell) system_.cell->follow(system_);
      end = measure(system_, schedule_, free_, true, report_);
    }
    light_error();
    velocity_.end(report_.error);
    report_.velocity_error = velocity_.value();
    end.vague = velocity_.asked() && !velocity_.held();
    end.rounded = end.vague && velocity_.exhausted();
    SolverOptions asked = options_;
    asked.tolerance = ends_at();
    if (end.square <= wanted_ && report_.light_error <= asked.tolerance && !system_.cell) // which gives way
      end.unbounded = grows_without_end(system_, schedule_, velocity_free_, end, aim(options_));
    if (refinement_.change > 0 && !refinement_.known && !velocity_.asked()) {
      report_.velocity_error = refinement_.change;
      asked.accuracy = options_.tolerance;
    }
    conclude(report_, end, asked);
    if (report_.status == SolveStatus::converged) rest_if_still();
  }

private:
  // Velocities follow errors a thousand times smaller.
  static double aim(const SolverOptions& options) {
    return std::isfinite(options.accuracy) ? 1e-3 * options.accuracy : options.tolerance;
  }
  StepError measure_now() { return measure(system_, schedule_, free_, false, report_); }
  double light_error() {
    if (uneven_) note(measure_light(system_, schedule_, velocity_free_), report_);
    return report_.light_error;
  }
  // True if impulses of the last step meet the tolerance and stay as they are: between faces a sweep shifts impulses
  // among the points of a face, and bodies at rest would begin to tremble, step by step.
  bool stays() {
    const bool may = help_ && !help_->given_up() && !uneven_ && !extrapolation_.allowed() &&
                     !std::isfinite(options_.accuracy) && options_.min_iterations <= 1 &&
                     report_.contacts > settled_unknowns && error_square_() <= wanted_ &&
                     !help_->refines(0, report_.error);
    if (may) come_to_rest(report_.error * report_.error);
    return may;
  }
  // Newton's method takes the error down to rounding once contacts stand still: a residual of the same sign in each
  // step adds up, and a tower of many blocks comes to sway. Later steps start from a solution. Bodies that move slowly
  // ask for it in each step, so attempts that follow each other become ever rarer.
  bool come_to_rest(double error_square) {
    constexpr int most = 13, free = 3; // attempts in a row; those after which no steps are left out
    if (!help_ || help_->given_up() || uneven_ || !rests_) return false;
    if (error_square <= small() * small()) {
      RestMemory& rest = *std::exchange(rests_, nullptr);
      rest.attempts = std::max(0, rest.attempts - 1);
      return false;
    }
    if (!near_rest(system_, schedule_, free_.energy, options_.tolerance)) return false;
    RestMemory& rest = *std::exchange(rests_, nullptr);
    rest.attempts = std::min(most, rest.attempts + 1);
    rest.idle = rest.attempts > free ? (1 << (rest.attempts - free)) - 1 : 0;
    if (!help_->settles(schedule_, std::sqrt(error_square), finest, error_square_)) return false;
    report_.solver = help_->name();
    return true;
  }
  // Relative errors in the energy norm: target of Newton's method at rest, and the largest that counts as rest.
  static constexpr double finest = 0x1p-44;
  double small() const { return std::max(0x1p-17 * options_.tolerance, 0x1p-36); }
  // Sets velocities to zero if each body is slower than a share of the speed that loads alone would give it, so that
  // the residual does no work: under unchanged impulses bodies would topple, slowly at first.
  void rest_if_still() {
    if (!help_ || help_->given_up() || uneven_ || system_.rest == nullptr || report_.error > small() ||
        !resting(system_, velocity_free_, small()))
      return;
    for (cairn_record& record : system_.record) std::fill_n(record.x, system_.dim == 2 ? 3 : 6, 0.0);
    system_.keeps_velocity = true;
  }
  double ends_at() const { return early_ ? options_.enough : options_.tolerance; }
  // Force chains of a dense pack build up over several steps, each of which begins with the impulses of the last: later
  // steps reduce the residual of this one.
  void lose_patience() {
    if (early_ || !may_end_early_ || report_.iterations < options_.patience || !persists(system_)) return;
    early_ = true;
    wanted_ = options_.enough * options_.enough;
    if (help_) help_->aim(options_.enough);
  }
  // Sweeps of a dense pack go on alone as long as the larger error does not count yet.
  bool waits() const {
    return may_end_early_ && !early_ && report_.iterations < std::min(options_.patience, options_.max_iterations) &&
           persists(system_);
  }
  // Until the next look at the change.
  int sweeps(bool extrapolates) const {
    int sweeps = std::max({1, report_.iterations / 16, options_.min_iterations - report_.iterations});
    if (extrapolation_.allowed() && !extrapolates) sweeps = std::min(sweeps, plain_sweeps - report_.iterations);
    return std::min(sweeps, options_.max_iterations - report_.iterations);
  }
  // Improves by Newton's method on the active set of few contacts, and by further help where it pays.
  StepError improve(StepError error) {
    if (error.finite && error.square > wanted_ && report_.iterations >= next_newton_ && !system_.cell) {
      newton_.improve(error.square, wanted_,
                      help_ && !help_->given_up() ? help_->few_unknowns() : ActiveSet::most_unknowns);
      extrapolation_.restart();
      error = measure_now();
      next_newton_ = 4 * report_.iterations;
    }
    if (help_ && !waits() && error.finite && error.square > wanted_ &&
        help_->pays(report_.iterations, std::sqrt(error.square)))
      error = ask(std::sqrt(error.square));
    return error;
  }
  StepError ask(double error) {
    if (help_->improve(schedule_, error, error_square_)) report_.solver = help_->name();
    extrapolation_.restart();
    return measure_now();
  }
  // True if this error ends the sweeps.
  bool enough(StepError& error) {
    const bool due = velocity_.due(report_.iterations) && error.square <= options_.tolerance * options_.tolerance;
    if ((error.square <= wanted_ || due) && report_.iterations >= options_.min_iterations) {
      if (help_ && !uneven_)
        settle(newton_, system_, schedule_, report_.contacts, error.square, free_.energy, options_);
      if (help_ && !uneven_ && report_.contacts * system_.dim > settled_unknowns && come_to_rest(error.square))
        error = measure_now();
      double light = light_error();
      if (help_ && !help_->accepts(report_.iterations, light)) {
        error = ask(options_.tolerance);
        light = light_error();
      }
      if (help_ && error.square <= wanted_ && help_->refines(report_.iterations, report_.error)) {
        refinement_ = help_->refine(report_.error, error_square_);
        velocity_.told(refinement_);
        error = measure_now();
        if (velocity_.held()) return true;
      }
      if (light <= ends_at() && (error.square <= wanted_ || due)) {
        velocity_.follow(std::sqrt(error.square));
        const double before = error.square;
        if (velocity_.holds(report_.iterations, error.square, error_square_)) return true;
        if (error.square < before) extrapolation_.restart();
        const double next = velocity_.wanted(std::sqrt(error.square));
        wanted_ = next * next;
        if (help_) help_->aim(next);
      }
    }
    best_.offer(error.square, report_.iterations < options_.max_iterations);
    velocity_.follow(std::sqrt(error.square));
    error_ = error.square;
    return false;
  }
  void follow(double change, bool extrapolates) {
    if (!extrapolation_.allowed()) relaxation_.follow(report_.iterations, error_);
    ratio_ = change > 0 ? error_ / change : 0;
    if (extrapolates && start_.ends(report_.iterations, error_, change)) {
      extrapolation_.restart();
      ratio_ = 0;
    }
    next_check_ = report_.iterations + std::max(8, report_.iterations / (extrapolates ? 8 : 2));
  }

  ContactSystem& system_;
  const Velocities& velocity_free_;
  const SolverOptions& options_;
  SweepHelp* help_;
  SolveReport& report_;
  cairn_schedule schedule_;
  const FreeScale free_;
  double wanted_ = options_.tolerance * options_.tolerance; // less where velocities have to be more exact
  double ratio_ = 0;                                        // error^2 per change
  double error_ = 0;                                        // the last one's square
  Relaxation relaxation_{schedule_.relaxation};
  Extrapolation extrapolation_;
  AssociatedStart start_; // of extrapolated sweeps alone
  BestImpulses best_;
  VelocityError velocity_;
  Refinement refinement_;                                                          // the last
  std::function<double()> error_square_ = [this] { return measure_now().square; }; // a pointer: nothing is allocated
  ActiveSet newton_;
  int next_check_ = std::max(options_.min_iterations, 1), next_newton_ = 64;
  bool uneven_ = false;
  bool may_end_early_ = false, early_ = false; // at `enough`
  RestMemory* rests_ = nullptr;                // where this step may be solved to rounding
};

} // namespace

SolveReport solve_nlgs(ContactSystem& system, const Velocities& velocity_free, const SolverOptions& options,
                       SweepHelp* help) {
  SolveReport report;
  report.penetration = system.penetration;
  report.drift = system.drift;
  report.contacts = contacts_of(system);
  system.load(velocity_free);
  if (std::isfinite(options.accuracy)) report.velocity_error = 0;
  if (system.batches.empty()) return report;
  Sweeps sweeps(system, velocity_free, options, help, report);
  sweeps.run();
  sweeps.finish();
  return report;
}

} // namespace cairn
