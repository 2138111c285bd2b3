// A frictional contact problem on its own, as files and solvers of the field have it: find r with u = W r + q, and for
// each contact Coulomb's cone with Signorini's condition on u_N. Contact-major, (N, T) or (N, T1, T2) at each contact.
#pragma once
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "../../base/field.hpp"

namespace cairn {

// The bodies under the contacts, where they are known: W = H' A^-1 H.
struct ContactBodies {
  int dofs = 6;                   // of a body: 3 in 2D, 6 in 3D
  std::int64_t count = 0;         // that move
  std::vector<std::int32_t> body; // (2, contacts); -1: does not move
  Array<double> rows;             // (dim, dofs, 2, contacts) H' of each side, its sign in it [-], [m]
  Array<double> mass, inverse;    // (dofs, dofs, count) A [kg], [kg m2] and A^-1
  Array<double> velocity;         // (dofs, count) workspace of products
};

struct FrictionProblem {
  int dim = 3; // components of a contact: 2 or 3
  std::int64_t contacts = 0;
  // W in blocks by rows, columns rising, each diagonal block there; W may be singular and slightly unsymmetric.
  std::vector<std::int64_t> row_start; // (contacts + 1)
  std::vector<std::int32_t> column;    // (blocks)
  Array<double> block;                 // (dim, dim, blocks) [1/kg]: row fastest, as Fortran has it
  Array<double> q;                     // (dim, contacts) [m/s]; a bias of the normal velocity is in it
  Array<double> mu;                    // (contacts) [-]
  // Instead of the blocks beside the diagonal; solvers that say so take it.
  std::shared_ptr<ContactBodies> bodies;
  std::int64_t unknowns() const { return dim * contacts; }
};

enum class ProblemStatus { converged, iteration_limit, time_limit, diverged, stalled, no_solution, memory_limit };

struct ProblemOptions {
  double tolerance = 1e-8; // on the true error: natural map in the energy norm, no units
  int max_iterations = 10000;
  double max_seconds = std::numeric_limits<double>::infinity(); // of CPU time
  int threads = 1;
  std::uint64_t seed = 0;            // of solvers that draw an order
  double relaxation = 1;             // of sweeps, (0, 2)
  bool warm_start = false;           // begin from the r that was given
  std::function<bool()> interrupted; // asked now and then; may be empty
  double max_bytes = 4e9;            // that factors may take
};

struct ProblemReport {
  ProblemStatus status = ProblemStatus::iteration_limit;
  std::string solver; // that gave the answer: `auto` names its last choice
  std::string hint;   // empty when converged
  std::int64_t iterations = 0;
  double error = 0;       // true error of the r that is given back: the best seen
  double worst_error = 0; // of one contact, on its own scale
  std::int64_t worst_contact = -1;
  double penetration_rate = 0; // largest -u_N / largest |q| of a contact
  double cone_distance = 0;    // distance of impulses outside the cone / impulse
  double energy_created = 0;   // max(0, sum of r.u over contacts that gave energy) / energy in play
  double cpu_seconds = 0;
  // Changes of velocity of bodies (dofs, bodies) that r makes, where a solver has them to more digits than r gives:
  // under heavy bodies; else empty.
  Array<double> velocity;
};

// r (dim, contacts) [N s], in and out. Throws Error when sizes do not agree or a number is not finite.
using ProblemSolver = ProblemReport(const FrictionProblem&, const ProblemOptions&, double* r);

struct ProblemSolverInfo {
  std::string name, python_name, summary;
  std::function<ProblemSolver> solve;
};
// `auto`, and rows of solvers.def that solve problems, each by a driver ProblemReport solve_<name>(...) in this folder.
const std::vector<ProblemSolverInfo>& problem_solvers();
// Adds a solver, or replaces that of the same name if it was added too. Throws Error for the name of a built-in one.
void register_problem_solver(ProblemSolverInfo solver);
ProblemReport solve_problem(const FrictionProblem&, const std::string& solver, const ProblemOptions&, double* r);
// Error and figures of r (dim, contacts), which nobody solved for.
ProblemReport measure_problem(const FrictionProblem&, const double* r);

} // namespace cairn
