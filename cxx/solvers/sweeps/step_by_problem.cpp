#include "step_by_problem.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>

#include "../../base/call.hpp"
#include "jointed_problem.hpp"
#include "light_error.hpp"
#include "step_error.hpp"
#include "step_problem.hpp"

namespace cairn {

ProblemOptions problem_options(const SolverOptions& options) {
  ProblemOptions o;
  o.tolerance = options.tolerance * (1 - 0x1p-10);
  o.max_iterations = options.max_iterations;
  o.threads = options.threads > 0 ? options.threads : omp_get_max_threads();
  o.warm_start = true;
  o.max_bytes = options.max_bytes;
  return o;
}

namespace {

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

} // namespace

SolveReport solve_by_problem(ContactSystem& system, const Velocities& velocity_free, const SolverOptions& options,
                             const ProblemSolverInfo& solver, std::string* hint_of_solver) {
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
  if (hint_of_solver) *hint_of_solver = solved.hint;
  conclude(report, error, options, solved.hint);
  return report;
}

} // namespace cairn
