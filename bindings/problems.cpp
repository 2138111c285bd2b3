#include "arrays.hpp"
#include "files/problem_reader.hpp"
#include "solvers/problems/friction_problem.hpp"

namespace {

using cairn::FrictionProblem;
using cairn::ProblemReport;

const char* name_of(cairn::ProblemStatus status) {
  switch (status) {
  case cairn::ProblemStatus::converged: return "converged";
  case cairn::ProblemStatus::iteration_limit: return "iteration limit";
  case cairn::ProblemStatus::time_limit: return "time limit";
  case cairn::ProblemStatus::diverged: return "diverged";
  case cairn::ProblemStatus::stalled: return "stalled";
  case cairn::ProblemStatus::no_solution: return "no solution";
  case cairn::ProblemStatus::memory_limit: return "memory limit";
  }
  return "";
}

// data (blocks, dim, dim), rows of a block contiguous, as scipy has it
FrictionProblem make(int dim, Input<std::int64_t> row_start, Input<std::int32_t> column, Input<double> data,
                     Input<double> q, Input<double> mu) {
  FrictionProblem p;
  p.dim = dim;
  p.contacts = mu.size();
  p.row_start.assign(row_start.data(), row_start.data() + row_start.size());
  p.column.assign(column.data(), column.data() + column.size());
  p.block.resize(data.size());
  const double* from = data.data();
  const std::int64_t blocks = data.size() / (dim * dim);
  for (std::int64_t k = 0; k < blocks; ++k)
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j) p.block[(k * dim + j) * dim + i] = from[(k * dim + i) * dim + j];
  p.q.assign(q.data(), q.data() + q.size());
  p.mu.assign(mu.data(), mu.data() + mu.size());
  return p;
}

py::dict to_dict(const ProblemReport& report) {
  py::dict d;
  d["status"] = name_of(report.status);
  d["solver"] = report.solver;
  d["hint"] = report.hint;
  d["iterations"] = report.iterations;
  d["error"] = report.error;
  d["worst_error"] = report.worst_error;
  d["worst_contact"] = report.worst_contact;
  d["penetration_rate"] = report.penetration_rate;
  d["cone_distance"] = report.cone_distance;
  d["energy_created"] = report.energy_created;
  d["cpu_seconds"] = report.cpu_seconds;
  return d;
}

void check_impulses(const FrictionProblem& p, const py::array_t<double>& r) {
  if (r.size() != p.unknowns())
    throw cairn::Error("r holds " + std::to_string(r.size()) + " numbers: " + std::to_string(p.contacts) +
                       " contacts in " + std::to_string(p.dim) + "D need " + std::to_string(p.unknowns()));
}

} // namespace

void bind_problems(py::module_& m) {
  py::class_<FrictionProblem>(m, "FrictionProblem")
      .def(py::init(&make), py::arg("dim"), py::arg("row_start"), py::arg("column"), py::arg("data"), py::arg("q"),
           py::arg("mu"))
      .def_static("read", &cairn::read_problem) // as programs in C and Fortran read it
      .def_readonly("dim", &FrictionProblem::dim)
      .def_readonly("contacts", &FrictionProblem::contacts)
      .def("solve",
           [](const FrictionProblem& p, const std::string& solver, py::array_t<double, py::array::c_style> r,
              double tol, int max_iter, double max_seconds, int threads, std::uint64_t seed, double relaxation,
              bool warm_start, double memory) {
             check_impulses(p, r);
             cairn::ProblemOptions options{tol,        max_iter,   max_seconds, threads, seed,
                                           relaxation, warm_start, {},          memory};
             options.interrupted = [] {
               py::gil_scoped_acquire acquire;
               return PyErr_CheckSignals() != 0;
             };
             double* impulses = r.mutable_data();
             ProblemReport report;
             {
               py::gil_scoped_release release;
               report = solve_problem(p, solver, options, impulses);
             }
             if (PyErr_Occurred()) throw py::error_already_set();
             return to_dict(report);
           })
      .def("measure", [](const FrictionProblem& p, py::array_t<double, py::array::c_style | py::array::forcecast> r) {
        check_impulses(p, r);
        return to_dict(cairn::measure_problem(p, r.data()));
      });
  m.def("problem_solvers", [] {
    py::list rows;
    for (const cairn::ProblemSolverInfo& s : cairn::problem_solvers())
      rows.append(py::make_tuple(s.name, s.python_name, s.summary));
    return rows;
  });
}
