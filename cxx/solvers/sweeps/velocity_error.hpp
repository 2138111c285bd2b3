// How far the velocities of a step are from those of its exact solution, told from how they changed while the error
// fell, and from what Newton's method would change of them.
#pragma once
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "contact_system.hpp"
#include "newton_correction.hpp"
#include "refinement.hpp"

namespace cairn {

// |v - v*|_M / max(|v*|_M, |h g|_M). While the error fell to a quarter or less, velocities changed by |dv|_M: per
// change of the error that is a slope, which with the error at hand tells what is left. It is not the same all the way:
// of the last two the larger counts, fourfold (measured: what is left is between 1/30 and 2.4 of that where it is below
// 1e-2). A cluster that gives way slowly is not seen so: in a hopper velocities were off by 9e-3 at an error of 9e-7,
// and 12,000 sweeps went by before both fell; in a drum of wet grains two errors a quarter apart told 1e-5 of 1.6e-3.
// So the estimate alone is no proof. One of three things is:
// - The linear system of Newton's method, singular as it nearly is where something gives way. Its steps have the last
//   word: once they bring the error down, which tells that they know what sticks, slips and opens, or once they were
//   small and are so after four times as many sweeps.
// - Where such steps turn in circles, proximal points around them, found from the impulses at hand: at an error that is
//   smaller by decades velocities are known.
// - An error so small that the slowest cluster that was ever seen to give way would not matter: see `reach`. Laws
//   with a local solution of their own have this alone.
class VelocityError {
public:
  // options.accuracy: what is asked for; infinity: nothing, and nothing is measured
  VelocityError(ContactSystem& system, const cairn_schedule& schedule, const Velocities& velocity_free,
                const SolverOptions& options);
  // Told of each error of the impulses at hand, records up to date.
  void follow(double error);
  // Of the error that a step ends with.
  void end(double error);
  // Told of what another solver's last steps changed of velocities.
  void told(const Refinement&);
  bool asked() const { return accuracy_ < std::numeric_limits<double>::infinity(); }
  bool held() const { return asked() && holds_; }
  // Proved where it is held, else as far as velocities told of it. NaN: not asked for.
  double value() const { return std::isnan(value_) ? bound_ : value_; }
  // Only rounding is left of the error, and velocities are not known to be so exact.
  bool exhausted() const { return exhausted_; }
  // Whether Newton's method shall be asked although the error did not fall on.
  bool due(int iterations) const { return asked() && worth_asking(iterations) && iterations >= next_newton_; }
  // Whether it is small enough, or will not become so. Where a step of Newton's method brings the error down it is
  // taken: the error then falls, with records up to date. measure: its square.
  bool holds(int iterations, double& error_square, const std::function<double()>& measure);
  // The error at which it may hold, below the one at hand.
  double wanted(double error) const;

private:
  // By the estimate; an error that begins so small may be rounding, which sweeps bring down no further.
  bool promises() const { return value_ <= accuracy_ || (!known_ && kept_error_ > 0 && kept_error_ < 0x1p-30); }
  bool worth_asking(int iterations) const { return promises() || iterations >= next_points_; }
  void keep(double error);
  void bound(double error);
  bool solve_on(int iterations, double& error_square, const std::function<double()>& measure);
  double change_square() const; // |v - v kept|_M^2
  ContactSystem& system_;
  const cairn_schedule& schedule_;
  NewtonCorrection newton_;
  double accuracy_, value_ = std::numeric_limits<double>::quiet_NaN();
  double bound_ = std::numeric_limits<double>::quiet_NaN();
  double kept_error_ = 0, slope_ = 0, slope_before_ = 0;
  double held_at_ = 0;                    // error at which the estimate held first
  int next_newton_ = 0, small_since_ = 0; // sweeps; what Newton's method changes was small since
  int next_points_ = 1024;                // sweeps until proximal points are looked for
  bool known_ = false, confirmed_ = false, holds_ = false;
  bool alone_ = false;                    // Newton's method has no word
  bool tiny_ = false, exhausted_ = false; // the error, to velocities; and to rounding alone
  // Of velocities in |.|_M, over what the impulses of contacts miss in the same norm: in some 60 steps of hoppers and
  // drums of seven laws 2e5 at most (an error of 5e-9 that 400,000 sweeps left there), mostly below 100.
  static constexpr double reach = 0x1p20;
  static constexpr double fall = 4; // of the error, from one slope to the next
};

} // namespace cairn
