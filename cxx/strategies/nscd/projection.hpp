// Overlap removed without changing a velocity: by the contact solver itself, and the part beyond a limit by
// displacements alone.
#pragma once
#include <optional>

#include "nscd_options.hpp"
#include "search_margins.hpp"
#include "step_scheme.hpp"

namespace cairn {

// The smallest displacement in the metric of mass that opens every gap (Acary 2013).
class OverlapProjection {
public:
  void project(Simulation& s, const NscdOptions& settings, const StepScheme& step, SearchMargins& margins);
  // Impulses with which the next one begins; none, where there was no projection.
  ContactMemory memory() const;
  void restore(const Simulation& s, const ContactMemory& memory);
  // f(memory): the memory by which it is replaced, where there is one.
  template <class F>
  void replace_memory(F&& f) {
    if (interactions_) interactions_->restore(f(interactions_->memory()));
  }

private:
  const LawTable& laws(const Simulation& s);
  std::optional<Interactions> interactions_;
  Candidates candidates_;
  std::optional<LawTable> laws_;
  Array<double> reaction_;
};

// Overlap beyond a limit, taken back after the step; nothing to do after most steps.
class OverlapParting {
public:
  void part(Simulation& s, const SolverOptions& solver, double h);

private:
  Array<double> velocity_; // that takes it back in a step
};

} // namespace cairn
