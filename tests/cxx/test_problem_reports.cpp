// What reports of problems say, whatever a solver says of itself.
#include <gtest/gtest.h>

#include <limits>

#include "solvers/problems/friction_problem.hpp"

namespace cairn::test {
namespace {

TEST(ProblemReports, ConvergedOnlyWithinTheTolerance) {
  static double error = 0; // rows of solvers stay
  register_problem_solver({"boaster", "Boaster", "", [](const FrictionProblem&, const ProblemOptions&, double*) {
                             ProblemReport report;
                             report.status = ProblemStatus::converged;
                             report.error = error;
                             return report;
                           }});
  FrictionProblem p;
  p.dim = 2;
  p.contacts = 1;
  p.row_start = {0, 1};
  p.column = {0};
  p.block = {1, 0, 0, 1};
  p.q = {-1, 0};
  p.mu = {0.5};
  ProblemOptions options;
  options.tolerance = 1e-3;
  double r[2] = {0, 0};
  for (const double within : {0.0, 1e-3}) {
    error = within;
    EXPECT_EQ(solve_problem(p, "boaster", options, r).status, ProblemStatus::converged);
  }
  for (const double beyond : {1.0001e-3, std::numeric_limits<double>::quiet_NaN()}) {
    error = beyond;
    const ProblemReport report = solve_problem(p, "boaster", options, r);
    EXPECT_EQ(report.status, ProblemStatus::stalled);
    EXPECT_FALSE(report.hint.empty());
  }
}

} // namespace
} // namespace cairn::test
