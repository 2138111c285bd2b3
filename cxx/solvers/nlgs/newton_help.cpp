#include <algorithm>
#include <cmath>

#include "../policy.hpp"
#include "../problems/ppa_newton.hpp"
#include "../sweeps/error_forecast.hpp"
#include "../sweeps/light_error.hpp"
#include "../sweeps/newton_correction.hpp"
#include "../sweeps/step_by_problem.hpp"
#include "../sweeps/step_problem.hpp"
#include "nlgs.hpp"

namespace cairn {

namespace {

// Proximal point around Newton's method, as soon as the errors of the sweeps foretell a way longer than its own.
class NewtonHelp : public SweepHelp {
public:
  NewtonHelp(ContactSystem& system, const Velocities& velocity_free, const SolverOptions& options)
      : system_(system), velocity_free_(velocity_free), options_(options), forecast_(options.tolerance),
        ratio_(mass_ratio(system)), patience_(first_patience()),
        cost_(policy().newton_iterations * policy().newton_contact * contacts()),
        from_nothing_(begins_from_nothing(system)),
        given_up_(!StepProblem::obstacle(system).empty() || !has_factorisations()),
        enough_(light_enough(options.tolerance, ratio_, !system.condensed.empty())) {}

  bool pays(int iterations, double error) override {
    const double believed =
        policy().newton_believed; // times the way that is behind: errors may stand still for a while
    // Price relative to the expected cost: errors that sweeps leave just below the tolerance must be swept again in the
    // next steps. In 2D, where a sweep takes a twentieth of an iteration, piles take ten times as many iterations as
    // expected.
    const double price = in_plane() && !tries_sticking() ? policy().newton_price_plane : policy().newton_price;
    const double to_come = std::min(forecast_.sweeps_to_come(iterations, error), believed * iterations);
    const bool last = iterations >= options_.max_iterations; // rather than fail
    sweeps_ = iterations;
    if (given_up_ || (iterations < patience_ && !last)) return false;
    const auto far = [&] { return last || to_come * sweep_operations(system_) >= price * cost_; };
    if (!far()) return false;
    if (!asked_ && !last &&
        (iterations + to_come) * sweep_operations(system_) < policy().newton_asking * operations_of_asking())
      return false;
    if (!asked_) ask();
    return !given_up_ && far();
  }

  bool accepts(int iterations, double light) override {
    const double few_contacts = policy().light_contacts, few_sweeps = policy().light_sweeps;
    if (given_up_ || refinements_ >= policy().light_refinements || light <= enough_) return true;
    const bool urgent = light > policy().light_urgent; // something sinks
    if (!urgent && contacts() > few_contacts) return true;
    if (!asked_) ask();
    const double cost = policy().light_cost * cost_; // a refinement takes few iterations
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
      options.tolerance = std::clamp(policy().light_on_nodes * options_.tolerance / light_ * std::sqrt(measure()),
                                     finest, options.tolerance);
    }
    // as much work as was done before, so that neither method wastes much; larger systems take more (measured)
    const double operations = cost_ / policy().newton_iterations,
                 before = sweeps_ * sweep_operations(system_) + newton_operations_;
    const int least = std::max(policy().newton_iterations_least, int(std::sqrt(system_.dim * contacts())));
    options.max_iterations = std::max(least, int(std::min(before / operations, 1e6)));
    Array<double> r(start);
    // From nothing it finds the impulses that are smallest, far inside their cones. From those of a few sweeps it ends
    // at the edges of cones, so that many contacts change in the next step, and the step takes hundreds of sweeps.
    const bool last = sweeps_ >= options_.max_iterations; // no sweeps are left to go on
    const bool tries = tries_sticking() && !last;
    // In 2D, where it fails from the impulses of sweeps, it needs a start of its own, and about as many iterations as
    // there are unknowns: once sweeps took a quarter of that work, if those still allowed would take longer.
    const double whole = policy().newton_unknowns * system_.dim * contacts(), left = options_.max_iterations - sweeps_;
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
      if (!tries) patience_ *= follows && !began_anew_ ? policy().newton_failed_plane : policy().newton_failed;
      fails_from_sweeps_ = fails_from_sweeps_ || follows;
    }
    return better;
  }

  bool settles(const cairn_schedule& schedule, double error, double wanted,
               const std::function<double()>& measure) override {
    const double most_sweeps = policy().newton_settling_cost; // as long as which it may take
    const int most = policy().newton_settling_iterations;     // iterations
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
  double operations() const override { return cost_; }
  const char* name() const override { return "ppa_newton"; }
  int few_unknowns() const override { return policy().newton_few_unknowns; }

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

  // Sweeps before the first help.
  std::int64_t first_patience() const {
    if (heavy_on_light()) return policy().newton_patience_uneven;
    return system_.dim == 2 ? policy().newton_patience_plane : policy().newton_patience;
  }

  double contacts() const {
    double sum = 0;
    for (const cairn_batch& b : system_.batches) sum += b.contacts;
    return sum;
  }

  // Cost of the graph of bodies and of the order of its factors (measured).
  double operations_of_asking() const { return policy().newton_asking_contact * system_.velocities() * contacts(); }

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
      cost_ = policy().newton_iterations * (newton.operations() + policy().newton_contact * double(problem.contacts));
      given_up_ = false;
    } catch (const FactorsTooLarge&) { // sweeps alone
    }
  }

  ContactSystem& system_;
  Velocities velocity_free_;
  SolverOptions options_;
  ErrorForecast forecast_;
  double ratio_;          // of masses
  std::int64_t patience_; // sweeps
  int sweeps_ = 0, refinements_ = 0;
  double cost_, newton_operations_ = 0; // expected, done
  double light_ = 0;                    // the light error that was not accepted last
  bool from_nothing_;                   // the step begins without impulses
  bool given_up_, asked_ = false, fails_from_sweeps_ = false, began_anew_ = false;
  double enough_; // light error; on meshes carried bodies lean on nodes held by the body
};

} // namespace

SolveReport solve_nlgs_and_newton(ContactSystem& system, const Velocities& velocity_free,
                                  const SolverOptions& options) {
  NewtonHelp help(system, velocity_free, options);
  return solve_nlgs(system, velocity_free, options, &help);
}

std::unique_ptr<SweepHelp> newton_help(ContactSystem& system, const Velocities& velocity_free,
                                       const SolverOptions& options) {
  return std::make_unique<NewtonHelp>(system, velocity_free, options);
}

} // namespace cairn
