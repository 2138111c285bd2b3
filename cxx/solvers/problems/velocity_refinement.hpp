// Refinement of the last digits of velocities where heavy bodies lie on light ones. Impulses through a light body are
// so large beside its own momentum that their rounding throws it about: so Newton steps are also added to the
// velocities of bodies, which keep digits that r cannot hold (iterative refinement; Wilkinson 1963). The proximal term,
// which keeps the digits of a step, leaves the few modes of moving heavy bodies far from solved: the combination of all
// steps with the smallest violation of the law resolves each in one step (Saad 1993; for nonlinear functions Anderson
// 1965).
#pragma once
#include <vector>

#include "newton_step.hpp"
#include "problem_monitor.hpp"

namespace cairn {

class VelocityRefinement {
public:
  // A problem over bodies; unit: see measure_light.
  VelocityRefinement(const FrictionProblem& p, ProblemMonitor& monitor, NewtonStep& newton, const double* unit)
      : p_(p), monitor_(monitor), newton_(newton), unit_(unit) {}

  // From impulses r whose error is small enough.
  void run(const Array<double>& r, std::int64_t& iterations, std::int64_t most);
  const Array<double>& impulses() const { return best_.r; }
  // changes of velocity of bodies
  const Array<double>& velocities() const { return best_.v; }

private:
  struct Point {
    // impulses; how they and the velocities of bodies changed from the first point; u = H'v + q, by how much it breaks
    // the law
    Array<double> r, more, v, u, broken;
  };
  double measure(Point&);   // u, broken and the error of light bodies, from r and v; infinity: see agree
  bool agree(const Point&); // whether velocities are those of the impulses
  bool step(const Point& from, double alpha, Point& to);
  void combine(Point& newest); // with the points before, so that the law is broken least
  const FrictionProblem& p_;
  ProblemMonitor& monitor_;
  NewtonStep& newton_;
  const double* unit_;
  std::vector<Point> points_;
  Array<double> begin_;            // impulses
  Array<double> impulses_, slack_; // (dofs, bodies) of contacts, sums of their sizes
  Point best_;
};

} // namespace cairn
