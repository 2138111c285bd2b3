#include "velocity_error.hpp"

#include <cmath>
#include <limits>

#include "batch.hpp"
#include "step_error.hpp"

namespace cairn {

VelocityError::VelocityError(ContactSystem& system, const cairn_schedule& schedule, const Velocities& velocity_free,
                             const SolverOptions& options)
    : system_(system), schedule_(schedule), newton_(system, schedule, velocity_free, options),
      accuracy_(options.accuracy) {
  if (!asked()) return;
  std::size_t numbers = 0;
  for (const cairn_batch& b : system.batches) numbers += std::size_t(b.count) * b.components;
  fit(system.kept_r, numbers);
  fit(system.kept_u, numbers);
}

// Bound of the velocity error, where the slowest cluster is no slower than `reach`; rounding counts as an error.
void VelocityError::bound(double error) {
  constexpr double rounding = 16 * std::numeric_limits<double>::epsilon();
  const double borne = std::sqrt(total(system_.sums, system_.batches.size(), 6, 1)), speed = system_.speed();
  const double amplified = speed > 0 ? std::max(1.0, borne / speed) : 1;
  bound_ = reach * amplified * std::max(error, rounding);
  // Or that of impulses in balance. How much larger they are than velocities tells how ill the bodies that they hold
  // are.
  const bool balanced = error * speed <= std::numeric_limits<double>::epsilon() * borne;
  if (balanced && error > 0) bound_ = std::min(bound_, error * borne / speed);
  exhausted_ = !(error > 0) && !(bound_ <= accuracy_);
}

void VelocityError::follow(double error) {
  constexpr double safety = 4, tiny = 0x1p-30;
  if (!asked()) return;
  holds_ = false;
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
    value_ = safety * std::max(slope_, slope_before_) * error / system_.speed();
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

void VelocityError::end(double error) {
  if (!asked() || holds_) return;
  follow(error);
  if (tiny_) value_ = bound_;
  holds_ = tiny_;
}

void VelocityError::told(const Refinement& by) {
  if (!asked() || !by.known) return;
  value_ = by.change;
  confirmed_ = holds_ = true;
}

bool VelocityError::holds(int iterations, double& error_square, const std::function<double()>& measure) {
  constexpr int most = 8; // one after the other
  // ratios of sweeps: until the next correction, and until a small value is believed; by the estimate, a value far
  // below the accuracy is believed at the next
  constexpr double patience = 1.5, to_confirm = 4, far = 64;
  if (!asked()) return true;
  bool taken = iterations >= next_newton_;
  for (int k = 0; k < most && taken && !tiny_ && worth_asking(iterations); ++k) {
    next_newton_ = int(std::min(patience * iterations, 1e9));
    const double change = newton_.find(iterations);
    alone_ = std::isnan(change);
    if (alone_) break;
    const bool small = change <= accuracy_ * system_.speed();
    const bool smaller = value_ * far <= accuracy_ && change * far <= accuracy_ * system_.speed();
    const bool again = small && small_since_ > 0 && iterations >= (smaller ? patience : to_confirm) * small_since_;
    if (!small || small_since_ == 0) small_since_ = small ? iterations : 0;
    taken = newton_.take(error_square, measure);
    value_ = std::fmax(value_, change / system_.speed()); // which may be no number yet
    if (small && (taken || again)) return holds_ = true;
    taken = taken || (!small && solve_on(iterations, error_square, measure));
    if (taken) follow(std::sqrt(error_square));
  }
  if (tiny_) value_ = bound_;
  holds_ = tiny_;
  return holds_ || exhausted_;
}

bool VelocityError::solve_on(int iterations, double& error_square, const std::function<double()>& measure) {
  constexpr double patience = 2;
  if (iterations < next_points_) return false;
  // far enough, as impulses that just do are as far from doing once they are measured again
  const double wanted = std::sqrt(error_square) * accuracy_ / (16 * bound_);
  const bool better = newton_.solve_on(iterations, error_square, wanted, measure);
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
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    cairn_relative_velocities(&schedule_, std::int32_t(k), 0, u);
    for (int c = 0; c < b.components; ++c)
      for (int lane = 0; lane < b.contacts; ++lane, ++to) {
        system_.kept_r[to] = at(b, b.r, lane, c);
        system_.kept_u[to] = u[c * b.count + lane];
      }
  }
}

// dr.W dr: of rigid bodies |dv|_M^2; of those that deform the norm of A = M + h theta C + h^2 theta^2 K, which is more.
double VelocityError::change_square() const {
  std::size_t from = 0;
  double u[6 * 128], sum = 0;
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    cairn_relative_velocities(&schedule_, std::int32_t(k), 0, u);
    for (int c = 0; c < b.components; ++c)
      for (int lane = 0; lane < b.contacts; ++lane, ++from)
        sum += (at(b, b.r, lane, c) - system_.kept_r[from]) * (u[c * b.count + lane] - system_.kept_u[from]);
  }
  return std::max(sum, 0.0);
}

} // namespace cairn
