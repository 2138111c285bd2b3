// Where it is asked for, sweeps from nothing begin with associated friction, by which slip opens a contact: that is a
// convex problem, and where a pile can stand its solution stands, which is one of Coulomb's law too. Sweeps of
// Coulomb's law from nothing let grains fall that could lean on each other, and end where these slide, at errors that
// fall slowly. It is no default: of several solutions it takes one at the edge of sliding, from which later steps are
// harder and results hang on the tolerance.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>

#include "contact_system.hpp"

namespace cairn {

class AssociatedStart {
public:
  // aim: error that is sought; free_energy: that by which squares of errors are measured [J].
  AssociatedStart(const ContactSystem& system, bool asked, double aim, int max_iterations, double free_energy)
      : aim_(aim), free_energy_(free_energy), last_(max_iterations / 4),
        on_(asked && system.begin_speed_square <= at_rest * at_rest * system.weight_speed_square && all_cones(system) &&
            begins_from_nothing(system)) {}
  // True if the next extrapolated sweeps use the associated (convex) law.
  bool on() const { return on_; }
  // Follows each true error, that of Coulomb's law, and the sum of dr.W dr of the sweep before it, dr its change of
  // impulses [J]. True: this was the last sweep of the convex problem, whose error is estimated as the change times the
  // smallest ratio of error to change so far.
  bool ends(int iterations, double error_square, double change) {
    constexpr double near = 4, beside = 0.01; // of the aim; of Coulomb's error, where that is of what slides
    if (!on_) return false;
    const double moved = std::sqrt(change / free_energy_), error = std::sqrt(error_square);
    least_ratio_ = std::min(least_ratio_, error / moved);
    on_ = iterations < last_ && moved > 0 && least_ratio_ * moved > std::max(near * aim_, beside * error);
    return !on_;
  }

private:
  // Beside bonds and joints, which are no cones, the problem is not convex, and sweeps need their restarts.
  static bool all_cones(const ContactSystem& system) {
    return std::all_of(system.batches.begin(), system.batches.end(),
                       [](const cairn_batch& b) { return b.relaxes != 0 && b.bonds == 0; });
  }

  static constexpr double at_rest = 0.1; // of the speed by loads in a step: bodies that move will slide
  double aim_, free_energy_;
  int last_; // sweep
  bool on_;
  double least_ratio_ = std::numeric_limits<double>::infinity();
};

} // namespace cairn
