// Newton's method on the active set of few contacts: tried after 64 sweeps and whenever their number has grown
// fourfold, and to rounding where contacts are at rest.
#include "../sweeps/active_set.hpp"
#include "../policy.hpp"
#include "nlgs_part.hpp"

namespace cairn {

namespace {

class FewContacts final : public NlgsPart {
public:
  explicit FewContacts(NlgsState& s) : s_(s), newton_(s.system, s.schedule, s.velocity_free, s.error_square) {}

  void measured(StepError& error) override {
    if (!s_.above(error) || s_.report.iterations < next_) return;
    newton_.improve(error.square, s_.wanted,
                    s_.help && !s_.help->given_up() ? s_.help->few_unknowns() : ActiveSet::most_unknowns);
    s_.changed = true;
    error = s_.measure();
    next_ = policy().active_set_again * s_.report.iterations;
  }

  // Small systems at rest are solved to rounding.
  Verdict judge(StepError& error) override {
    constexpr double rounding = 0x1p-80; // the square of an error that only rounding is left of
    if (s_.help && !s_.uneven && s_.report.contacts <= policy().settled_unknowns && error.square > rounding &&
        near_rest(s_))
      newton_.improve(error.square, rounding, policy().settled_unknowns);
    return Verdict::none;
  }

private:
  NlgsState& s_;
  ActiveSet newton_;
  int next_ = policy().active_set_first; // sweeps
};

} // namespace

void add_active_set(NlgsState& s, NlgsParts& parts) {
  if (!s.system.cell) parts.add<FewContacts>(s);
}

} // namespace cairn
