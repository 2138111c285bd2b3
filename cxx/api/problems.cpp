// The C API of frictional contact problems (cairn/problems.h).
#include "../files/problem_reader.hpp"
#include "objects.hpp"

struct cairn_problem {
  cairn::FrictionProblem problem;
};

using namespace cairn::api;

namespace {

static_assert(int(cairn::ProblemStatus::memory_limit) == cairn_problem_memory_limit, "as problems.h numbers them");

void tell(const cairn::ProblemReport& from, cairn_problem_report& to) {
  to = cairn_problem_report{};
  to.status = std::int32_t(from.status);
  to.iterations = from.iterations;
  to.worst_contact = from.worst_contact;
  to.error = from.error;
  to.worst_error = from.worst_error;
  to.penetration_rate = from.penetration_rate;
  to.cone_distance = from.cone_distance;
  to.energy_created = from.energy_created;
  to.cpu_seconds = from.cpu_seconds;
  std::snprintf(to.solver, sizeof to.solver, "%s", from.solver.c_str());
  std::snprintf(to.hint, sizeof to.hint, "%s", from.hint.c_str());
}

} // namespace

extern "C" {

int32_t cairn_problem_create(int32_t dim, int64_t n, const int64_t* row_start, const int32_t* column,
                             const double* block, const double* q, const double* mu, cairn_problem** problem,
                             cairn_error* error) {
  return guarded(error, [&] {
    require(problem, "problem");
    require(row_start, "row_start");
    if (dim != 2 && dim != 3) throw cairn::Error("dim is " + std::to_string(dim) + ": give 2 or 3");
    counted(n);
    const std::int64_t blocks = row_start[n];
    if (blocks < 0)
      throw cairn::Error("row_start[" + std::to_string(n) + "] is " + std::to_string(blocks) +
                         ": give the number of blocks");
    if (n > 0) {
      require(column, "column");
      require(block, "block");
      require(q, "q");
      require(mu, "mu");
    }
    auto made = std::make_unique<cairn_problem>();
    cairn::FrictionProblem& p = made->problem;
    p.dim = dim;
    p.contacts = n;
    p.row_start.assign(row_start, row_start + n + 1);
    p.column.assign(column, column + blocks);
    p.block.assign(block, block + dim * dim * blocks);
    p.q.assign(q, q + dim * n);
    p.mu.assign(mu, mu + n);
    *problem = made.release();
  });
}

int32_t cairn_problem_read(const char* path, cairn_problem** problem, cairn_error* error) {
  return guarded(error, [&] {
    require(path, "path");
    require(problem, "problem");
    *problem = new cairn_problem{cairn::read_problem(path)};
  });
}

void cairn_problem_destroy(cairn_problem* problem) { delete problem; }

int32_t cairn_problem_dimension(const cairn_problem* problem) { return problem ? problem->problem.dim : 0; }

int64_t cairn_problem_contacts(const cairn_problem* problem) { return problem ? problem->problem.contacts : 0; }

int32_t cairn_problem_solve(const cairn_problem* problem, const char* solver, double tolerance, int32_t max_iterations,
                            int32_t warm_start, double* impulse, cairn_problem_report* report, cairn_error* error) {
  return guarded(error, [&] {
    require(problem, "problem");
    require(solver, "solver");
    if (problem->problem.contacts > 0) require(impulse, "impulse");
    cairn::ProblemOptions options;
    options.tolerance = tolerance;
    options.max_iterations = max_iterations;
    options.warm_start = warm_start != 0;
    const cairn::ProblemReport found = cairn::solve_problem(problem->problem, solver, options, impulse);
    if (report) tell(found, *report);
  });
}

int32_t cairn_problem_measure(const cairn_problem* problem, const double* impulse, cairn_problem_report* report,
                              cairn_error* error) {
  return guarded(error, [&] {
    require(problem, "problem");
    require(report, "report");
    if (problem->problem.contacts > 0) require(impulse, "impulse");
    tell(cairn::measure_problem(problem->problem, impulse), *report);
  });
}

} // extern "C"
