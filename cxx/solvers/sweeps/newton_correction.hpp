// Remaining Newton correction of a step's impulses: it tells the distance of velocities from the solution even where a
// cluster of grains moves so slowly that neither the error nor some hundred sweeps show it.
#pragma once
#include <functional>
#include <optional>

#include "../refinement_memory.hpp"
#include "../solve_report.hpp"
#include "../solver_options.hpp"
#include "contact_system.hpp"
#include "step_problem.hpp"

namespace cairn {

// Cost of a plain sweep, in operations at the rate of factors.
double sweep_operations(const ContactSystem&);

class NewtonStep;
class ScaledProblem;

class NewtonCorrection {
public:
  NewtonCorrection(ContactSystem& system, const cairn_schedule& schedule, const Velocities& velocity_free,
                   const SolverOptions& options);
  // Largest |dv|_M of a few steps from the impulses at hand, fewer where the error falls; records up to date before and
  // after. Infinity: there is none. NaN: its factors cannot be had, or not for a few times the work of so many sweeps.
  double find(int sweeps);
  // Gives the impulses these steps if they brought the error down: its square, which measure tells with records up to
  // date, to a sixteenth or less. False: they are as they were.
  bool take(double& error_square, const std::function<double()>& measure);

  // Proximal points around Newton's method from the impulses at hand, for as much work as the sweeps were, down to the
  // error `wanted`: taken if they bring the error down to a sixteenth. Not before a look by `find`.
  bool solve_on(int sweeps, double& error_square, double wanted, const std::function<double()>& measure);

private:
  bool give(double fall, double& error_square, const std::function<double()>& measure);
  void refresh();
  bool make_problem();
  double least_operations() const;
  double follow(ScaledProblem& scaled, NewtonStep& newton);
  ContactSystem& system_;
  const cairn_schedule& schedule_;
  Velocities velocity_free_;
  const SolverOptions& options_;
  std::optional<StepProblem> problem_;
  Array<double> start_, step_; // (dim, contacts) impulses
  double operations_ = 0;      // of a factorisation, at least
  bool possible_ = true, close_ = false;
};

} // namespace cairn
