// Rest: impulses of contacts that stand still are solved to rounding, and bodies that then hardly move do not move.
#include <algorithm>
#include <cmath>
#include <utility>

#include "../policy.hpp"
#include "../refinement_memory.hpp"
#include "../sweeps/contact_rows.hpp"
#include "nlgs_part.hpp"

namespace cairn {

namespace {

// True if each rigid body has at most a share of the speed that loads alone give it in the step (energy norm). False
// with condensed bodies, or if a driven body moves.
bool resting(const ContactSystem& system, const Velocities& velocity_free, double share) {
  if (!system.condensed.empty()) return false;
  const int dim = system.dim, n = system.velocities();
  for (std::int64_t b = 0; b < system.bodies; ++b) {
    double mass[36], inverse[36], energy = 0, loaded = 0;
    const double* v = system.record[std::size_t(b)].x;
    bool still = true;
    for (int k = 0; k < n; ++k) still = still && !(v[k] < 0 || v[k] > 0);
    if (still) continue;
    body_mass(system, std::int32_t(b), mass, inverse);
    for (int k = 0; k < n; ++k)
      if (!(inverse[(n + 1) * k] > 0)) return false;
    for (int k = 0; k < n; ++k)
      for (int l = 0; l < n; ++l) energy += v[k] * mass[n * l + k] * v[l];
    for (int k = 0; k < dim; ++k) loaded += mass[(n + 1) * k] * velocity_free.bodies[b][k] * velocity_free.bodies[b][k];
    if (!(energy <= share * share * loaded)) return false;
  }
  return true;
}

class Rest final : public NlgsPart {
public:
  explicit Rest(NlgsState& s) : s_(s) {
    if (s_.system.rest && s_.system.rest->idle > 0)
      --s_.system.rest->idle;
    else
      memory_ = s_.system.rest;
  }

  // True if impulses of the last step meet the tolerance and stay as they are: between faces a sweep shifts impulses
  // among the points of a face, and bodies at rest would begin to tremble, step by step.
  bool begin() override {
    const bool may = helped() && !s_.extrapolates && !s_.asks_for_accuracy() && s_.options.min_iterations <= 1 &&
                     s_.report.contacts > policy().settled_unknowns && s_.error_square() <= s_.wanted &&
                     !s_.help->refines(0, s_.report.error);
    if (may) come_to_rest(s_.report.error * s_.report.error);
    return may;
  }

  Verdict judge(StepError& error) override {
    if (s_.help && !s_.uneven && s_.report.contacts * s_.system.dim > policy().settled_unknowns &&
        come_to_rest(error.square))
      error = s_.measure();
    return Verdict::none;
  }

  // Sets velocities to zero if each body is slower than a share of the speed that loads alone would give it, so that
  // the residual does no work: under unchanged impulses bodies would topple, slowly at first.
  void close() override {
    if (!helped() || s_.system.rest == nullptr || s_.report.error > policy().rest_least ||
        !resting(s_.system, s_.velocity_free, policy().rest_least))
      return;
    for (cairn_record& record : s_.system.record) std::fill_n(record.x, s_.system.dim == 2 ? 3 : 6, 0.0);
    s_.system.keeps_velocity = true;
  }

private:
  bool helped() const { return s_.help && !s_.help->given_up() && !s_.uneven; }

  // Newton's method takes the error down to rounding once contacts stand still: a residual of the same sign in each
  // step adds up, and a tower of many blocks comes to sway. Later steps start from a solution. Bodies that move slowly
  // ask for it in each step, so attempts that follow each other become ever rarer.
  bool come_to_rest(double error_square) {
    const int most = policy().rest_attempts, free = policy().rest_free_attempts;
    if (!helped() || !memory_) return false;
    if (error_square <= policy().rest_least * policy().rest_least) {
      RestMemory& rest = *std::exchange(memory_, nullptr);
      rest.attempts = std::max(0, rest.attempts - 1);
      return false;
    }
    if (!near_rest(s_)) return false;
    RestMemory& rest = *std::exchange(memory_, nullptr);
    rest.attempts = std::min(most, rest.attempts + 1);
    rest.idle = rest.attempts > free ? (1 << (rest.attempts - free)) - 1 : 0;
    if (!s_.help->settles(s_.schedule, std::sqrt(error_square), policy().rest_error, s_.error_square)) return false;
    s_.report.solver = s_.help->name();
    return true;
  }

  NlgsState& s_;
  RestMemory* memory_ = nullptr; // null: this step is not solved to rounding, or not once more
};

} // namespace

void add_rest(NlgsState& s, NlgsParts& parts) {
  if (s.help || s.system.rest) parts.add<Rest>(s);
}

} // namespace cairn
