// Refinement of velocities by the other solver, where they may err by much more than impulses.
#include "nlgs_part.hpp"

namespace cairn {

namespace {

class RefinedVelocities final : public NlgsPart {
public:
  explicit RefinedVelocities(NlgsState& s) : s_(s) {}

  Verdict judge(StepError& error) override {
    if (!(error.square <= s_.wanted) || !s_.help->refines(s_.report.iterations, s_.report.error)) return Verdict::none;
    s_.refinement = s_.help->refine(s_.report.error, s_.error_square);
    error = s_.measure();
    return Verdict::none;
  }

  // Velocities that did not settle are not as exact as impulses, which the report then says.
  void end(StepError&, SolverOptions& asked) override {
    if (!(s_.refinement.change > 0) || s_.refinement.known || s_.asks_for_accuracy()) return;
    s_.report.velocity_error = s_.refinement.change;
    asked.accuracy = s_.options.tolerance;
  }

private:
  NlgsState& s_;
};

} // namespace

void add_refinement(NlgsState& s, NlgsParts& parts) {
  if (s.help) parts.add<RefinedVelocities>(s);
}

} // namespace cairn
