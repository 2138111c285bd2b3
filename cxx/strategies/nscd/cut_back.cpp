// Bisection of steps in which Newton's method of a body fails: a cell turns inside out, a material has no stress or the
// balance does not converge. Such a step is undone and made in two halves, each halved again at most `cut_back` times.
// The remainder after a part is tried whole: after the hard part of a step the rest goes on in long parts, and the next
// step whole. Parts are full steps: contacts, materials, histories of integrators (derivatives, independent of the
// step) and networks advance from part to part.
#include <algorithm>
#include <string>

#include "../../base/call.hpp"
#include "../../files/simulation_state.hpp"
#include "nscd.hpp"

namespace cairn {

// StepLoads of a mesh at both ends of the whole step, on its degrees of freedom and as pressures.
struct StepLoads {
  std::vector<double> begin, end, pressure_begin, pressure_end;
};

namespace {

StepLoads loads_of(const MeshBody& mesh) {
  StepLoads out{mesh.loads.begin, mesh.loads.end, {}, {}};
  for (const PressedSides& sides : mesh.loads.pressed) {
    out.pressure_begin.push_back(sides.begin);
    out.pressure_end.push_back(sides.end);
  }
  return out;
}

// Loads on a part of the step, from one share of it to another, interpolated linearly.
void take_loads(MeshBody& mesh, const StepLoads& whole, double from, double to) {
  const auto at = [](double a, double b, double share) { return (1 - share) * a + share * b; };
  for (std::size_t i = 0; i < whole.end.size(); ++i) {
    mesh.loads.begin[i] = at(whole.begin[i], whole.end[i], from);
    mesh.loads.end[i] = at(whole.begin[i], whole.end[i], to);
  }
  for (std::size_t k = 0; k < mesh.loads.pressed.size(); ++k) {
    mesh.loads.pressed[k].begin = at(whole.pressure_begin[k], whole.pressure_end[k], from);
    mesh.loads.pressed[k].end = at(whole.pressure_begin[k], whole.pressure_end[k], to);
  }
}

} // namespace

struct Nscd::Whole {
  double begin = 0, h = 0;
  std::int64_t steps = 0;
  std::vector<StepLoads> loads; // of the meshes, if nothing else gives them
  int parts = 0, passes = 0;
  std::int64_t rotations = 0;
  double newton_error = 0;
  SolveReport worst; // of the parts
  LastViews views;   // of the step before
};

namespace {

bool worse(const SolveReport& a, const SolveReport& b) {
  const bool failed = a.status != SolveStatus::converged, other = b.status != SolveStatus::converged;
  return failed != other ? failed : a.error > b.error;
}

} // namespace

void Nscd::take_part(Simulation& s, double from, double share, int cuts, Whole& whole) {
  s.steps = whole.steps;
  s.time = whole.begin + from * whole.h;
  const double h = share * whole.h;
  if (s.before_part)
    s.before_part(h);
  else
    for (std::size_t k = 0; k < s.meshes.meshes.size(); ++k)
      take_loads(s.meshes.meshes[k], whole.loads[k], from, from + share);
  if (!s.held_motions.empty()) move_held(s, h);
  try {
    make_step(s, h);
  } catch (const StepTooLong&) {
    if (cuts == settings.cut_back) throw;
    take_part(s, from, share / 2, cuts + 1, whole);
    return take_part(s, from + share / 2, share / 2, cuts + 1, whole);
  }
  ++whole.parts;
  whole.passes += s.report.newton_passes;
  whole.rotations += s.report.unresolved_rotations;
  whole.newton_error = std::max(whole.newton_error, s.report.newton_error);
  const int iterations = whole.worst.iterations + s.report.solve.iterations;
  if (whole.parts == 1 || worse(s.report.solve, whole.worst)) whole.worst = s.report.solve;
  whole.worst.iterations = iterations;
}

const StepReport& Nscd::step_in_parts(Simulation& s, double h) {
  const StepReport before = s.report;
  const Attempt kept = attempt_;
  attempt_ = Attempt::in_parts;
  try {
    make_step(s, h);
    attempt_ = kept;
    return s.report;
  } catch (const StepTooLong&) { // in halves
  } catch (...) {
    attempt_ = kept;
    throw;
  }
  Whole whole{s.time, h, s.steps, {}, 0, 0, 0, 0, {}, views_};
  const StoredValue begin = state_of(s);
  for (const MeshBody& mesh : s.meshes.meshes) whole.loads.push_back(loads_of(mesh));
  const auto back = [&] {
    attempt_ = kept;
    take_state(s, begin);
    s.follow_meshes();
    for (std::size_t k = 0; k < whole.loads.size(); ++k) take_loads(s.meshes.meshes[k], whole.loads[k], 0, 1);
    views_ = whole.views; // forgotten with the contacts
    views_.show(s);
    s.report = before;
  };
  try {
    take_part(s, 0, 0.5, 1, whole);
    take_part(s, 0.5, 0.5, 1, whole);
  } catch (const StepTooLong& error) { // any other is none that shorter parts would mend
    back();
    throw Error(std::string(error.what()) + "; cut_back=" + std::to_string(settings.cut_back) +
                " halved the step as often, to no avail");
  } catch (...) {
    back();
    throw;
  }
  attempt_ = kept;
  if (!s.before_part)
    for (std::size_t k = 0; k < whole.loads.size(); ++k) take_loads(s.meshes.meshes[k], whole.loads[k], 0, 1);
  s.report.time = s.time = whole.begin + h;
  s.report.sub_steps = whole.parts;
  s.report.newton_passes = whole.passes;
  s.report.newton_error = whole.newton_error;
  s.report.unresolved_rotations = whole.rotations;
  s.report.solve = whole.worst;
  return s.report;
}

} // namespace cairn
