// Settings of the contact solver of a step.
#pragma once
#include <limits>
#include <string>

namespace cairn {

struct SolverOptions {
  double tolerance; // on the true error (DESIGN, section 5)
  int min_iterations;
  int max_iterations;
  int threads;                 // 0: as OpenMP decides
  std::string solver = "nlgs"; // in steps: nlgs, auto, or a solver of problems (friction_problem.hpp)
  // On the velocities that impulses leave, see VelocityError; infinity: not asked for.
  double accuracy = std::numeric_limits<double>::infinity();
  bool extrapolates = true;      // sweeps begin beyond the last one: see Extrapolation
  bool associated_start = false; // see AssociatedStart
  // The same problem but for its biases was solved just now, and the step begins with its impulses: 1, or 2 where
  // Newton's method over bodies found them.
  int again = 0;
  int done = 0; // sweeps of this problem that led to the impulses at hand; max_iterations counts them
  double softening_relaxation = 1; // share of its change that a bond which softens takes in a sweep
  double max_bytes = 1e9;          // of factors, and of W where a solver takes it in blocks
  // Error that ends a step of a dense pack which has taken `patience` sweeps, where it is above the tolerance.
  double enough = 0;
  int patience = 0;
};

} // namespace cairn
