// Newton's method for a body with the stresses of a material, around the solution of its contacts. In the names of
// core_f90/integrators/linear_scheme.f90, with w = end_share and the history a of the integrator,
//   M (v - v0 - velocity a) + impulse (w F(q) + (1 - w) F(q0)) + impulse C v_d = impulse f + impulses of contacts,
//   q = q0 + h (share v + (1 - share) v0) + position a,
//   v_d = implicit v + (1 - implicit) v0 + damping_history a.
// The matrix is A = M + damping C + stiffness dF/dq. Without a history this is the theta-method (Jean 1999).
// Displacement jumps by contact impulses (position_1/h M^-1 H p) are a part of q (mesh_jumps.cpp), except where rigid
// parts turn: stresses are then evaluated anew at the end of the step.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "../base/stopwatch.hpp"
#include "../bodies/nodes.hpp"
#include "mesh_newton.hpp"

namespace cairn {

void MeshNewton::start(Nodes& nodes, double size) {
  const auto n = std::size_t(model_.dofs());
  for (std::vector<double>* v : {&step_.iterate, &stresses_.force_end, &stresses_.force_step, &trial_, &start_})
    v->resize(n);
  balance_.start();
  stresses_.way_beside.clear();
  history_.take(nodes);
  jumps_.start();
  stresses_.begin(size);
  tangent_known_ = false;
  error_before_ = std::numeric_limits<double>::infinity();
  goes_on_ = went_on_; // as the step before
  went_on_ = false;
  step_.iterate = step_.v;
  turn_iterate();
  if (step_.is_explicit()) {
    stresses_.predict();
  } else {
    stresses_.found = stresses_.evaluate(step_.iterate, true);
    if (!stresses_.found.ok()) { // as it stands at the begin of the step every cell is in order
      for (std::size_t i = 0; i < n; ++i) step_.iterate[i] = -(1 - step_.share()) / step_.share() * step_.v[i];
      for (std::size_t i = 0; i < history_.past.size(); ++i)
        step_.iterate[i] -= history_.past[i] / (step_.h() * step_.share());
      turn_iterate();
      stresses_.found = stresses_.evaluate(step_.iterate, true);
      if (!stresses_.found.ok()) stresses_.fail(stresses_.found, " at the begin of the step", stresses_.advice());
    }
  }
  find_free_velocity();
}

// Derivatives of velocity at the start, from M a = F - C v - F(q) and its derivatives under constant loads along the
// known part of the motion. They are differences of forces, exact for linear forces, over as much of a step as leaves
// all cells in order.
void MeshNewton::start_history(Nodes& nodes, const cairn_scheme& scheme) {
  constexpr int halvings = 4; // each multiplies the rounding of a third derivative by eight
  const auto n = std::size_t(model_.dofs());
  std::vector<double> at[5], known[2 + cairn_most_history], next(n), drag(n), speed(n);
  const auto force_at = [&](double time, std::vector<double>& out) {
    for (std::size_t i = 0; i < n; ++i) {
      double way = 0, more = 0; // of the displacement, of the velocity
      for (int k = 1 + cairn_most_history; k >= 1; --k) {
        way = (known[k].empty() ? way : known[k][i] + way) * time / k;
        if (k > 1) more = (known[k].empty() ? more : known[k][i] + more) * time / (k - 1);
      }
      step_.b[i] = known[0][i] + way;
      speed[i] = known[1][i] + more;
    }
    out.resize(n);
    return model_.bulk->evaluate(
        {step_.b.data(), speed.data(), loads_.time + time, scheme.h, 1, 0, nullptr, loads_.time}, out.data(), nullptr);
  };
  known[0] = step_.q;
  known[1] = step_.v;
  step_.f = step_.weight;
  for (std::size_t i = 0; i < n && !loads_.begin.empty(); ++i) step_.f[i] += loads_.begin[i];
  for (std::size_t i = 0; i < n && !loads_.pressed.empty(); ++i) step_.a[i] = model_.reference[i] + step_.q[i];
  for (PressedSides& sides : loads_.pressed)
    sides.press(model_.dim, step_.a.data(), sides.begin, step_.f.data(), model_.mass, 0, nullptr);
  for (int k = 0; k < cairn_most_history && nodes.history(k); ++k) {
    double time = scheme.h;
    BulkResult found;
    for (int turn = 0; turn <= halvings; ++turn, time /= 2) { // the k-th derivative by 1, 4, 3 or 4 points
      found = {};
      for (int p = 0; p < 5 && found.ok(); ++p)
        if ((k % 2 == 0 && (p == 2 || (k > 0 && p % 2 == 1))) || (k % 2 == 1 && p != 2))
          found = force_at((p - 2) * time, at[p]);
      if (found.ok()) break;
    }
    if (!found.ok()) stresses_.fail(found, " within two steps of its begin, as it moves there", ": give a smaller dt");
    if (matrices_.damps) matrices_.damping_times(known[k + 1].data(), drag.data());
    for (std::size_t i = 0; i < n; ++i) {
      double force = 0;
      if (k == 0) force = at[2][i];
      if (k == 1) force = (8 * (at[3][i] - at[1][i]) - (at[4][i] - at[0][i])) / (12 * time);
      if (k == 2) force = (at[3][i] - 2 * at[2][i] + at[1][i]) / (time * time);
      if (k == 3) force = (at[4][i] - 2 * at[3][i] + 2 * at[1][i] - at[0][i]) / (2 * time * time * time);
      next[i] = (k == 0 ? step_.f[i] : 0) - force - drag[i];
    }
    if (!model_.ties.rigid_parts_turn())
      equations_.solve_mass(next.data());
    else
      for (std::size_t i = 0; i < n; ++i)
        next[i] = model_.held[i] ? 0 : next[i] / matrices_.force_weight(std::int64_t(i));
    known[k + 2] = next;
    std::copy_n(next.begin(), n, nodes.history(k) + model_.dim * step_.first_node);
  }
}

void MeshNewton::find_free_velocity() {
  const auto n = std::size_t(model_.dofs());
  factors_.factorise_tangent(stresses_.tangent, !went_on_);
  const Stopwatch watch(&seconds_.balance);
  balance_.find_residual(step_.iterate);
  for (std::size_t i = 0; i < n; ++i)
    step_.free[i] = !model_.held[i] ? balance_.residual[i]
                                    : (loads_.held_velocity.empty() ? 0 : loads_.held_velocity[i]) - step_.iterate[i];
  factors_.solve(step_.free.data());
  for (std::size_t i = 0; i < n; ++i) step_.free[i] += step_.iterate[i];
  jumps_.add_known();
}

void MeshNewton::linearise(Nodes& nodes) {
  went_on_ = true;
  if (!tangent_known_) stresses_.found = stresses_.evaluate(step_.iterate, true);
  tangent_known_ = false;
  if (!stresses_.found.ok()) stresses_.fail(stresses_.found, "", "");
  find_free_velocity();
  step_.scatter(step_.free.data(), nodes.velocity_free);
}

// Stresses where a pass leads are wanted by its balance, and with their tangent by the next pass: both are found at
// once, unless the errors so far tell that none will follow.
NewtonError MeshNewton::judge(double tolerance) {
  const double assembled = seconds_.assembly;
  NewtonError out;
  {
    const Stopwatch watch(&seconds_.balance);
    out = find_change(goes_on_, tolerance);
    error_before_ = out.error;
  }
  seconds_.balance -= seconds_.assembly - assembled;
  goes_on_ = !(out.error * out.error <= tolerance); // errors become their squares
  return out;
}

NewtonError MeshNewton::find_change(bool with_tangent, double tolerance) {
  const auto n = std::size_t(model_.dofs());
  NewtonError out;
  if (step_.is_explicit()) return out;
  for (std::size_t i = 0; i < n; ++i) trial_[i] = model_.held[i] ? 0 : impulse_[i];
  factors_.respond(trial_.data());
  for (std::size_t i = 0; i < n; ++i) trial_[i] += step_.free[i] - step_.iterate[i]; // the change
  const std::size_t jumps = jumps_.by_impulses.size();                               // none, or of each dof
  std::vector<double>&jump_before = jump_before_, &jump_now = jump_now_;
  if (jumps > 0) {
    jump_before = jumps_.by_impulses;
    jump_now.assign(impulse_.begin(), impulse_.end());
    equations_.solve_mass(jump_now.data());
  }
  double before = 0; // of the balance with these impulses, by the inverse of A: the change solves it
  for (std::size_t i = 0; i < n; ++i)
    if (!model_.held[i]) before += trial_[i] * (balance_.residual[i] + impulse_[i]);
  std::vector<double>&change = trial_, &start = start_;
  start = step_.iterate;
  bool moved = false; // a held dof, whose change is no part of the balance
  for (std::size_t i = 0; i < n; ++i) moved = moved || (model_.held[i] && (change[i] < 0 || change[i] > 0));
  constexpr int halvings = 10;
  constexpr double small = 1e-6; // where rounding alone may be left
  double share = 1;
  for (int turn = 0; turn <= halvings; ++turn, share /= 2) {
    for (std::size_t i = 0; i < n; ++i) step_.iterate[i] = start[i] + share * change[i];
    for (std::size_t i = 0; i < jumps; ++i)
      jumps_.by_impulses[i] = jump_before[i] + share * (jump_now[i] - jump_before[i]);
    turn_iterate();
    tangent_known_ = with_tangent && turn == 0;
    out.fault = stresses_.evaluate(step_.iterate, tangent_known_);
    tangent_known_ = tangent_known_ && out.fault.ok();
    if (!out.fault.ok() && !model_.bulk->shorter_helps(out.fault)) break;
    if (!out.fault.ok()) continue;
    balance_.find_residual(step_.iterate);
    double scale = 0;
    const double left = balance_.measure(scale, out.node);
    out.error = left > 0 ? (scale > 0 ? left / scale : 1) : 0;
    // Newton's method gains no digit, or its error does not fall from pass to pass: there may be none
    if (out.error > tolerance && (left * left > 0.01 * before || out.error > 0.5 * error_before_)) {
      const double floor = balance_.rounding();
      if (left <= floor) out.error = std::min(out.error, std::numeric_limits<double>::epsilon() * left / floor);
    }
    stresses_.found = out.fault;
    out.whole = turn == 0;
    if (moved || out.error < small || left * left <= before * (1 - 1e-4 * share) || turn == halvings) return out;
  }
  if (!out.fault.ok()) {
    step_.iterate = start;
    if (jumps > 0) jumps_.by_impulses = jump_before;
    turn_iterate();
    out.error = 1;
    out.whole = false;
  }
  return out;
}

// Same as `account`, with the forces F of the stresses over the step. Work of the integrator, with other forces f, h'
// the impulse of a force of 1 N, v_m the mean of both velocities and s a the history's part of velocities:
//   (f - F - C v_d).(dq - h' v_m) - v_m.M s a + F.dq - (dU + D).
void MeshNewton::account(Nodes& nodes, const double* gravity) {
  const int dim = model_.dim;
  const std::int64_t n = model_.dofs();
  std::vector<double>&end = trial_, &inertia = balance_.norms;
  for (std::int64_t i = 0; i < n && !loads_.pressed.empty(); ++i) step_.f[i] += stresses_.press[i];
  step_.gather(nodes.velocity, end.data());
  stresses_.find_at_end(end);
  way_.resize(end.size());
  for (std::size_t i = 0; i < end.size(); ++i) way_[i] = stresses_.way_of(i, end[i]);
  stability_.watch(stresses_.force_begin, stresses_.force_end, way_);
  works_.taken.resize(end.size());
  work_ = {};
  balance_.damped_velocity(end);
  if (matrices_.damps) matrices_.damping_times(step_.a.data(), balance_.damping.data());
  for (std::int64_t i = 0; i < n; ++i) step_.a[i] = end[i] - step_.v[i];
  matrices_.multiply_mass(step_.a.data(), inertia.data());
  matrices_.multiply_mass(end.data(), step_.b.data());
  const bool keeps = !history_.kicked_past.empty();
  if (keeps) history_.kept_momentum(history_.momentum.data());
  for (std::int64_t i = 0; i < n; ++i) {
    const double way = stresses_.way_of(std::size_t(i), end[i]), elastic = stresses_.force_step[i];
    works_.taken[i] = elastic + balance_.damping[i];
    work_.elastic += way * elastic;
    work_.damping += way * balance_.damping[i];
    // the history brings momentum beside the forces, to the point masses as well
    const double known = keeps ? history_.momentum[i] : 0,
                 of_points = keeps ? matrices_.lumped[i] * history_.kicked_past[i] : 0;
    const double lumped = matrices_.lumped[i] * step_.a[i] - of_points;
    const double extra = (inertia[i] - known - lumped) / step_.scheme.impulse,
                 weight = matrices_.lumped[i] * gravity[i % dim];
    const double beyond = keeps ? jumps_.beyond_scheme[i] : 0;
    reaction_[i] =
        (inertia[i] - known - impulse_[i]) / step_.scheme.impulse - beyond + elastic + balance_.damping[i] - step_.f[i];
    const double mean = 0.5 * (end[i] + step_.v[i]);
    work_.inertia += way * extra;
    work_.kinetic_change += mean * (inertia[i] - matrices_.lumped[i] * step_.a[i]);
    work_.integrator +=
        (way - step_.scheme.impulse * mean) * extra - mean * (known - of_points + step_.scheme.impulse * beyond);
    if (model_.ties.bound(i))
      work_.binding += way * reaction_[i];
    else if (model_.held[i])
      work_.driven += way * reaction_[i];
    if (model_.ties.bound(i) &&
        !stresses_.way_beside.empty()) // what the jumps of impulses turned rigid parts by beside
      work_.integrator -=
          (stresses_.way_beside[i] - history_.past[i] - step_.scheme.position[0] / step_.h() * jumps_.all[i]) *
          reaction_[i];
    const double force = model_.held[i] || model_.ties.bound(i)
                             ? (lumped - impulse_[i]) / step_.scheme.impulse - beyond - weight
                             : step_.f[i] - elastic - balance_.damping[i] - weight - extra;
    nodes.force[step_.first_node][i] = force;
    work_.kinetic += 0.5 * end[i] * (step_.b[i] - matrices_.lumped[i] * end[i]);
  }
  work_.stored = stresses_.found.energy;
  work_.stored_change = stresses_.found.energy - stresses_.stored_begin;
  work_.material = stresses_.found.dissipated;
  work_.warmed = stresses_.warmed;
  // Work of the step's elastic forces beyond the stored and dissipated energy of the material (sums over its points) is
  // the integrator's: along the straight path of the step stresses themselves would work just that energy. The balance
  // at the nodes is in none of these terms.
  const double beyond = work_.elastic - work_.stored_change - work_.material;
  const bool told = model_.bulk->knows_energy() && model_.bulk->knows_dissipation();
  (told ? work_.integrator : work_.absorbed) += beyond;
  account_means(end);
}

// Rigid parts turn as a whole over the step, from velocities of the pass that are linear in their spins.
void MeshNewton::turn_iterate() {
  if (!model_.ties.rigid_parts_turn()) return;
  std::vector<double>&way = step_.a, &place = step_.b;
  const auto past = [&](std::size_t i) { return history_.past.empty() ? 0.0 : history_.past[i] / step_.h(); };
  for (std::size_t i = 0; i < step_.iterate.size(); ++i) {
    way[i] = step_.share() * step_.iterate[i] + (1 - step_.share()) * step_.v[i] + past(i);
    place[i] = model_.reference[i] + step_.q[i];
  }
  model_.ties.turn(way.data(), place.data(), step_.h());
  for (const std::int32_t node : model_.ties.rigid_node)
    for (int k = 0; k < model_.dim; ++k) {
      const auto i = std::size_t(model_.dim * node + k);
      step_.iterate[i] = (way[i] - past(i) - (1 - step_.share()) * step_.v[i]) / step_.share();
    }
}

// Works of a non-linear body, with internal forces at both ends.
void MeshNewton::account_means(const std::vector<double>& end) {
  work_.drag = work_.damping;
  if (!works_.weighs_an_end()) return;
  const std::size_t n = end.size();
  way_.resize(n);
  for (std::size_t i = 0; i < n; ++i) way_[i] = stresses_.way_of(i, end[i]);
  works_.find_loads_beyond(way_);
  works_.mean.resize(n);
  works_.drag.assign(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) works_.mean[i] = 0.5 * (step_.v[i] + end[i]);
  if (matrices_.damps) matrices_.damping_times(works_.mean.data(), works_.drag.data());
  for (std::size_t i = 0; i < n; ++i) works_.mean[i] = 0.5 * (stresses_.force_begin[i] + stresses_.force_end[i]);
  works_.account_means(way_);
}

double MeshNewton::smooth_change(std::int64_t i) const {
  const auto at = std::size_t(i);
  const double load = loads_.pressed.empty() ? step_.f[at] : step_.f[at] + stresses_.press[at];
  return step_.scheme.impulse * (load - balance_.damping[at] - stresses_.force_of(at)) / matrices_.force_weight(i);
}

} // namespace cairn
