// Monitor shared by all solvers of problems: true error, best iterate, end of the iteration.
#pragma once
#include <chrono>
#include <cmath>
#include <optional>

#include "friction_problem.hpp"

namespace cairn {

// CPU seconds of this process.
double cpu_seconds();

class ProblemMonitor {
public:
  // `best` (dim, contacts) receives the best r seen by error_of; its initial value counts if the options say so.
  ProblemMonitor(const FrictionProblem&, const ProblemOptions&, double* best);

  // True error of r; keeps r if it is the best. u = W r + q is left in velocity(), or given where the caller has it.
  double error_of(const double* r);
  double error_of(const double* r, const double* u);
  // The same of what `best` begins with; costs next to nothing where that is no impulse.
  double start_error();
  // Asked after an error: converged, out of iterations or time, interrupted, or r not finite.
  bool ended(std::int64_t iterations);
  // Distance of velocities from the solution, for the r of the last error_of: largest |F| W_NN of a contact / largest
  // |q|. The true error weighs a contact by its light side, so heavy bodies on light ones can be far from rest where it
  // is already small.
  double speed_error(const double* r, const double* u);
  // The same, or |sum r_N u_N| / sum |r.q| beyond what rounding explains, whichever is larger: roundings of the
  // contacts of a column hide how its top falls from each of them, but not from their sum.
  double fall_error(const double* r, const double* u);
  // speed_error for the best r as a share of energy: sum |r| |F| W_NN / sum |r.q|. What falls on top of a column adds
  // up its contacts' velocities, each of which may be small. Not less than speed_error.
  double best_power_error();
  // While held, meeting the tolerance does not end the solve, and the last r that meets it is kept, not the best.
  void hold(bool on) { held_ = on; }
  double tolerance() const { return options_.tolerance; }
  // The solver gives up: stalled, diverged, no_solution.
  void give_up(ProblemStatus, const std::string& hint);

  double best_error() const { return best_error_; }
  double last_error() const { return last_error_; }
  const Array<double>& velocity() const { return u_; }                 // of the last error_of(r)
  const Array<double>& w_nn() const { return w_nn_; }                  // (contacts) [1/kg]
  const std::vector<std::int64_t>& diagonal() const { return place_; } // (contacts) place of the diagonal block
  double scale() const { return scale_; }                              // sum |F(0)|^2 / rho [J]
  // Since the start, where time is limited: the clock of the CPU costs as much as a small problem.
  double seconds() const { return std::isfinite(options_.max_seconds) ? cpu_seconds() - begin_ : 0; }
  // Figures of the best r.
  ProblemReport finish(const std::string& solver, std::int64_t iterations);

private:
  const double* best_velocity(); // W best + q

  const FrictionProblem& problem_;
  const ProblemOptions& options_;
  double* best_;
  Array<double> u_, w_nn_, speed_;
  bool unbounded();

  bool held_ = false, u_is_of_best_ = false;
  std::vector<std::int64_t> place_;
  double scale_ = 0, best_error_ = std::numeric_limits<double>::infinity(), last_error_ = 0, begin_ = 0;
  std::optional<ProblemStatus> status_;
  std::string hint_;
  std::chrono::steady_clock::time_point asked_;
};

// u = W r + q
void product(const FrictionProblem&, const double* r, double* u, int threads);

} // namespace cairn
