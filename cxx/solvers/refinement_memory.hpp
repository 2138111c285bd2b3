// Memory of the iterative refinement of solids of bonds, kept over a run.
#pragma once

namespace cairn {

// Memory of refinements of bonded solids over the steps of a run: see SolidCorrection::refine.
struct RefinementMemory {
  double amplification = 0;   // of errors, in velocities; 0: not known; infinity: it was not found
  double share = 0;           // by which passes gave way; 0: not known
  int failures = 0, idle = 0; // refinements in a row that came to nothing; steps until the next
};

// Count of the solutions to rounding that steps at rest asked for: see solvers/nlgs/rest.cpp.
struct RestMemory {
  int attempts = 0, idle = 0; // in a row after which the next steps were not at rest; steps until the next
};

} // namespace cairn
