// Contact errors on meshes that a converged step may hide, told in its report.
#pragma once
#include <string>

#include "step_scheme.hpp"

namespace cairn {

// Overlaps too deep to be pushed out, and contacts that pass a cell in a step. margins: of contactors [m]; null: they
// are given by the user.
void look_at_meshes(Simulation& s, const StepScheme& step, const double* margins);

// Meshes that begin within each other or within rigid surfaces, looked for once, when they come in.
class NestedMeshLook {
public:
  void look(Simulation& s);

private:
  std::int64_t seen_ = 0, step_ = -1; // ids below which were looked at, in which step
  std::string hint_;
};

} // namespace cairn
