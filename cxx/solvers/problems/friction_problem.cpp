#include "friction_problem.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "../../base/call.hpp"
#include "block_factors.hpp"
#include "problem_monitor.hpp"

namespace cairn {

#define CAIRN_OF_PROBLEMS_0(...)
#define CAIRN_OF_PROBLEMS_1(...) __VA_ARGS__
#define CAIRN_SOLVER(name, python, summary, problems) CAIRN_OF_PROBLEMS_##problems(ProblemSolver solve_##name;)
#include "../../../core_f90/solvers/solvers.def"
#undef CAIRN_SOLVER

ProblemSolver solve_auto;

namespace {

std::vector<ProblemSolverInfo>& solver_rows() {
  static std::vector<ProblemSolverInfo> rows = {
      {"auto", "Auto", "chooses and switches by what it measures", solve_auto},
#define CAIRN_SOLVER(name, python, summary, problems)                                                                  \
  CAIRN_OF_PROBLEMS_##problems({#name, #python, summary, solve_##name}, )
#include "../../../core_f90/solvers/solvers.def"
#undef CAIRN_SOLVER
  };
  return rows;
}

const std::size_t built_in = solver_rows().size();

} // namespace

const std::vector<ProblemSolverInfo>& problem_solvers() { return solver_rows(); }

void register_problem_solver(ProblemSolverInfo solver) {
  std::vector<ProblemSolverInfo>& rows = solver_rows();
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (rows[k].name != solver.name) continue;
    if (k < built_in) throw Error("there is a built-in solver '" + solver.name + "': give another name");
    rows[k] = std::move(solver);
    return;
  }
  rows.push_back(std::move(solver));
}

namespace {

[[noreturn]] void refuse(const std::string& what) { throw Error(what); }

void check_size(const char* name, std::size_t has, std::int64_t needs, const char* shape) {
  if (has != std::size_t(needs))
    refuse(std::string(name) + " holds " + std::to_string(has) + " numbers: " + shape + " needs " +
           std::to_string(needs));
}

void check_finite(const char* name, const Array<double>& values, int per_item, const char* item) {
  double sum = 0; // x - x is 0 unless x is infinite or no number
  const std::size_t n = values.size();
  const double* x = values.data();
#pragma omp simd reduction(+ : sum)
  for (std::size_t i = 0; i < n; ++i) sum += x[i] - x[i];
  if (sum == 0) return;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i]))
      refuse(std::string(name) + " of " + item + " " + std::to_string(i / per_item) + " is " +
             std::to_string(values[i]) + ": give finite numbers");
}

void check_blocks(const FrictionProblem& p) {
  if (p.row_start.front() != 0) refuse("row_start begins with " + std::to_string(p.row_start.front()) + ": give 0");
  for (std::int64_t a = 0; a < p.contacts; ++a) {
    const auto row = [&] { return "row " + std::to_string(a) + " of W "; };
    if (p.row_start[a + 1] < p.row_start[a] || p.row_start[a + 1] > std::int64_t(p.column.size()))
      refuse(row() + "ends at block " + std::to_string(p.row_start[a + 1]) + ": row_start must rise to " +
             std::to_string(p.column.size()));
    bool diagonal = false;
    for (std::int64_t k = p.row_start[a]; k < p.row_start[a + 1]; ++k) {
      const std::int32_t b = p.column[k];
      if (b < 0 || b >= p.contacts)
        refuse(row() + "has column " + std::to_string(b) + ": columns are 0 to " + std::to_string(p.contacts - 1));
      if (k > p.row_start[a] && b <= p.column[k - 1])
        refuse(row() + "has column " + std::to_string(b) + " after " + std::to_string(p.column[k - 1]) +
               ": columns must rise");
      if (b != a) continue;
      diagonal = true;
      const double w = p.block[p.dim * p.dim * k];
      if (!(w > 0))
        refuse("W_NN of contact " + std::to_string(a) + " is " + std::to_string(w) +
               ": it must be positive; leave out contacts between bodies that cannot move");
    }
    if (!diagonal) refuse(row() + "has no diagonal block: W_NN must be positive");
  }
}

void check(const FrictionProblem& p, const ProblemOptions& o) {
  if (p.dim != 2 && p.dim != 3) refuse("dim is " + std::to_string(p.dim) + ": give 2 or 3");
  if (p.contacts < 0) refuse("contacts is " + std::to_string(p.contacts) + ": give 0 or more");
  check_size("row_start", p.row_start.size(), p.contacts + 1, "contacts + 1");
  check_size("column", p.column.size(), p.row_start.back(), "the end of row_start");
  check_size("block", p.block.size(), p.dim * p.dim * std::int64_t(p.column.size()), "dim x dim for each block");
  check_size("q", p.q.size(), p.unknowns(), "dim for each contact");
  check_size("mu", p.mu.size(), p.contacts, "one for each contact");
  check_finite("q", p.q, p.dim, "contact");
  check_finite("mu", p.mu, 1, "contact");
  check_finite("W", p.block, p.dim * p.dim, "block");
  for (std::int64_t a = 0; a < p.contacts; ++a)
    if (p.mu[a] < 0)
      refuse("mu of contact " + std::to_string(a) + " is " + std::to_string(p.mu[a]) + ": give 0 or more");
  check_blocks(p);
  if (!(o.tolerance > 0 && o.tolerance < 1))
    refuse("tol is " + std::to_string(o.tolerance) + ": give a number between 0 and 1; 1e-8 is exact");
  if (o.max_iterations < 1) refuse("max_iterations is " + std::to_string(o.max_iterations) + ": give 1 or more");
  if (!(o.max_bytes > 0)) refuse("memory is " + std::to_string(o.max_bytes) + ": give a positive number of bytes");
  if (!(o.max_seconds > 0)) refuse("max_seconds is " + std::to_string(o.max_seconds) + ": give a positive number");
  if (o.threads < 1) refuse("threads is " + std::to_string(o.threads) + ": give 1 or more");
  if (!(o.relaxation > 0 && o.relaxation < 2))
    refuse("relaxation is " + std::to_string(o.relaxation) + ": give a number in (0, 2); 1 is none");
}

// Report of a solve without memory for factors, with the figures of its start.
ProblemReport without_memory(const FrictionProblem& problem, const ProblemOptions& options, const std::string& solver,
                             double bytes, const Array<double>& start, double* r) {
  std::copy(start.begin(), start.end(), r);
  ProblemMonitor monitor(problem, options, r);
  monitor.start_error();
  char hint[160];
  std::snprintf(hint, sizeof hint, "factors would take %.2g bytes, memory is %.2g: allow more, or take nlgs_anderson",
                bytes, options.max_bytes);
  monitor.give_up(ProblemStatus::memory_limit, hint);
  return monitor.finish(solver, 0);
}

} // namespace

ProblemReport solve_problem(const FrictionProblem& problem, const std::string& solver, const ProblemOptions& options,
                            double* r) {
  const double begin = cpu_seconds();
  check(problem, options);
  if (options.warm_start)
    for (std::int64_t i = 0; i < problem.unknowns(); ++i)
      if (!std::isfinite(r[i]))
        refuse("r of contact " + std::to_string(i / problem.dim) + " is " + std::to_string(r[i]) +
               ": begin from finite impulses");
  if (problem.contacts == 0) {
    ProblemReport report;
    report.status = ProblemStatus::converged;
    report.solver = solver;
    return report;
  }
  std::string known;
  const Array<double> start(r, r + (options.warm_start ? problem.unknowns() : 0));
  for (const ProblemSolverInfo& row : problem_solvers()) {
    if (row.name == solver || row.python_name == solver) {
      ProblemReport report;
      try {
        report = row.solve(problem, options, r);
      } catch (const FactorsTooLarge& factors) {
        report = without_memory(problem, options, row.name, factors.bytes, start, r);
      }
      if (report.status == ProblemStatus::converged && !(report.error <= options.tolerance)) {
        report.status = ProblemStatus::stalled; // whatever the solver says of itself
        report.hint = "the true error is above tol, though the solver ended: take another one";
      }
      report.cpu_seconds = cpu_seconds() - begin;
      return report;
    }
    known += (known.empty() ? "" : ", ") + row.name;
  }
  refuse("there is no solver of problems '" + solver + "': give one of " + known);
}

ProblemReport measure_problem(const FrictionProblem& problem, const double* r) {
  ProblemOptions options;
  options.warm_start = true;
  check(problem, options);
  Array<double> copy(r, r + problem.unknowns());
  ProblemMonitor monitor(problem, options, copy.data());
  monitor.error_of(copy.data());
  return monitor.finish("", 0);
}

} // namespace cairn
