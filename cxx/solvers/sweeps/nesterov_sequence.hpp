// Factors by which sweeps are extrapolated, and when they begin again; for steps and for problems.
#pragma once
#include <algorithm>

#include "../policy.hpp"

namespace cairn {

class NesterovSequence {
public:
  // Factor of the next sweep; (k - 1)/(k + 2) differs from Nesterov's own sequence (1983) by less than 1/k.
  double factor() const { return since_restart_ < 2 ? 0 : double(since_restart_ - 1) / (since_restart_ + 2); }
  void restart() { since_restart_ = 0; }
  // Follows each error that is above the one wanted, of whichever sweep of the step. Where contacts slip the direction
  // may point along the sweeps, and changes may stay below their bound, while the error no longer falls: the sequence
  // begins again after some sweeps, and whenever there are some times as many.
  void follow_error(int sweeps) {
    if (sweeps < next_restart_) return;
    restart();
    next_restart_ = policy().nesterov_again * sweeps;
  }
  // Follows each sweep: sum of dr.W dr, dr its change of impulses [J], and the sum by which O'Donoghue & Candes (2015)
  // detect that the direction leads back [J]. Measured over deposits at rest and in motion: where contacts slip sweeps
  // do not descend on a function, and direction alone tells too late. descends: they do, and direction suffices.
  void follow(double change, double along, bool descends = false) {
    const bool first = ++since_restart_ == 1;
    least_change_ = first ? change : std::min(least_change_, change);
    const bool astray =
        !(change <= policy().nesterov_growth * least_change_) || since_restart_ > policy().nesterov_longest;
    if (!first && (along > 0 || (astray && !descends))) restart();
  }

private:
  int since_restart_ = 0;                      // sweeps
  int next_restart_ = policy().nesterov_first; // sweeps of the step
  double least_change_ = 0;
};

} // namespace cairn
