// The other solver, asked where it pays, and where light bodies err by more than the error of the whole tells.
#include <cmath>

#include "../sweeps/light_error.hpp"
#include "nlgs_part.hpp"

namespace cairn {

namespace {

class OtherSolver final : public NlgsPart {
public:
  explicit OtherSolver(NlgsState& s) : s_(s) {}

  void measured(StepError& error) override {
    if (!s_.help_waits && s_.above(error) && s_.help->pays(s_.report.iterations, std::sqrt(error.square)))
      error = ask(std::sqrt(error.square));
  }

  Verdict judge(StepError& error) override {
    if (s_.help->accepts(s_.report.iterations, s_.report.light_error)) return Verdict::none;
    error = ask(s_.options.tolerance);
    if (s_.uneven) note(measure_light(s_.system, s_.schedule, s_.velocity_free), s_.report);
    return Verdict::none;
  }

private:
  StepError ask(double error) {
    if (s_.help->improve(s_.schedule, error, s_.error_square)) s_.report.solver = s_.help->name();
    s_.changed = true;
    return s_.measure();
  }
  NlgsState& s_;
};

} // namespace

void add_other_solver(NlgsState& s, NlgsParts& parts) {
  if (s.help) parts.add<OtherSolver>(s);
}

} // namespace cairn
