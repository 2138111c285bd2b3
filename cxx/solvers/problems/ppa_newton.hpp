// Proximal point method around Newton's method, in parts: its cost is known before it runs.
#pragma once
#include <limits>

#include "newton_step.hpp"
#include "scaled_problem.hpp"

namespace cairn {

class ProximalNewton {
public:
  // Finds the fill of the factors; r (dim, contacts) in and out, as a solver has it.
  ProximalNewton(const FrictionProblem&, const ProblemOptions&, double* r);
  // Approximate operations of one iteration, and memory of the factors.
  double operations() const { return newton_.operations(); }
  double bytes() const { return newton_.bytes(); }
  // How often it may fail to bring velocities right once the tolerance is met, which matters under heavy bodies.
  void settle_failures(int most) { settle_failures_ = most; }
  // Bounds the work on velocities once the tolerance is met. Errors below `far` get at most this share of the work so
  // far (`before`, and the iterations since). Larger errors get all work needed, if work as much as so far, at least
  // `trial` iterations, halves them.
  void settle_share(double share, double before, double far, double trial) {
    settle_share_ = share, before_ = before, far_ = far, settle_trial_ = trial;
  }
  // Leaves out the state in which every contact sticks: the caller knows that many slip.
  void begin_without_sticking() { sticks_first_ = false; }
  // Ends where the state in which every contact sticks is not near the answer.
  void go_on_if_sticking() { needs_sticking_ = true; }
  // Begins from impulses that sweeps found, and leaves to them again what fails twice.
  void go_on_from_sweeps() { follows_sweeps_ = true; }
  ProblemReport solve();
  // The same in turns: goes on from where the last turn ended, ends after the round in which so many iterations are
  // full, and never does more than `most`. The report is that of a solver that was stopped there; r holds the best
  // impulses so far.
  ProblemReport turn(std::int64_t iterations, std::int64_t most);

private:
  bool solve_around(double& error, int& steps);
  void begin();
  void run();
  void begin_sticking(double& error);
  void settle();
  void refine();
  double begin_with_sweeps();
  double error_of(const Array<double>& x);
  const FrictionProblem& given_;
  ScaledProblem scaled_;
  NewtonStep newton_;
  std::int64_t iterations_ = 0, pause_ = std::numeric_limits<std::int64_t>::max(), most_ = pause_;
  bool begun_ = false;
  double error_ = 0; // of the centre or of its solution
  int failures_ = 0, all_failures_ = 0, careful_ = 0, next_careful_ = 1;
  double alpha_ = 1e-2, smallest_; // of the proximal term, relative to the mean diagonal of W
  bool settling_ = false, needs_sticking_ = false, follows_sweeps_ = false;
  bool sticks_first_ = true;
  double settle_share_ = 0, before_ = 0, far_ = 0, settle_trial_ = 0;
  int settle_failures_ = 24;
  Array<double> centre_, r_, u_, shifted_;
  Array<double> velocity_; // of bodies, once refined
};

} // namespace cairn
