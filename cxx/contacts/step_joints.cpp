#include "step_joints.hpp"

#include <algorithm>

#include "../base/call.hpp"
#include "../solvers/sweeps/jointed_problem.hpp"
#include "joint_projection.hpp"
#include "joint_swing.hpp"

namespace cairn {

JointMiss StepJoints::miss(const Bodies& bodies, double least) { return drift_.miss(bodies, least); }
void StepJoints::keep() { drift_.keep(); }
void StepJoints::correct(double share) { drift_.correct(share); }
bool StepJoints::ease(const Bodies& bodies, bool settled) { return drift_.ease(bodies, settled); }
bool StepJoints::must_project() const { return projection_.is_due(); }
void StepJoints::projected() { memory_.joints_came = false; }
void StepJoints::choose_to_project(const Bodies& bodies) { projection_.choose(bodies); }
double StepJoints::violation() const { return projection_.violation(); }
bool StepJoints::project(const Bodies& bodies, Array<double>& velocity) {
  return projection_.find_velocities(bodies, velocity);
}
void StepJoints::loads(std::vector<JointLoad>& loads) const { swing_.loads(loads); }
double StepJoints::swing_across() const { return swing_.swing_across(); }

std::string StepJoints::name(std::int64_t contact) const {
  const std::string name = in_.laws->name(*in_.contactors->material[in_.candidates->contactor_a[contact]]);
  return name.substr(0, name.find(" (")); // its group has the same name
}

bool StepJoints::any() const { return JointedProblem::needed(system_); }

FrictionProblem StepJoints::problem(const Bodies& bodies) {
  if (const std::string obstacle = JointedProblem::obstacle(system_); !obstacle.empty())
    throw Error(obstacle + ": leave such laws out");
  const Array<cairn_record> record = system_.record; // as the stage at hand has them
  const Array<double> condensed = system_.condensed_velocity;
  const cairn_schedule schedule = system_.schedule(1);
  JointedProblem step(system_, schedule, in_.free(bodies));
  step.pose_all();
  const bool held = step.hold();
  if (held) step.form();
  std::copy(record.begin(), record.end(), system_.record.begin());
  std::copy(condensed.begin(), condensed.end(), system_.condensed_velocity.begin());
  if (!held) throw Error("joints of the step have no factors, masses or velocities are not finite: lower dt");
  return step.in_order();
}

} // namespace cairn
