#include "velocity_error.hpp"

#include <cmath>
#include <limits>

#include "../../contacts/interaction_state.hpp"
#include "step_error.hpp"

namespace cairn {

VelocityError::VelocityError(ContactSystem& system, const cairn_schedule& schedule, const Velocities& velocity_free,
                             const SolverOptions& options)
    : system_(system), schedule_(schedule), newton_(system, schedule, velocity_free, options),
      accuracy_(options.accuracy), holds_(!asked()) {
  if (!asked()) return;
  std::size_t numbers = 0;
  for (const cairn_batch& b : system.batches) numbers += std::size_t(b.count) * b.components;
  fit(system.kept_r, numbers);
  fit(system.kept_u, numbers);
}

void VelocityError::follow(double error) {
  constexpr double safety = 4;
  if (!asked()) return;
  holds_ = false;
  if (!(error > 0x1p-40)) { // only rounding is left
    value_ = error;
    confirmed_ = holds_ = true;
    return;
  }
  // Or that of impulses in balance. How much larger they are than velocities tells how ill the bodies that they hold
  // are.
  const double borne = std::sqrt(total(system_.sums, system_.batches.size(), 6, 1)), speed = system_.speed();
  const double amplified = error * borne / speed;
  if (error * speed <= std::numeric_limits<double>::epsilon() * borne && amplified <= accuracy_) {
    value_ = amplified;
    confirmed_ = holds_ = true;
    return;
  }
  if (!(kept_error_ > 0)) return keep(error);
  if (error * fall <= kept_error_) {
    slope_before_ = slope_;
    slope_ = std::sqrt(change_square()) / (kept_error_ - error);
    known_ = true;
    keep(error);
  }
  if (!known_) return;
  value_ = safety * std::max(slope_, slope_before_) * error / system_.speed();
  if (!(value_ <= accuracy_))
    held_at_ = 0, confirmed_ = false;
  else if (!(held_at_ > 0))
    held_at_ = error;
  else
    confirmed_ = confirmed_ || error * fall <= held_at_;
}

void VelocityError::told(const Refinement& by) {
  if (!asked() || !by.known) return;
  value_ = by.change;
  confirmed_ = holds_ = true;
}

bool VelocityError::holds(int iterations, double& error_square, const std::function<double()>& measure) {
  constexpr int most = 8; // one after the other
  // sweeps until the next, and until what is small is believed, against those until now
  constexpr double patience = 1.5, to_confirm = 4;
  bool taken = iterations >= next_newton_;
  for (int k = 0; k < most && taken && !holds_ && promises(); ++k) {
    const double change = newton_.find(iterations);
    if (std::isnan(change)) return holds_ = confirmed_;
    const bool small = change <= accuracy_ * system_.speed(),
               again = small && small_since_ > 0 && iterations >= to_confirm * small_since_;
    value_ = std::fmax(value_, change / system_.speed()); // which may be no number yet
    next_newton_ = int(std::min(patience * iterations, 1e9));
    if (!small || small_since_ == 0) small_since_ = small ? iterations : 0;
    taken = newton_.take(error_square, measure);
    holds_ = small && (taken || again);
    if (taken && !holds_) follow(std::sqrt(error_square));
  }
  return holds_;
}

double VelocityError::wanted(double error) const {
  if (!known_) return error / fall;
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
