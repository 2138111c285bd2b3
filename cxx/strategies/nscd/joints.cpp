// Joint error at the configuration in which the next step detects (see joint_flight.cpp): further solutions correct the
// drift of the last one until it is small or decreases no more. Where tension swings light bodies faster than steps
// follow, a whole correction overshoots: then a share of it is taken, from the best solution so far.
#include "joints.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace cairn {
namespace {

// Warning with the error of the worst joint and a step that would resolve it; formatted on the stack, since a step
// allocates no other memory.
std::string hint_of(const JointMiss& left, const std::string& joint, double h, double tolerance) {
  constexpr double slow = 0.25; // of the square of step times rate, by which corrections gain three digits each
  char text[400];
  std::snprintf(text, sizeof text,
                "%s will be off by %.2e m, %.1e of its length (tol is %.1e): bodies turn about it, or swing under its "
                "tension, faster than the step follows; give a dt of at most %.1e s",
                joint.c_str(), left.gap, left.error, tolerance,
                h * std::min(0.5, std::sqrt(slow / std::max(left.swing, slow))));
  return text;
}

class ContactsOfSimulation final : public JointedContacts {
public:
  explicit ContactsOfSimulation(Simulation& s) : s_(s) {}
  SolveReport solve(const SolverOptions& options) override { return s_.interactions.solve(s_.scene.bodies, options); }
  JointMiss miss(double least) override { return s_.interactions.joints().miss(s_.scene.bodies, least); }
  void keep() override { s_.interactions.joints().keep(); }
  void correct(double share) override { s_.interactions.joints().correct(share); }
  bool ease(bool settled) override { return s_.interactions.joints().ease(s_.scene.bodies, settled); }
  std::string name(std::int64_t contact) override { return s_.interactions.joints().name(contact); }

private:
  Simulation& s_;
};

} // namespace

void hold_joints(Simulation& s, const SolverOptions& solver, double h, int spent) {
  ContactsOfSimulation contacts(s);
  hold_joints(contacts, s.report.solve, solver, h, spent);
}

void hold_joints(JointedContacts& contacts, SolveReport& report, const SolverOptions& solver, double h, int spent) {
  constexpr int most = 12;
  constexpr double least_share = 1.0 / 64;
  SolverOptions options = solver;
  int last = report.iterations;
  const auto again = [&](int limit) {
    const int before = report.iterations;
    options.max_iterations = limit;
    const bool by_newton = report.solver == std::string_view("newton_over_bodies");
    options.again = by_newton || options.again == 2 ? 2 : 1;
    report = contacts.solve(options);
    last = report.iterations;
    report.iterations += before;
  };
  const double tolerance = solver.tolerance;
  JointMiss best, miss;
  double share = 1;
  bool settled = false, at_best = true;
  for (int pass = 0; pass < most && share >= least_share && report.status == SolveStatus::converged; ++pass) {
    // unless converged, the error of the solver would be mistaken for drift of joints
    miss = contacts.miss(tolerance);
    // limits and ropes alone leave no miss: they are inequalities of the solver
    settled = miss.contact < 0 || (pass > 0 && miss.small);
    if (settled) break;
    at_best = pass == 0 || miss.gap < best.gap;
    if (at_best) {
      best = miss;
      contacts.keep();
      share = std::min(1.0, 2 * share);
    } else {
      share /= 4;
    }
    const int limit = solver.max_iterations - spent - report.iterations;
    if (limit < std::max(last, options.min_iterations)) break;
    contacts.correct(share);
    again(limit);
    at_best = false;
  }
  const auto limit = [&] {
    return std::max(solver.max_iterations - spent - report.iterations, options.min_iterations);
  };
  if (report.status == SolveStatus::converged && !settled && !at_best) {
    miss = contacts.miss(tolerance);
    if (!(miss.gap <= best.gap)) {
      contacts.correct(0);
      again(limit());
    }
  }
  if (report.status == SolveStatus::converged && contacts.ease(settled)) again(limit());
  if (!settled) miss = contacts.miss(tolerance);
  report.joint_error = miss.error;
  report.joint_gap = miss.gap;
  report.has_joint_error = miss.contact >= 0;
  report.joint_contact = miss.contact;
  if (miss.small || miss.error <= tolerance) return;
  report.joint_hint = hint_of(miss, contacts.name(miss.contact), h, tolerance);
  if (report.status != SolveStatus::converged) return;
  report.status = SolveStatus::iteration_limit;
  report.hint = report.joint_hint;
}

} // namespace cairn
