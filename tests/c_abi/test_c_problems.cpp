// Frictional contact problems through the C API and through the Fortran module.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "cairn/cairn.h"

extern "C" void cairn_fortran_problem(double* found, int32_t* status, int32_t* wrong);

namespace {

// Two contacts of a mass of 2 kg, coupled: the first slides, the second opens.
struct Two {
  std::vector<int64_t> row_start{0, 2, 4};
  std::vector<int32_t> column{0, 1, 0, 1};
  std::vector<double> block{0.5, 0, 0, 0.5, 0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.5, 0, 0, 0.5}, q{-1, 2, 3, 0}, mu{0.3, 0.4};
  cairn_problem* problem = nullptr;
  cairn_error error{};
  int32_t create() {
    return cairn_problem_create(2, 2, row_start.data(), column.data(), block.data(), q.data(), mu.data(), &problem,
                                &error);
  }
  ~Two() { cairn_problem_destroy(problem); }
};

TEST(CProblem, IsSolvedByEachName) {
  Two two;
  ASSERT_EQ(two.create(), 0) << two.error.message;
  EXPECT_EQ(cairn_problem_dimension(two.problem), 2);
  EXPECT_EQ(cairn_problem_contacts(two.problem), 2);
  for (const char* solver : {"nlgs", "auto", "ppa_newton", "lemke"}) {
    double r[4];
    cairn_problem_report report;
    ASSERT_EQ(cairn_problem_solve(two.problem, solver, 1e-12, 10000, 0, r, &report, &two.error), 0)
        << two.error.message;
    EXPECT_EQ(report.status, cairn_problem_converged) << solver << ' ' << report.hint;
    EXPECT_LT(report.error, 1e-12);
    EXPECT_NEAR(r[0], 2, 1e-10) << solver; // u_N = 0
    EXPECT_NEAR(r[1], -0.6, 1e-10);        // slides along +t
    EXPECT_NEAR(r[2], 0, 1e-12);
    EXPECT_NEAR(r[3], 0, 1e-12);
    cairn_problem_report again;
    ASSERT_EQ(cairn_problem_measure(two.problem, r, &again, &two.error), 0) << two.error.message;
    EXPECT_NEAR(again.error, report.error, 1e-13);
    const double wrong[] = {2, 0.6, 0, 0};
    ASSERT_EQ(cairn_problem_measure(two.problem, wrong, &again, &two.error), 0);
    EXPECT_GT(again.error, 1e-2);
  }
}

TEST(CProblem, TellsWhatIsWrong) {
  const auto message = [](Two& two, const char* solver, double tolerance) {
    EXPECT_EQ(two.create(), 0);
    double r[4];
    EXPECT_EQ(cairn_problem_solve(two.problem, solver, tolerance, 100, 0, r, nullptr, &two.error), cairn_wrong_input);
    return std::string(two.error.message);
  };
  Two name, tolerance, sign, order;
  EXPECT_NE(message(name, "nlgz", 1e-8).find("nlgz"), std::string::npos);
  EXPECT_NE(message(tolerance, "nlgs", 2).find("tol is 2"), std::string::npos);
  sign.mu[1] = -1;
  EXPECT_NE(message(sign, "nlgs", 1e-8).find("mu of contact 1 is -1"), std::string::npos);
  order.column = {0, 7, 0, 1};
  EXPECT_NE(message(order, "nlgs", 1e-8).find("row 0 of W has column 7"), std::string::npos);
  Two flat;
  EXPECT_EQ(cairn_problem_create(4, 2, flat.row_start.data(), flat.column.data(), flat.block.data(), flat.q.data(),
                                 flat.mu.data(), &flat.problem, &flat.error),
            cairn_wrong_input);
  EXPECT_STREQ(flat.error.message, "dim is 4: give 2 or 3");
  EXPECT_EQ(cairn_problem_read("no such file.hdf5", &flat.problem, &flat.error), cairn_file_error);
  EXPECT_EQ(flat.problem, nullptr);
}

TEST(CProblem, IsSolvedFromFortran) {
  double found[4];
  int32_t status = -1, wrong = -1;
  cairn_fortran_problem(found, &status, &wrong);
  EXPECT_EQ(status, 0);
  EXPECT_NEAR(found[0], 2, 1e-10);
  EXPECT_NEAR(found[1], -0.6, 1e-10);
  EXPECT_NEAR(found[2], 0, 1e-12);
  EXPECT_EQ(wrong, 1); // a solver that is none
}

} // namespace
