// Reports of problems rest on the true error, not on the solver's own claim.
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "solvers/problems/block_factors.hpp"
#include "solvers/problems/friction_problem.hpp"
#include "solvers/problems/ppa_newton.hpp"

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

// Contacts of a few bodies: W = H'H has far fewer ranks than rows, so that many rounds are needed.
FrictionProblem crowded(int contacts, int dofs) {
  std::mt19937_64 random(7);
  const auto draw = [&] { return double(random() >> 11) / double(1ULL << 52) - 1; };
  FrictionProblem p;
  p.contacts = contacts;
  const int n = 3 * contacts;
  std::vector<double> h(std::size_t(dofs) * n), v(dofs);
  for (double& x : h) x = draw();
  for (double& x : v) x = draw();
  p.block.resize(std::size_t(n) * n);
  p.q.resize(n);
  p.mu.assign(contacts, 0.3);
  p.row_start = {0};
  for (int a = 0; a < contacts; ++a) {
    for (int b = 0; b < contacts; ++b) {
      p.column.push_back(b);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          double sum = 0;
          for (int k = 0; k < dofs; ++k) sum += h[k * n + 3 * a + i] * h[k * n + 3 * b + j];
          p.block[9 * (std::size_t(contacts) * a + b) + i + 3 * j] = sum;
        }
    }
    p.row_start.push_back(std::int64_t(p.column.size()));
    for (int i = 0; i < 3; ++i) {
      double sum = 0;
      for (int k = 0; k < dofs; ++k) sum += h[k * n + 3 * a + i] * v[k];
      p.q[3 * a + i] = sum;
    }
  }
  return p;
}

TEST(ProblemReports, NewtonInTurnsIsTheSameAsInOne) {
  if (!has_factorisations()) GTEST_SKIP() << "no SuiteSparse in this build";
  const FrictionProblem p = crowded(40, 30);
  ProblemOptions options;
  options.tolerance = 1e-10;
  std::vector<double> whole(p.unknowns()), parts(p.unknowns());
  const ProblemReport once = ProximalNewton(p, options, whole.data()).solve();
  ASSERT_EQ(once.status, ProblemStatus::converged) << once.hint;
  ASSERT_GT(once.iterations, 8);
  ProximalNewton newton(p, options, parts.data());
  ProblemReport turn;
  int turns = 0;
  do {
    turn = newton.turn(1, 1000);
    ++turns;
  } while (turn.status == ProblemStatus::iteration_limit && turns < 1000);
  EXPECT_GT(turns, 2);
  EXPECT_EQ(turn.status, ProblemStatus::converged);
  EXPECT_EQ(turn.iterations, once.iterations);
  EXPECT_EQ(parts, whole);
}

} // namespace
} // namespace cairn::test
