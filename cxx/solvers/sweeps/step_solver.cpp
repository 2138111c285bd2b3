#include "step_solver.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

#include "../../base/call.hpp"
#include "../../contacts/interaction_state.hpp"
#include "../problems/nlgs.hpp"
#include "../problems/ppa_newton.hpp"
#include "error_forecast.hpp"
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
  NewtonHelp(ContactSystem& system, const Field<double>& velocity_free, const SolverOptions& options)
      : system_(system), velocity_free_(velocity_free), options_(options), forecast_(options.tolerance),
        patience_(first_patience()), cost_(of_newton * of_contact * contacts()) {}

  bool pays(int iterations, double error) override {
    constexpr double believed = 4; // times the way that is behind: errors may stand still for a while
    const double to_come = std::min(forecast_.sweeps_to_come(iterations, error), believed * iterations);
    const bool last = iterations >= options_.max_iterations; // rather than fail
    sweeps_ = iterations;
    if (given_up_ || (iterations < patience_ && !last)) return false;
    const auto far = [&] { return last || to_come * sweep_operations() >= 0.5 * cost_; };
    if (!far()) return false;
    if (!asked_) ask();
    return !given_up_ && far();
  }

  bool accepts(int iterations) override {
    constexpr double few_contacts = 5000, few_sweeps = 256;
    if (given_up_ || !heavy_on_light()) return true;
    const double speed = iterations > 0 ? speed_error() : 0;
    const bool urgent = speed > 0.1; // something sinks
    if (speed <= alarm * options_.tolerance || (!urgent && contacts() > few_contacts)) return true;
    if (!asked_) ask();
    return given_up_ || (!urgent && cost_ > few_sweeps * sweep_operations());
  }

  bool improve(const cairn_schedule& schedule, double error, const std::function<double()>& measure) override {
    StepProblem step(system_, schedule, velocity_free_);
    if (system_.couples()) step.form_blocks();
    Array<double> start(step.problem().unknowns());
    step.read(start.data());
    ProblemOptions options = problem_options(options_);
    // as much work as was done before, so that neither way is long gone in vain
    const double operations = cost_ / of_newton, before = sweeps_ * sweep_operations() + newton_operations_;
    options.max_iterations = std::max(least_iterations, int(std::min(before / operations, 1e6)));
    Array<double> r(start);
    ProximalNewton newton(step.problem(), options, r.data());
    if (!heavy_on_light()) newton.settle_failures(1);
    const ProblemReport report = newton.solve();
    newton_operations_ += double(report.iterations) * operations;
    step.write(r.data());
    system_.load(velocity_free_);
    cairn_add_impulses(&schedule);
    const double now = std::sqrt(measure());
    const bool better = now < error || now <= options_.tolerance;
    if (!better) {
      step.write(start.data());
      system_.load(velocity_free_);
      cairn_add_impulses(&schedule);
    }
    if (report.status != ProblemStatus::converged) patience_ *= 8;
    return better;
  }

  const char* name() const override { return "ppa_newton"; }

private:
  // By how much velocities of contacts break the law, weighed by the heavier side, against the change of velocity that
  // impulses gave to bodies; see ProblemMonitor::speed_error.
  double speed_error() const {
    const int d = system_.dim, mass = d == 2 ? 3 : 6;
    const cairn_schedule schedule = system_.schedule(1);
    double wrong = 0, given = 0, u[6 * 128], flat_u[3 * 128], flat_r[3 * 128], mu[128], w_nn[128], speed[128];
    for (std::size_t k = 0; k < system_.batches.size(); ++k) {
      const cairn_batch& b = system_.batches[k];
      if (law_infos()[b.law].has_solve) continue;
      cairn_relative_velocities(&schedule, std::int32_t(k), 0, u);
      for (int lane = 0; lane < b.contacts; ++lane) {
        mu[lane] = at(b, b.params, lane, 0);
        w_nn[lane] = 1 / b.rho[lane];
        for (int c = 0; c < d; ++c) {
          flat_u[d * lane + c] = u[c * b.count + lane] + (b.pack && c > 0 ? 0 : at(b, b.bias, lane, c));
          flat_r[d * lane + c] = at(b, b.r, lane, c);
        }
      }
      cairn_problem_speeds(d, b.contacts, mu, w_nn, flat_r, flat_u, speed);
      for (int lane = 0; lane < b.contacts; ++lane) {
        double heavier = 0;
        const std::int32_t nobody = std::int32_t(system_.bodies); // of a mesh the masses are not asked
        for (const std::int32_t who : {b.mapped_a ? nobody : b.body_a[lane], b.mapped_b ? nobody : b.body_b[lane]})
          if (system_.record[who].x[mass] > 0) heavier = std::max(heavier, 1 / system_.record[who].x[mass]);
        wrong += heavier * speed[lane] * speed[lane];
      }
    }
    for (std::int64_t b = 0; b < system_.bodies; ++b) {
      const double inverse = system_.record[b].x[mass];
      for (int k = 0; k < d && inverse > 0; ++k) {
        const double change = system_.record[b].x[k] - velocity_free_[b][k];
        given += change * change / inverse;
      }
    }
    return wrong > 0 ? std::sqrt(wrong / given) : 0;
  }

  // By masses alone: what touches what is not asked.
  bool heavy_on_light() const {
    constexpr double ratio = 100;
    const int mass = system_.dim == 2 ? 3 : 6;
    double least = std::numeric_limits<double>::infinity(), most = 0;
    for (std::int64_t b = 0; b < system_.bodies; ++b) {
      const double inverse = system_.record[b].x[mass];
      if (!(inverse > 0)) continue;
      least = std::min(least, inverse);
      most = std::max(most, inverse);
    }
    return most > ratio * least;
  }

  // Of few contacts 64 sweeps make the active set, which is exact where masses are alike.
  std::int64_t first_patience() const {
    constexpr double few_unknowns = 256;
    if (heavy_on_light()) return 32;
    return system_.dim * contacts() > few_unknowns ? 16 : 64;
  }

  double contacts() const {
    double sum = 0;
    for (const cairn_batch& b : system_.batches) sum += b.contacts;
    return sum;
  }

  // At the rate of arithmetic in factors, measured: on one core 800 take about as long as a full block in space.
  double sweep_operations() const {
    const double packed = system_.dim == 2 ? 30 : 100, full = system_.dim == 2 ? 100 : 800;
    double sum = 0;
    for (const cairn_batch& b : system_.batches) sum += b.contacts * (b.pack ? packed : full);
    return sum;
  }

  // What Newton's method would cost here; before that, what it costs at least.
  void ask() {
    asked_ = given_up_ = true;
    if (!StepProblem::obstacle(system_).empty() || !has_factorisations()) return;
    const cairn_schedule schedule = system_.schedule(1);
    StepProblem step(system_, schedule, velocity_free_);
    const bool fits = !system_.couples() || step.bytes() <= options_.max_bytes;
    if (system_.couples() && fits) step.form_blocks();
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

  static constexpr double alarm = 64;                        // tolerances: a pile that deep has it by its weight alone
  static constexpr double of_newton = 15, of_contact = 2000; // iterations, operations
  ContactSystem& system_;
  const Field<double>& velocity_free_;
  const SolverOptions& options_;
  ErrorForecast forecast_;
  std::int64_t patience_; // sweeps
  static constexpr int least_iterations = 60;
  int sweeps_ = 0;
  double cost_, newton_operations_ = 0; // expected, done
  bool asked_ = false, given_up_ = false;
};

SolveReport solve_by_problem(ContactSystem& system, const Field<double>& velocity_free, const SolverOptions& options,
                             const ProblemSolverInfo& solver) {
  SolveReport report;
  report.penetration = system.penetration;
  report.solver = solver.name.c_str();
  for (const cairn_batch& b : system.batches) report.contacts += b.contacts;
  system.load(velocity_free);
  if (system.batches.empty()) return report;
  const std::string obstacle = StepProblem::obstacle(system);
  if (!obstacle.empty()) throw Error(obstacle + ": take cairn.NLGS or cairn.Auto instead of " + solver.python_name);
  const cairn_schedule schedule = system.schedule(1);
  const FreeScale free = measure_free(system, schedule);
  StepProblem step(system, schedule, velocity_free);
  Array<double> r(step.problem().unknowns());
  step.read(r.data());
  const bool over_bodies = solver.name == "ppa_newton" && !system.couples();
  const double bytes = over_bodies ? 0 : step.bytes();
  ProblemReport solved;
  if (bytes > options.max_bytes) {
    char hint[160];
    std::snprintf(hint, sizeof hint, "W would take %.2g bytes, memory is %.2g: allow more, or take NLGS", bytes,
                  options.max_bytes);
    solved.hint = hint;
  } else {
    if (!over_bodies) step.form_blocks();
    solved = solve_problem(step.problem(), solver.name, problem_options(options), r.data());
  }
  step.write(r.data());
  system.load(velocity_free);
  cairn_add_impulses(&schedule);
  report.iterations = int(std::min<std::int64_t>(solved.iterations, std::numeric_limits<int>::max()));
  StepError error = measure(system, schedule, free, true, report);
  if (!error.finite || solved.status == ProblemStatus::diverged) report.status = SolveStatus::diverged;
  if (!error.finite) {
    give_none(system, velocity_free);
    error = measure(system, schedule, free, true, report);
  }
  conclude(report, error, options, solved.hint);
  return report;
}

} // namespace

SolveReport solve_step(ContactSystem& system, const Field<double>& velocity_free, const SolverOptions& options) {
  if (options.solver == "nlgs") return solve_nlgs(system, velocity_free, options);
  if (options.solver == "auto") {
    NewtonHelp help(system, velocity_free, options);
    return solve_nlgs(system, velocity_free, options, &help);
  }
  for (const ProblemSolverInfo& row : problem_solvers())
    if (row.name == options.solver) return solve_by_problem(system, velocity_free, options, row);
  throw Error("there is no contact solver '" + options.solver + "'");
}

} // namespace cairn
