// Projected over-relaxation (Cryer 1971), where sweeps are not extrapolated: an impulse changes by more than its
// contact alone asks, and stays in its cone. It equals blocks of W divided by the factor; bonds keep theirs. A few
// contacts are solved sooner, and to rounding, without it. For Coulomb's cones convergence is not proved above 1: where
// an error did not fall the factor is lowered, down to 1. A few contacts of a pack that slip may cycle for ever at 1
// and above; below 1 they come to rest.
#include <algorithm>
#include <limits>

#include "../policy.hpp"
#include "nlgs_part.hpp"

namespace cairn {

namespace {

class Relaxation final : public NlgsPart {
public:
  explicit Relaxation(NlgsState& s) : s_(s) { s_.schedule.relaxation = 1; }

  void prepare(SweepPass&) override {
    if (s_.cycles) s_.schedule.relaxation = policy().relaxation_damped;
  }

  bool follow(const StepError& error, double) override {
    if (s_.extrapolates || s_.cycles) return false;
    double& factor = s_.schedule.relaxation;
    if (!begun_ && s_.report.iterations >= policy().plain_sweeps) {
      begun_ = true;
      factor = policy().relaxation_first;
    } else if (!(error.square < policy().relaxation_fall * best_)) {
      factor = std::max(1.0, factor - policy().relaxation_decrement);
    }
    best_ = std::min(best_, error.square);
    return false;
  }

private:
  NlgsState& s_;
  bool begun_ = false;
  double best_ = std::numeric_limits<double>::infinity();
};

} // namespace

void add_relaxation(NlgsState& s, NlgsParts& parts) { parts.add<Relaxation>(s); }

} // namespace cairn
