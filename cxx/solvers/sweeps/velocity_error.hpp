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
class VelocityError {
public:
  // options.accuracy: the accuracy asked for; infinity: none, and nothing is measured
  VelocityError(ContactSystem& system, const cairn_schedule& schedule, const Velocities& velocity_free,
                const SolverOptions& options);
  // Told of each error of the impulses at hand, records up to date.
  void follow(double error);
  // Ends with the final error of a step.
  void end(double error);
  // Told of what another solver's last steps changed of velocities.
  void told(const Refinement&);
  bool asked() const { return accuracy_ < std::numeric_limits<double>::infinity(); }
  bool held() const { return asked() && holds_; }
  // Proved where it is held, else as far as velocities told of it. NaN: not asked for.
  double value() const { return std::isnan(value_) ? bound_ : value_; }
  // Only rounding is left of the error, and velocities are not known to be so exact.
  bool exhausted() const { return exhausted_; }
  // True if Newton's method shall be tried although the error did not fall further.
  bool due(int iterations) const { return asked() && worth_asking(iterations) && iterations >= next_newton_; }
  // True if the velocity error is small enough, or will not become so. A step of Newton's method that brings the error
  // down is taken: the error then falls, with records up to date. measure: its square.
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
  // Largest ratio of the velocity error in |.|_M to the error of contact impulses in the same norm, with a margin: in
  // hoppers and drums of seven laws it was 2e5 at most, mostly below 100.
  static constexpr double reach = 0x1p20;
  static constexpr double fall = 4; // of the error, from one slope to the next
};

} // namespace cairn
