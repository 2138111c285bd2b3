// Joint error at the configuration in which the next step detects, and the seats of joints that came in.
#pragma once
#include <functional>

#include "../../solvers/solver_options.hpp"
#include "step_scheme.hpp"

namespace cairn {

// Contacts of a step with joints, as further solutions see them: those of a simulation, or of all ranks.
class JointedContacts {
public:
  virtual ~JointedContacts() = default;
  virtual SolveReport solve(const SolverOptions& options) = 0;
  virtual JointMiss miss(double least) = 0;
  virtual void keep() = 0;
  virtual void correct(double share) = 0;
  virtual bool ease(bool settled) = 0;
  virtual std::string name(std::int64_t contact) = 0;
};

// Further solutions correct the drift of joints that the last one leaves, after so many iterations of others.
void hold_joints(JointedContacts& contacts, SolveReport& report, const SolverOptions& solver, double h, int spent = 0);
void hold_joints(Simulation& s, const SolverOptions& solver, double h, int spent = 0);

// Joints that came in, and those of steps of another length, hold where contacts are detected before they are solved.
class JointSeats {
public:
  // Begins a step.
  void begin() { seated_ = false, work_ = 0; }
  // detect: contacts again, once bodies were moved.
  void seat(Simulation& s, double h, const std::function<void()>& detect);
  // Work of weight when bodies were moved [J].
  double work() const { return work_; }

private:
  bool seated_ = false; // in this step
  double work_ = 0;
  Array<double> velocity_; // that seats joints in a step
};

// Moves bodies by a step with these velocities.
void move_bodies(Simulation& s, const Array<double>& velocity, double h);

} // namespace cairn
