#include "velocity_error.hpp"

#include <cmath>

#include "../../contacts/interaction_state.hpp"

namespace cairn {

VelocityError::VelocityError(ContactSystem& system, const cairn_schedule& schedule, double accuracy)
    : system_(system), schedule_(schedule), accuracy_(accuracy) {
  if (!asked()) return;
  std::size_t numbers = 0;
  for (const cairn_batch& b : system.batches) numbers += std::size_t(b.count) * b.components;
  fit(system.kept_r, numbers);
  fit(system.kept_u, numbers);
}

void VelocityError::follow(double error) {
  constexpr double safety = 4;
  if (!asked()) return;
  if (!(error > 0x1p-40)) { // only rounding is left
    value_ = error;
    confirmed_ = true;
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
  value_ = safety * std::max(slope_, slope_before_) * error / speed();
  if (!(value_ <= accuracy_))
    held_at_ = 0, confirmed_ = false;
  else if (!(held_at_ > 0))
    held_at_ = error;
  else
    confirmed_ = confirmed_ || error * fall <= held_at_;
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

double VelocityError::speed() const {
  double sum = system_.mesh_speed_square;
  const int d = system_.dim, n = system_.velocities();
  for (std::int64_t b = 0; b < system_.bodies; ++b) {
    const double* x = system_.record[b].x;
    for (int k = 0; k < n; ++k) {
      const double inverse = d == 2 ? x[3 + k] : x[k < 3 ? 6 : 7];
      if (inverse > 0 && (k < d || system_.general.empty())) sum += x[k] * x[k] / inverse;
    }
  }
  return std::sqrt(std::max(sum, system_.weight_speed_square));
}

} // namespace cairn
