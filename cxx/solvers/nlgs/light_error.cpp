// Error on the scale of light bodies, where masses differ: it is a figure of the report, which has to meet the
// tolerance as well.
#include "../sweeps/light_error.hpp"
#include "nlgs_part.hpp"

namespace cairn {

namespace {

class LightBodies final : public NlgsPart {
public:
  explicit LightBodies(NlgsState& s) : s_(s) {}
  Verdict judge(StepError&) override {
    look();
    return Verdict::none;
  }
  void end(StepError&, SolverOptions&) override { look(); }

private:
  void look() { note(measure_light(s_.system, s_.schedule, s_.velocity_free), s_.report); }
  NlgsState& s_;
};

} // namespace

void add_light_error(NlgsState& s, NlgsParts& parts) {
  if (s.uneven) parts.add<LightBodies>(s);
}

} // namespace cairn
