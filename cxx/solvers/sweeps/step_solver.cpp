#include "step_solver.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

#include "../../base/call.hpp"
#include "../problems/nlgs.hpp"
#include "../problems/ppa_newton.hpp"
#include "active_set.hpp"
#include "batch.hpp"
#include "error_forecast.hpp"
#include "jointed_problem.hpp"
#include "light_error.hpp"
#include "newton_correction.hpp"
#include "solid_correction.hpp"
#include "step_error.hpp"
#include "step_problem.hpp"

namespace cairn {

namespace {

// The problem is solved a little further than the step asks: the two errors differ by rounding.
ProblemOptions problem_options(const SolverOptions& options) {
  ProblemOptions o;
  o.tolerance = options.tolerance * (1 - 0x1p-10);
  o.max_iterations = options.max_iterations;
  o.threads = options.threads > 0 ? options.threads : omp_get_max_threads();
  o.warm_start = true;
  o.max_bytes = options.max_bytes;
  return o;
}

// Proximal point around Newton's method, as soon as the errors of the sweeps foretell a way longer than its own.
class NewtonHelp : public SweepHelp {
public:
  NewtonHelp(ContactSystem& system, const Velocities& velocity_free, const SolverOptions& options)
      : system_(system), velocity_free_(velocity_free), options_(options), forecast_(options.tolerance),
        ratio_(mass_ratio(system)), patience_(first_patience()), cost_(of_newton * of_contact * contacts()),
        from_nothing_(begins_from_nothing(system)),
        given_up_(!StepProblem::obstacle(system).empty() || !has_factorisations()),
        enough_(system.condensed.empty() ? light_enough(options.tolerance, ratio_) : 0.1 * options.tolerance) {}

  bool pays(int iterations, double error) override {
    constexpr double believed = 4; // times the way that is behind: errors may stand still for a while
    // Price relative to the expected cost: errors that sweeps leave just below the tolerance must be swept again in the
    // next steps. In 2D, where a sweep takes a twentieth of an iteration, piles take ten times as many iterations as
    // expected.
    const double price = in_plane() && !tries_sticking() ? 1.2 : 0.15;
    const double to_come = std::min(forecast_.sweeps_to_come(iterations, error), believed * iterations);
    const bool last = iterations >= options_.max_iterations; // rather than fail
    sweeps_ = iterations;
    if (given_up_ || (iterations < patience_ && !last)) return false;
    const auto far = [&] { return last || to_come * sweep_operations(system_) >= price * cost_; };
    if (!far()) return false;
    if (!asked_ && !last && (iterations + to_come) * sweep_operations(system_) < of_asking * operations_of_asking())
      return false;
    if (!asked_) ask();
    return !given_up_ && far();
  }

  bool accepts(int iterations, double light) override {
    constexpr double few_contacts = 5000, few_sweeps = 256;
    if (given_up_ || refinements_ >= most_refinements || light <= enough_) return true;
    const bool urgent = light > 0.1; // something sinks
    if (!urgent && contacts() > few_contacts) return true;
    if (!asked_) ask();
    const double cost = 0.2 * cost_; // a refinement takes few iterations
    if (given_up_ || (!urgent && cost > std::max(few_sweeps, 2.0 * iterations) * sweep_operations(system_)))
      return true;
    ++refinements_;
    light_ = light;
    return false;
  }

  bool improve(const cairn_schedule& schedule, double error, const std::function<double()>& measure) override {
    StepProblem step(system_, schedule, velocity_free_);
    if (system_.needs_blocks()) step.form_blocks();
    Array<double> start(step.problem().unknowns());
    step.read(start.data());
    ProblemOptions options = problem_options(options_);
    if (light_ > 0 && !system_.condensed.empty()) { // whose velocities the solver does not refine: impulses have to do
      constexpr double finest = 1e-14;
      options.tolerance =
          std::clamp(0.1 * options_.tolerance / light_ * std::sqrt(measure()), finest, options.tolerance);
    }
    // as much work as was done before, so that neither method wastes much; larger systems take more (measured)
    const double operations = cost_ / of_newton, before = sweeps_ * sweep_operations(system_) + newton_operations_;
    const int least = std::max(least_iterations, int(std::sqrt(system_.dim * contacts())));
    options.max_iterations = std::max(least, int(std::min(before / operations, 1e6)));
    Array<double> r(start);
    // From nothing it finds the impulses that are smallest, far inside their cones. From those of a few sweeps it ends
    // at the edges of cones, so that many contacts change in the next step, and the step takes hundreds of sweeps.
    const bool last = sweeps_ >= options_.max_iterations; // no sweeps are left to go on
    const bool tries = tries_sticking() && !last;
    // In 2D, where it fails from the impulses of sweeps, it needs a start of its own, and about as many iterations as
    // there are unknowns: once sweeps took a quarter of that work, if those still allowed would take longer.
    const double whole = of_unknowns * system_.dim * contacts(), left = options_.max_iterations - sweeps_;
    const bool anew = fails_from_sweeps_ && !began_anew_ && !last && 4 * before >= whole * operations &&
                      whole * operations <= left * sweep_operations(system_);
    if (anew) options.max_iterations = int(whole);
    if (from_nothing_ || anew) std::fill(r.begin(), r.end(), 0.0);
    from_nothing_ = false;
    ProximalNewton newton(step.problem(), options, r.data());
    if (tries) newton.go_on_if_sticking();
    began_anew_ = began_anew_ || anew;
    const bool follows = !tries && !anew && in_plane() && !last;
    if (follows) newton.go_on_from_sweeps();
    if (!heavy_on_light()) newton.settle_failures(1);
    const ProblemReport report = newton.solve();
    newton_operations_ += double(report.iterations) * operations;
    const bool better = takes(step, start, r, report, schedule, [&] {
      const double now = std::sqrt(measure());
      return now < error || now <= options_.tolerance;
    });
    if (report.status != ProblemStatus::converged) {
      if (!tries) patience_ *= follows && !began_anew_ ? 4 : 8;
      fails_from_sweeps_ = fails_from_sweeps_ || follows;
    }
    return better;
  }

  bool settles(const cairn_schedule& schedule, double error, double wanted,
               const std::function<double()>& measure) override {
    constexpr double most_sweeps = 4096; // as long as which it may take
    constexpr int most = 24;             // iterations
    if (given_up_ || !system_.condensed.empty()) return false;
    if (!asked_) ask();
    if (given_up_ || cost_ > most_sweeps * sweep_operations(system_)) return false;
    StepProblem step(system_, schedule, velocity_free_);
    Array<double> start(step.problem().unknowns());
    step.read(start.data());
    ProblemOptions options = problem_options(options_);
    options.tolerance = wanted;
    options.max_iterations = most;
    Array<double> r(start);
    ProximalNewton newton(step.problem(), options, r.data());
    newton.settle_failures(1);
    const ProblemReport report = newton.solve();
    return takes(step, start, r, report, schedule, [&] { return std::sqrt(measure()) < error; });
  }

  void aim(double error) override {
    options_.tolerance = error;
    forecast_.aim(error);
  }
  bool given_up() const override { return given_up_; }
  const char* name() const override { return "ppa_newton"; }
  int few_unknowns() const override { return 96; }

private:
  // Impulses of a solver, with records to go with them, where they are better than those it began with.
  template <class F>
  bool takes(StepProblem& step, const Array<double>& start, const Array<double>& r, const ProblemReport& report,
             const cairn_schedule& schedule, F&& better) {
    step.write(r.data());
    system_.load(velocity_free_);
    cairn_add_impulses(&schedule);
    step.write_velocities(velocity_free_, report.velocity);
    if (better()) return true;
    step.write(start.data());
    system_.load(velocity_free_);
    cairn_add_impulses(&schedule);
    return false;
  }

  // True in 2D for rigid bodies; measurements on these do not hold for meshes, whose contacts are nearly dependent.
  bool in_plane() const { return system_.dim == 2 && !system_.needs_blocks(); }

  // In the plane a few iterations tell whether nearly all contacts stick, which Newton's method solves at once.
  bool tries_sticking() const { return in_plane() && from_nothing_; }

  bool heavy_on_light() const { return masses_differ(ratio_, true); }

  // Sweeps before the first help. Few contacts get an active set after 64 sweeps, which is exact where masses are
  // alike.
  std::int64_t first_patience() const {
    if (heavy_on_light()) return 32;
    if (system_.dim * contacts() <= NewtonHelp::few_unknowns()) return 64;
    return system_.dim == 2 ? 16 : 8;
  }

  double contacts() const {
    double sum = 0;
    for (const cairn_batch& b : system_.batches) sum += b.contacts;
    return sum;
  }

  // Cost of the graph of bodies and of the order of its factors (measured).
  double operations_of_asking() const { return 1000.0 * system_.velocities() * contacts(); }

  // Finds the cost of Newton's method; before that its least cost is known.
  void ask() {
    asked_ = given_up_ = true;
    const cairn_schedule schedule = system_.schedule(1);
    StepProblem step(system_, schedule, velocity_free_);
    const bool fits = !system_.needs_blocks() || step.bytes() <= options_.max_bytes;
    if (system_.needs_blocks() && fits) step.form_blocks();
    if (step.problem().contacts > 0 && fits) find_cost(step.problem()); // or nothing can touch
    system_.load(velocity_free_);
    cairn_add_impulses(&schedule);
  }

  void find_cost(const FrictionProblem& problem) {
    Array<double> r(problem.unknowns());
    try {
      const ProximalNewton newton(problem, problem_options(options_), r.data());
      cost_ = of_newton * (newton.operations() + of_contact * double(problem.contacts));
      given_up_ = false;
    } catch (const FactorsTooLarge&) { // sweeps alone
    }
  }

  static constexpr double of_newton = 15, of_contact = 2000; // iterations, operations
  static constexpr double of_unknowns = 0.75;                // iterations from nothing in the plane (measured)
  static constexpr double of_asking = 2;                     // work of a step over that of asking
  ContactSystem& system_;
  Velocities velocity_free_;
  SolverOptions options_;
  ErrorForecast forecast_;
  double ratio_;          // of masses
  std::int64_t patience_; // sweeps
  static constexpr int least_iterations = 24, most_refinements = 64;
  int sweeps_ = 0, refinements_ = 0;
  double cost_, newton_operations_ = 0; // expected, done
  double light_ = 0;                    // the light error that was not accepted last
  bool from_nothing_;                   // the step begins without impulses
  bool given_up_, asked_ = false, fails_from_sweeps_ = false, began_anew_ = false;
  double enough_; // light error; on meshes carried bodies lean on nodes held by the body
};

// Newton's method over bodies, where laws have a local solution of their own.
class SolidHelp : public SweepHelp {
public:
  SolidHelp(ContactSystem& system, const Velocities& velocity_free, const SolverOptions& options)
      : system_(system), velocity_free_(velocity_free), options_(options), forecast_(options.tolerance),
        tolerance_(options.tolerance),
        solid_bonds_(SolidCorrection::makes_solid(system, std::isfinite(options.accuracy), options.tolerance)),
        jointed_(!solid_bonds_ && JointedProblem::needed(system)), zones_(SolidCorrection::zones_alone(system)) {
    if (zones_) SolidCorrection::keep_start(system);
  }

  bool pays(int iterations, double error) override {
    const double to_come = forecast_.sweeps_to_come(iterations, error);
    const bool last = iterations >= options_.max_iterations;
    if (given_up_ || (iterations < patience_ && !last)) return false;
    const double passes = failures_ > 0 ? 32 : 4;
    const double sweep = sweep_operations(system_), pass = SolidCorrection::operations(system_);
    // Errors of joints move whole chains, where errors fall fast at first and then stand: work done by sweeps counts,
    // too.
    const bool again = failures_ == 0 && (options_.again == 2 || (options_.again == 1 && iterations * sweep >= pass));
    if (!again && !last && !(to_come * sweep >= passes * pass)) return false;
    return possible();
  }

  // True if the light error is accepted. Under heavy bodies the error of the whole does not show light bodies: passes
  // go on to a smaller error for their sake.
  bool accepts(int, double light) override {
    constexpr double margin = 0.25;
    if (light <= options_.tolerance || given_up_ || refinements_ >= most_refinements || !possible()) return true;
    finer_ *= margin * std::max(options_.tolerance / light, 0x1p-20);
    ++refinements_;
    return false;
  }

  bool improve(const cairn_schedule&, double error, const std::function<double()>& measure) override {
    constexpr double fall = 4;
    const double wanted = finer_ * options_.tolerance;
    if (zones_) {
      const int passes = solid_->solve_zones(error * error, wanted * wanted, measure);
      zones_ = false; // one try a step: other passes and sweeps go on from its end
      if (passes > 0) return true;
    }
    const int passes = solid_->improve(error * error, wanted * wanted, measure);
    const double now = std::sqrt(measure());
    // in short steps inertia exceeds springs, and sweeps find contacts in pressure and tension sooner
    if (!(now <= options_.tolerance || now * fall <= error)) given_up_ = ++failures_ > 1;
    patience_ *= 2;
    return passes > 0;
  }

  // The more a pass costs beside the sweeps until now, the more it has to be worth.
  bool refines(int iterations, double error) override {
    constexpr double most = 8, share = 4, small = 1e5;
    if (!(solid_bonds_ || jointed_) || given_up_ || refined_ > 0 || !(error > 0)) return false;
    if (std::isfinite(options_.accuracy) && solid_bonds_) return true;
    const double cost = SolidCorrection::operations(system_) / (std::max(iterations, 1) * sweep_operations(system_));
    const bool wanted =
        SolidCorrection::amplification(system_) * error_of_speed() > std::clamp(cost / share, 1.0, most) * tolerance_;
    // Self-stress of rings by sweeps stays from step to step: it is dropped after several sweeps, and in small solids.
    const bool cheap = cost <= share || SolidCorrection::operations(system_) < small;
    only_rings_ = !wanted && iterations > 1 && cheap && SolidCorrection::has_bonds(system_);
    return wanted || only_rings_;
  }

  Refinement refine(double error, const std::function<double()>& measure) override {
    if (++refined_; !possible()) return {};
    if (jointed_) {
      solid_->settle_joints(tolerance_, measure);
      return {};
    }
    if (only_rings_) {
      solid_->drop_self_stress_within(tolerance_, measure);
      return {};
    }
    return solid_->refine(error, std::min(tolerance_, options_.accuracy), tolerance_, measure);
  }

  void aim(double error) override {
    options_.tolerance = error;
    forecast_.aim(error);
  }
  bool given_up() const override { return given_up_; }
  const char* name() const override { return "newton_over_bodies"; }
  int few_unknowns() const override { return ActiveSet::most_unknowns; }

private:
  // Beside the velocities, however much impulses in balance are.
  double error_of_speed() const {
    return std::sqrt(total(system_.sums, system_.batches.size(), 6, 0)) / system_.speed();
  }

  bool possible() {
    if (!solid_) {
      schedule_ = system_.schedule(1);
      solid_.emplace(system_, schedule_, velocity_free_);
      given_up_ = !solid_->possible();
      if (!given_up_) solid_->ask_for_what_rings_can();
    }
    return !given_up_;
  }

  static constexpr int most_refinements = 16;
  ContactSystem& system_;
  const Velocities& velocity_free_;
  SolverOptions options_;
  ErrorForecast forecast_;
  cairn_schedule schedule_{};
  std::optional<SolidCorrection> solid_;
  std::int64_t patience_ = options_.again == 2 ? 1 : 8; // sweeps
  int failures_ = 0, refinements_ = 0;
  double finer_ = 1; // share of the tolerance that passes aim at
  double tolerance_; // that was asked for
  int refined_ = 0;
  bool only_rings_ = false;
  bool solid_bonds_, jointed_, zones_;
  bool given_up_ = false;
};

void tell_of_memory(ProblemReport& solved, double bytes, double most) {
  char hint[160];
  if (std::isfinite(bytes))
    std::snprintf(hint, sizeof hint, "W would take %.2g bytes, memory is %.2g: allow more, or take NLGS", bytes, most);
  else
    std::snprintf(hint, sizeof hint,
                  "the compliance of a mesh would take more than memory, %.2g bytes: allow more, or take NLGS", most);
  solved.hint = hint;
}

// Impulses of contacts alone, and records with the velocities that they leave.
ProblemReport solve_cones(ContactSystem& system, const cairn_schedule& schedule, const Velocities& velocity_free,
                          const SolverOptions& options, const ProblemSolverInfo& solver) {
  StepProblem step(system, schedule, velocity_free);
  Array<double> r(step.problem().unknowns());
  step.read(r.data());
  const bool over_bodies = solver.name == "ppa_newton" && !system.needs_blocks();
  const double bytes = over_bodies ? 0 : step.bytes();
  ProblemReport solved;
  if (bytes > options.max_bytes) {
    tell_of_memory(solved, bytes, options.max_bytes);
  } else {
    if (!over_bodies) step.form_blocks();
    solved = solve_problem(step.problem(), solver.name, problem_options(options), r.data());
  }
  step.write(r.data());
  system.load(velocity_free);
  cairn_add_impulses(&schedule);
  step.write_velocities(velocity_free, solved.velocity);
  return solved;
}

// The same of contacts and joints. What the answer asks for besides is posed, and where the error of the whole is above
// the tolerance, though that of the contacts is not, these are solved further.
ProblemReport solve_jointed(ContactSystem& system, const cairn_schedule& schedule, const Velocities& velocity_free,
                            const SolverOptions& options, const ProblemSolverInfo& solver,
                            const std::function<double()>& measure) {
  constexpr int most = 64; // problems
  constexpr double finest = 0x1p-50;
  JointedProblem step(system, schedule, velocity_free);
  ProblemOptions own = problem_options(options);
  ProblemReport solved;
  std::int64_t iterations = 0;
  double before = std::numeric_limits<double>::infinity();
  Array<double> r;
  for (int pass = 0; pass < most && iterations < options.max_iterations; ++pass) {
    own.max_iterations = options.max_iterations - int(iterations);
    if (!step.hold()) {
      solved.status = ProblemStatus::diverged;
      break;
    }
    if (const double bytes = step.bytes(); bytes > options.max_bytes) {
      tell_of_memory(solved, bytes, options.max_bytes);
      break;
    }
    step.form();
    step.read(r);
    solved = solve_problem(step.problem(), solver.name, own, r.data());
    iterations += solved.iterations;
    step.write(r.data());
    system.load(velocity_free);
    cairn_add_impulses(&schedule);
    if (step.amend()) continue;
    const double error = measure();
    const bool helps = error > options.tolerance && error < 0.5 * before && own.tolerance > finest;
    if (solved.status != ProblemStatus::converged || !helps) break;
    before = error;
    own.tolerance = std::max(finest, 0.25 * own.tolerance * options.tolerance / error);
  }
  solved.iterations = iterations;
  return solved;
}

SolveReport solve_by_problem(ContactSystem& system, const Velocities& velocity_free, const SolverOptions& options,
                             const ProblemSolverInfo& solver) {
  SolveReport report;
  report.penetration = system.penetration;
  report.drift = system.drift;
  report.solver = solver.name.c_str();
  for (const cairn_batch& b : system.batches) report.contacts += b.contacts;
  system.load(velocity_free);
  if (system.batches.empty()) return report;
  const std::string obstacle = JointedProblem::obstacle(system);
  if (!obstacle.empty()) throw Error(obstacle + ": take cairn.NLGS or cairn.Auto instead of " + solver.python_name);
  const cairn_schedule schedule = system.schedule(1);
  const FreeScale free = measure_free(system, schedule, options.tolerance);
  const auto error_now = [&] { return std::sqrt(measure(system, schedule, free, false, report).square); };
  // Error of the initial impulses. A problem knows its own rounding alone: for bodies that fall side by side its terms
  // are only rounding, and its result must not replace an exact answer of the whole step.
  cairn_add_impulses(&schedule);
  const StepError start = measure(system, schedule, free, false, report);
  const bool solved_before = start.finite && start.square <= 0;
  if (!solved_before) system.load(velocity_free);
  ProblemReport solved;
  if (!solved_before)
    solved = JointedProblem::needed(system) ? solve_jointed(system, schedule, velocity_free, options, solver, error_now)
                                            : solve_cones(system, schedule, velocity_free, options, solver);
  report.iterations = int(std::min<std::int64_t>(solved.iterations, std::numeric_limits<int>::max()));
  StepError error = measure(system, schedule, free, true, report);
  if ((system.keeps_velocity = masses_differ(mass_ratio(system), true)))
    note(measure_light(system, schedule, velocity_free), report);
  if (!error.finite || solved.status == ProblemStatus::diverged) report.status = SolveStatus::diverged;
  if (!error.finite) {
    give_none(system, velocity_free);
    error = measure(system, schedule, free, true, report);
  }
  if (report.light_error <= options.tolerance)
    error.unbounded = grows_without_end(system, schedule, velocity_free, error, options.tolerance);
  conclude(report, error, options, solved.hint);
  return report;
}

} // namespace

SolveReport solve_step(ContactSystem& system, const Velocities& velocity_free, const SolverOptions& options) {
  if (std::isfinite(options.accuracy) && options.solver != "nlgs" && options.solver != "auto")
    throw Error("accuracy is estimated between sweeps: take cairn.NLGS or cairn.Auto instead of " + options.solver +
                ", or leave accuracy out");
  if (system.cell && options.solver != "nlgs" && options.solver != "auto")
    throw Error("the cell follows the stress between sweeps: take cairn.NLGS or cairn.Auto instead of " +
                options.solver + ", or drive it by rates alone");
  if (options.solver == "nlgs" || system.cell) return solve_nlgs(system, velocity_free, options);
  if (options.solver == "auto" && SolidCorrection::obstacle(system).empty()) {
    SolidHelp help(system, velocity_free, options);
    return solve_nlgs(system, velocity_free, options, &help);
  }
  if (options.solver == "auto") {
    NewtonHelp help(system, velocity_free, options);
    return solve_nlgs(system, velocity_free, options, &help);
  }
  for (const ProblemSolverInfo& row : problem_solvers())
    if (row.name == options.solver) return solve_by_problem(system, velocity_free, options, row);
  throw Error("there is no contact solver '" + options.solver + "'");
}

} // namespace cairn
