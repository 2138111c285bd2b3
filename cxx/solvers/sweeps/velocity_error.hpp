// How far the velocities of a step are from those of its exact solution, told from how they changed while the error
// fell.
#pragma once
#include <algorithm>
#include <limits>

#include "contact_system.hpp"

namespace cairn {

// |v - v*|_M / max(|v*|_M, |h g|_M). While the error fell to a quarter or less, velocities changed by |dv|_M: per
// change of the error that is a slope, which with the error at hand tells what is left. It is not the same all the way:
// of the last two the larger counts, fourfold (measured: what is left is between 1/30 and 2.4 of that where it is below
// 1e-2). A slow motion that the error hides shows as it falls on: what holds has to hold at a quarter of it, too.
class VelocityError {
public:
  // accuracy: what is asked for; infinity: nothing, and nothing is measured
  VelocityError(ContactSystem& system, const cairn_schedule& schedule, double accuracy);
  // Told of each error of the impulses at hand, records up to date.
  void follow(double error);
  bool asked() const { return accuracy_ < std::numeric_limits<double>::infinity(); }
  // NaN: not known yet, or not asked for.
  double value() const { return holds() || value_ > accuracy_ ? value_ : std::numeric_limits<double>::quiet_NaN(); }
  bool holds() const { return !asked() || (confirmed_ && value_ <= accuracy_); }
  // The error at which it may hold, below the one at hand.
  double wanted(double error) const;

private:
  void keep(double error);
  double change_square() const; // |v - v kept|_M^2
  double speed() const;         // max(|v|_M, |h g|_M)
  ContactSystem& system_;
  const cairn_schedule& schedule_;
  double accuracy_, value_ = std::numeric_limits<double>::quiet_NaN();
  double kept_error_ = 0, slope_ = 0, slope_before_ = 0;
  double held_at_ = 0; // error at which the estimate held first
  bool known_ = false, confirmed_ = false;
  static constexpr double fall = 4; // of the error, from one slope to the next
};

} // namespace cairn
