// Frictional contact problem with contacts of equal scale: W' = c s W s, q' = s q, r = c s r', with a power of two s
// for each contact and a common c, so that the mean diagonal of each W'_aa lies in [1/2, 2). Coulomb's law and the true
// error are unchanged; light contacts count like heavy ones, and no bit of W or q is lost.
#pragma once
#include <functional>

#include "friction_problem.hpp"
#include "nlgs_problem.hpp"

namespace cairn {

class ScaledProblem {
public:
  // r (dim, contacts) of the problem as it was given, in and out.
  ScaledProblem(const FrictionProblem&, const ProblemOptions&, double* r);

  const FrictionProblem& problem() const { return scaled_; }
  ProblemMonitor& monitor() { return *monitor_; }
  const double* best() const { return best_.data(); } // of the scaled problem
  const double* unit() const { return unit_.data(); } // (contacts) s: u' = s u
  // r / r' of a contact, and r.W r / r'.W' r'.
  double impulse_unit(std::int64_t contact) const { return scale_[contact]; }
  double energy_unit() const { return scale_[0] / unit_[0]; }
  // Sweeps of NLGS on r (scaled).
  void sweep(double* r, int sweeps);
  // The best r goes back; figures are those of the problem as it was given.
  ProblemReport finish(const std::string& solver, std::int64_t iterations);

private:
  const FrictionProblem& given_;
  ProblemOptions options_;
  double tolerance_; // of the problem as it was given
  double* r_;
  FrictionProblem scaled_;
  Array<double> unit_, scale_, best_; // (contacts) s; r / r'
  std::optional<Sweeper> sweeper_;
  std::optional<ProblemMonitor> monitor_;
};

} // namespace cairn
