// Joints among the contacts of a step.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "../base/field.hpp"
#include "../solvers/solve_report.hpp"
#include "joint_miss.hpp"

namespace cairn {

class AssemblyInput;
class JointDrift;
class JointProjection;
class JointSwing;
struct Bodies;
struct ContactMemory;
struct ContactSystem;
struct FrictionProblem;

// Corrects, projects and measures joints, for the strategies.
class StepJoints {
public:
  StepJoints(const AssemblyInput& in, JointDrift& drift, JointProjection& projection, const JointSwing& swing,
             ContactMemory& memory, ContactSystem& system)
      : in_(in), drift_(drift), projection_(projection), swing_(swing), memory_(memory), system_(system) {}
  // Once a solution is there; small: no more than `least` of the speed of joints.
  JointMiss miss(const Bodies& bodies, double least);
  // Stores the biases for the next solution and the present position errors; then sets biases that correct a share of
  // these.
  void keep();
  void correct(double share);
  // After these; settled: they miss no more than they may. See joint_drift.hpp.
  bool ease(const Bodies& bodies, bool settled);
  std::string name(std::int64_t contact) const;

  // True if joints came in, or the step length changed, so that joints do not yet fit the place of detection. See
  // seat_joints.cpp.
  bool must_project() const;
  void projected();
  // Selects the joints to project, as assembled, before bodies are displaced.
  void choose_to_project(const Bodies& bodies);
  // Largest position error of these joints, as assembled, over that of rounding; 0 if below 1.
  double violation() const;
  // Velocities (3 | 6, bodies) that undo it in a step, the smallest in the metric of mass. False: there are none, or
  // they are more than those of the bodies. Impulses at hand are lost.
  bool project(const Bodies& bodies, Array<double>& velocity);

  // Loads by the impulses at hand, in the order of bodies; see joint_swing.hpp.
  void loads(std::vector<JointLoad>& loads) const;
  // Largest square of step times rate at which bars and ropes swing across their axis, beyond the implicit part.
  double swing_across() const;

  bool any() const; // joints are among the contacts
  // The contacts of a step among bodies that joints hold, each limit and motor of these as a contact after the others;
  // the impulses at hand stay. Throws Error where laws with a solution of their own are beside, or it has no factors.
  FrictionProblem problem(const Bodies& bodies);

private:
  const AssemblyInput& in_;
  JointDrift& drift_;
  JointProjection& projection_;
  const JointSwing& swing_;
  ContactMemory& memory_;
  ContactSystem& system_;
};

} // namespace cairn
