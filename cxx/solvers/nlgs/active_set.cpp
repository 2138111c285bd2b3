// Newton's method on the active set of few contacts: tried after 64 sweeps and whenever their number has grown
// fourfold, and to rounding where contacts are at rest.
#include "../sweeps/active_set.hpp"

#include <algorithm>

#include "../policy.hpp"
#include "nlgs_part.hpp"

namespace cairn {

namespace {

class FewContacts final : public NlgsPart {
public:
  explicit FewContacts(NlgsState& s)
      : s_(s), newton_(s.system, s.schedule, s.velocity_free, [this] { return square(); }) {}

  void measured(StepError& error) override {
    if (!s_.above(error) || s_.report.iterations < next_) return;
    improve(error, s_.wanted, s_.help && !s_.help->given_up() ? s_.help->few_unknowns() : ActiveSet::most_unknowns);
    s_.changed = true;
    error = s_.measure();
    next_ = policy().active_set_again * s_.report.iterations;
  }

  // Small systems at rest are solved to rounding, unless their error counts as rest: where contacts are redundant, the
  // last digits are out of reach, and each step would try anew.
  Verdict judge(StepError& error) override {
    constexpr double rounding = 0x1p-80; // the square of an error that only rounding is left of
    const double least = policy().rest_least * policy().rest_least;
    if (s_.help && !s_.uneven && s_.report.contacts <= policy().settled_unknowns && error.square > least &&
        near_rest(s_))
      improve(error, rounding, policy().settled_unknowns);
    return Verdict::none;
  }

private:
  void improve(const StepError& error, double wanted, int most) {
    growth_ = std::max(1.0, error.growth);
    newton_.improve(error.square, wanted, most);
  }

  // Square of the error of the impulses at hand, relative to those at the start if these were smaller. Sticking
  // contacts of wedged bodies carry impulses that balance each other. Where the matrix is nearly singular, Newton's
  // method adds millions of times the weight of such impulses; relative to these, any error would be small.
  double square() const {
    const StepError error = s_.measure();
    return error.square * std::max(1.0, error.growth / growth_);
  }

  NlgsState& s_;
  ActiveSet newton_;
  double growth_ = 1;                    // of the impulses at the start, see StepError
  int next_ = policy().active_set_first; // sweeps
};

} // namespace

void add_active_set(NlgsState& s, NlgsParts& parts) {
  if (!s.system.cell) parts.add<FewContacts>(s);
}

} // namespace cairn
