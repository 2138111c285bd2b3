// Where it is asked for, sweeps from nothing begin with associated friction, by which slip opens a contact: that is a
// convex problem, and where a pile can stand its solution stands, which is one of Coulomb's law too. Sweeps of
// Coulomb's law from nothing let grains fall that could lean on each other, and end where these slide, at errors that
// fall slowly. It is no default: of several solutions it takes one at the edge of sliding, from which later steps are
// harder and results hang on the tolerance.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../policy.hpp"
#include "../sweeps/start_work.hpp"
#include "nlgs_part.hpp"

namespace cairn {

namespace {

class AssociatedStart final : public NlgsPart {
public:
  explicit AssociatedStart(NlgsState& s) : s_(s) {}

  void prepare(SweepPass& pass) override { s_.schedule.associated = pass.by && on_; }

  // Follows each true error, that of Coulomb's law, and the change of the sweep before it. The error of the convex
  // problem is estimated as the change times the smallest ratio of error to change so far.
  bool follow(const StepError& error, double change) override {
    if (!on_ || !s_.taken_over) return false;
    const double moved = std::sqrt(change / s_.free.energy), size = std::sqrt(error.square);
    least_ratio_ = std::min(least_ratio_, size / moved);
    on_ = s_.report.iterations < s_.options.max_iterations / 4 && moved > 0 &&
          least_ratio_ * moved > policy().associated_near * s_.aim();
    if (on_) return false;
    s_.changed = true;
    s_.ratio = 0;
    return false;
  }

private:
  NlgsState& s_;
  bool on_ = true; // the next extrapolated sweeps use the associated (convex) law
  double least_ratio_ = std::numeric_limits<double>::infinity();
};

} // namespace

void add_associated_start(NlgsState& s, NlgsParts& parts) {
  const double at_rest = policy().associated_at_rest; // of the speed by loads in a step: bodies that move will slide
  // beside bonds and joints, which are no cones, the problem is not convex, and sweeps need their restarts
  if (s.options.associated_start && s.extrapolates &&
      s.system.begin_speed_square <= at_rest * at_rest * s.system.weight_speed_square && all_cones(s.system) &&
      begins_from_nothing(s.system))
    parts.add<AssociatedStart>(s);
}

} // namespace cairn
