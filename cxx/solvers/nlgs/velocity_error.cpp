// How far the velocities of a step are from those of its exact solution, told from how they changed while the error
// fell, and from what Newton's method would change of them.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../policy.hpp"
#include "../sweeps/batch.hpp"
#include "../sweeps/newton_correction.hpp"
#include "nlgs_part.hpp"

namespace cairn {

namespace {

// Error of velocities, |v - v*|_M / max(|v*|_M, |h g|_M). While the error of impulses fell to a quarter or less,
// velocities changed by |dv|_M: the ratio is a slope, which times the error at hand estimates the rest. Of the last two
// slopes the larger counts, fourfold, as they vary.
// A cluster that moves slowly is not seen so: in a hopper velocities were off by 9e-3 at an error of 9e-7 for 12,000
// sweeps. So the estimate alone is no proof. It needs one of three:
// - The linear system of Newton's method, nearly singular where a cluster moves. Its steps prove a small error once
// they bring the error down, which shows that they know which contacts stick, slip and open; or once they are small,
// and again so after four times as many sweeps.
// - Proximal points around Newton's method, where its steps cycle, found from the impulses at hand: at an error smaller
// by decades velocities are known.
// - An error so small that the slowest cluster ever observed would not matter: see `reach`. Laws with a local solution
// of their own have this alone.
class VelocityError final : public NlgsPart {
public:
  explicit VelocityError(NlgsState& s) : s_(s), newton_(s.system, s.schedule, s.velocity_free, s.options) {
    std::size_t numbers = 0;
    for (const cairn_batch& b : s.system.batches) numbers += std::size_t(b.count) * b.components;
    fit(s.system.kept_r, numbers);
    fit(s.system.kept_u, numbers);
  }

  // Newton's method is tried although the error did not fall further.
  void measured(StepError& error) override {
    const int iterations = s_.report.iterations;
    s_.due = worth_asking(iterations) && iterations >= next_newton_ &&
             error.square <= s_.options.tolerance * s_.options.tolerance;
  }
  Verdict judge(StepError& error) override;
  bool follow(const StepError& error, double) override {
    look(std::sqrt(error.square));
    return false;
  }
  void end(StepError& end, SolverOptions&) override;

private:
  // Estimates the error of velocities from the error of the impulses at hand, records up to date.
  void look(double error);
  // True if the velocity error is small enough, or will not become so. A step of Newton's method that brings the error
  // down is taken: the error then falls, with records up to date.
  bool holds(double& error_square);
  // The error at which it may hold, below the one at hand.
  double wanted(double error) const;
  // By the estimate; an error that begins so small may be rounding, which sweeps bring down no further.
  bool promises() const { return value_ <= accuracy_ || (!known_ && kept_error_ > 0 && kept_error_ < 0x1p-30); }
  bool worth_asking(int iterations) const { return promises() || iterations >= next_points_; }
  void keep(double error);
  void bound(double error);
  bool solve_on(double& error_square);
  double change_square() const; // |v - v kept|_M^2
  NlgsState& s_;
  NewtonCorrection newton_;
  const double accuracy_ = s_.options.accuracy;
  double value_ = std::numeric_limits<double>::quiet_NaN(); // proved where s_.proven, else an estimate
  double bound_ = std::numeric_limits<double>::quiet_NaN();
  double kept_error_ = 0, slope_ = 0, slope_before_ = 0;
  double held_at_ = 0;                         // error at which the estimate held first
  int next_newton_ = 0, small_since_ = 0;      // sweeps; what Newton's method changes was small since
  int next_points_ = policy().velocity_points; // sweeps until proximal points are looked for
  bool known_ = false, confirmed_ = false;
  bool alone_ = false;                    // Newton's method has no word
  bool tiny_ = false, exhausted_ = false; // the error, to velocities; and to rounding alone
  // Largest ratio of the velocity error in |.|_M to the error of contact impulses in the same norm, with a margin: in
  // hoppers and drums of seven laws it was 2e5 at most, mostly below 100.
  const double reach = policy().velocity_reach, fall = policy().velocity_fall;
};

// Bound of the velocity error, where the slowest cluster is no slower than `reach`; rounding counts as an error.
void VelocityError::bound(double error) {
  constexpr double rounding = 16 * std::numeric_limits<double>::epsilon();
  const double borne = std::sqrt(total(s_.system.sums, s_.system.batches.size(), 6, 1)), speed = s_.system.speed();
  const double amplified = speed > 0 ? std::max(1.0, borne / speed) : 1;
  bound_ = reach * amplified * std::max(error, rounding);
  // Or that of impulses in balance. How much larger they are than velocities tells how ill the bodies that they hold
  // are.
  const bool balanced = error * speed <= std::numeric_limits<double>::epsilon() * borne;
  if (balanced && error > 0) bound_ = std::min(bound_, error * borne / speed);
  exhausted_ = !(error > 0) && !(bound_ <= accuracy_);
}

void VelocityError::look(double error) {
  const double safety = policy().velocity_safety, tiny = policy().velocity_tiny;
  s_.proven = false;
  bound(error);
  if (kept_error_ > 0 && error * fall <= kept_error_) {
    slope_before_ = slope_;
    slope_ = std::sqrt(change_square()) / (kept_error_ - error);
    known_ = true;
    keep(error);
  } else if (!(kept_error_ > 0)) {
    keep(error);
  }
  if (known_) {
    value_ = safety * std::max(slope_, slope_before_) * error / s_.system.speed();
    if (!(value_ <= accuracy_))
      held_at_ = 0, confirmed_ = false;
    else if (!(held_at_ > 0))
      held_at_ = error;
    else
      confirmed_ = confirmed_ || error * fall <= held_at_;
  }
  tiny_ = bound_ <= accuracy_ && (confirmed_ || error < tiny);
  if (exhausted_) value_ = bound_;
}

void VelocityError::end(StepError& end, SolverOptions&) {
  if (!s_.proven) {
    look(s_.report.error);
    if (tiny_) value_ = bound_;
    s_.proven = tiny_;
  }
  s_.report.velocity_error = std::isnan(value_) ? bound_ : value_;
  end.vague = !s_.proven;
  end.rounded = end.vague && exhausted_;
}

Verdict VelocityError::judge(StepError& error) {
  if (s_.refinement.known) {
    value_ = s_.refinement.change;
    s_.proven = true;
    return Verdict::ends;
  }
  if (!(s_.report.light_error <= s_.ends_at && (error.square <= s_.wanted || s_.due))) return Verdict::goes_on;
  look(std::sqrt(error.square));
  const double before = error.square;
  if (holds(error.square)) return Verdict::ends;
  if (error.square < before) s_.changed = true;
  const double next = wanted(std::sqrt(error.square));
  s_.wanted = next * next;
  if (s_.help) s_.help->aim(next);
  return Verdict::goes_on;
}

bool VelocityError::holds(double& error_square) {
  // ratios of sweeps: until the next correction, and until a small value is believed
  const double patience = policy().velocity_patience, to_confirm = policy().velocity_confirm;
  const int iterations = s_.report.iterations;
  bool taken = iterations >= next_newton_;
  while (taken && !tiny_ && worth_asking(iterations)) { // ends: what is taken divides the square of the error by 16
    next_newton_ = int(std::min(patience * iterations, 1e9));
    const double change = newton_.find(iterations);
    alone_ = std::isnan(change);
    if (alone_) break;
    const bool small = change <= accuracy_ * s_.system.speed();
    const bool again = small && small_since_ > 0 && iterations >= to_confirm * small_since_;
    if (!small || small_since_ == 0) small_since_ = small ? iterations : 0;
    taken = newton_.take(error_square, s_.error_square);
    value_ = std::fmax(value_, change / s_.system.speed()); // which may be no number yet
    if (small && (taken || again)) return s_.proven = true;
    taken = taken || (!small && solve_on(error_square));
    if (taken) look(std::sqrt(error_square));
    taken = taken && error_square > 0;
  }
  if (tiny_) value_ = bound_;
  s_.proven = tiny_;
  return s_.proven || exhausted_;
}

bool VelocityError::solve_on(double& error_square) {
  const double patience = policy().velocity_points_again;
  const int iterations = s_.report.iterations;
  if (iterations < next_points_) return false;
  // far enough, as impulses that just do are as far from doing once they are measured again
  const double wanted = std::sqrt(error_square) * accuracy_ / (16 * bound_);
  const bool better = newton_.solve_on(iterations, error_square, wanted, s_.error_square);
  if (!better) next_points_ = int(std::min(patience * iterations, 1e9)); // progress goes on
  return better;
}

double VelocityError::wanted(double error) const {
  if (!known_) return error / fall;
  if (value_ <= accuracy_ && confirmed_ && alone_)
    return std::min(0.75 * error, std::max(accuracy_ / bound_, 1.0 / 16) * error);
  if (value_ <= accuracy_) return std::min(0.75 * error, held_at_ / fall);
  return error * std::clamp(accuracy_ / value_, 1.0 / 16, 0.75);
}

void VelocityError::keep(double error) {
  kept_error_ = error;
  std::size_t to = 0;
  double u[6 * 128];
  for (std::size_t k = 0; k < s_.system.batches.size(); ++k) {
    const cairn_batch& b = s_.system.batches[k];
    cairn_relative_velocities(&s_.schedule, std::int32_t(k), 0, u);
    for (int c = 0; c < b.components; ++c)
      for (int lane = 0; lane < b.contacts; ++lane, ++to) {
        s_.system.kept_r[to] = at(b, b.r, lane, c);
        s_.system.kept_u[to] = u[c * b.count + lane];
      }
  }
}

// dr.W dr: of rigid bodies |dv|_M^2; of those that deform the norm of A = M + h theta C + h^2 theta^2 K, which is more.
double VelocityError::change_square() const {
  std::size_t from = 0;
  double u[6 * 128], sum = 0;
  for (std::size_t k = 0; k < s_.system.batches.size(); ++k) {
    const cairn_batch& b = s_.system.batches[k];
    cairn_relative_velocities(&s_.schedule, std::int32_t(k), 0, u);
    for (int c = 0; c < b.components; ++c)
      for (int lane = 0; lane < b.contacts; ++lane, ++from)
        sum += (at(b, b.r, lane, c) - s_.system.kept_r[from]) * (u[c * b.count + lane] - s_.system.kept_u[from]);
  }
  return std::max(sum, 0.0);
}

} // namespace

void add_velocity_error(NlgsState& s, NlgsParts& parts) {
  if (s.asks_for_accuracy()) parts.add<VelocityError>(s);
}

} // namespace cairn
