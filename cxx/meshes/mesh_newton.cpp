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
#include "mesh_body.hpp"

namespace cairn {
namespace {

// |a| |x| times a factor, to out; a by the values of its lower triangle.
void add_sizes(const SparseMatrix& pattern, const std::vector<double>& value, double factor, const double* x,
               double* out) {
  for (std::int64_t column = 0; column < pattern.n; ++column)
    for (std::int64_t e = pattern.start[column]; e < pattern.start[column + 1]; ++e) {
      const std::int32_t row = pattern.row[e];
      const double size = factor * std::abs(value[std::size_t(e)]);
      out[row] += size * std::abs(x[column]);
      if (row != column) out[column] += size * std::abs(x[row]);
    }
}

} // namespace

BulkResult MeshBody::stresses_of(const std::vector<double>& v, bool tangent) {
  const std::int64_t n = model.dofs();
  if (tangent) {
    tangent_.resize(model.mass.value.size());
    std::fill(tangent_.begin(), tangent_.end(), 0.0);
  }
  for (std::int64_t i = 0; i < n; ++i) b_[i] = q_[i] + h_ * (share_ * v[i] + (1 - share_) * v_[i]);
  for (std::size_t i = 0; i < past_.size(); ++i) b_[i] += past_[i] + way_of_jumps(i);
  return stresses_there(v.data(), 1 / (h_ * share_), tangent);
}

// At displacements b_, where velocities are v and change with them by `rate`.
BulkResult MeshBody::stresses_there(const double* v, double rate, bool tangent) {
  const Stopwatch watch(tangent ? &newton_seconds.assembly : nullptr); // else a part of the balance
  const MeshMotion there{b_.data(), v, time + h_, h_, rate_share_, rate, by_energy_ ? q_.data() : nullptr, time};
  const BulkResult found = model.bulk->evaluate(there, force_end_.data(), tangent ? tangent_.data() : nullptr);
  if (found.ok() && !pressed.empty()) press(tangent ? tangent_.data() : nullptr);
  return found;
}

// Pressures at displacements b_, into press_; adds the symmetric part of their derivative to the tangent of stresses.
// The derivative is symmetric where the surface is closed or its rim is held.
void MeshBody::press(double* tangent) {
  const auto n = std::size_t(model.dofs());
  for (std::size_t i = 0; i < n; ++i) b_[i] += model.reference[i];
  press_ = press_begin_;
  for (PressedSides& sides : pressed)
    sides.press(model.dim, b_.data(), end_share_ * sides.end, press_.data(), model.mass, -sides.end, tangent);
}

double MeshBody::force_of(std::size_t i) const {
  if (explicit_) return force_step_[i];
  return by_energy_ ? force_end_[i] : end_weight_ * force_end_[i] + (1 - end_weight_) * force_begin_[i];
}

// Velocities that damping takes its forces of, at velocities v at the end of the step, into a_.
void MeshBody::damped_velocity(const std::vector<double>& v) {
  const double late = scheme_.implicit;
  for (std::size_t i = 0; i < v.size(); ++i) a_[i] = late * v[i] + (1 - late) * v_[i];
  for (std::size_t i = 0; i < damped_past_.size(); ++i) a_[i] += damped_past_[i] - undamped_jump(i);
}

// Residual of the balance at velocities v without contact impulses [N s], from the stresses at hand.
void MeshBody::residual_of(const std::vector<double>& v) {
  const std::int64_t n = model.dofs();
  for (std::int64_t i = 0; i < n; ++i) a_[i] = v[i] - v_[i];
  const bool turns = model.ties.rigid_parts_turn();
  for (std::size_t i = 0; i < kicked_past_.size() && !turns; ++i) a_[i] -= kicked_past_[i];
  multiply_mass(a_.data(), b_.data());
  for (std::size_t i = 0; i < kicked_past_.size() && turns; ++i)
    b_[i] -= force_weight(std::int64_t(i)) * kicked_past_[i];
  damped_velocity(v);
  if (damps_) damping_times(a_.data(), c_.data());
  for (std::int64_t i = 0; i < n; ++i) {
    const double load = pressed.empty() ? f_[i] : f_[i] + press_[i];
    residual_[i] = model.held[i] ? 0 : scheme_.impulse * (load - c_[i] - force_of(std::size_t(i))) - b_[i];
  }
}

// Takes from a scheme the time at which stresses are evaluated: end of the step, mean of both ends, or prediction.
void MeshBody::take_scheme(const cairn_scheme& scheme, bool check) {
  h_ = scheme.h;
  share_ = scheme.share;
  end_weight_ = scheme.end_share;
  explicit_ = !(scheme.stiffness > 0);
  by_energy_ = scheme.by_energy != 0;
  // of laws that see a rate: of the mean of the step where stresses are predicted, else that its ends have as their
  // mean
  rate_share_ = explicit_ ? 1 : (scheme.histories > 0 ? 0.5 : share_);
  if (explicit_ && model.ties.rigid_parts_turn())
    throw Error("rigid parts of the mesh '" + model.name +
                "' turn over a step, which explicit integrators do not know: give Theta(), or hold these nodes");
  if (share_ < 0.5 * (1 - 4 * std::numeric_limits<double>::epsilon()) && model.ties.rigid_parts_turn())
    throw Error(
        "rigid parts of the mesh '" + model.name +
        "' turn over a step, and what their velocities are beside a rigid motion would grow by gamma/beta - 1 a "
        "step of Newmark: give a beta of gamma/2 or more");
  if (const std::string why = by_energy_ ? model.bulk->not_by_energy(model.name) : ""; !why.empty())
    throw Error(why + ": DiscreteGradient is for hyperelastic materials at large strains in 3D, plane strain and round "
                      "an axis, without mean dilatation; give Theta(0.5)");
  const double asked = h_ / scheme.largest;
  if (check && std::isfinite(scheme.largest) && (checked_ < asked || checked_ > asked)) {
    check_step(scheme);
    checked_ = asked;
  }
}

// Adds the history to the displacement of the step, to the prediction for stresses, to damping and to velocities.
void MeshBody::take_history(Nodes& nodes) {
  const std::size_t n = scheme_.histories > 0 ? std::size_t(model.dofs()) : 0;
  way_beside_.clear();
  for (std::vector<double>* v : {&past_, &elastic_past_, &damped_past_, &kicked_past_}) v->resize(n);
  if (n == 0) {
    elastic_past_.assign(explicit_ ? std::size_t(model.dofs()) : 0, 0.0);
    return;
  }
  if (model.ties.rigid_parts_turn())
    find_kept_way(nodes);
  else
    history_sum(nodes, scheme_.position, past_.data());
  history_sum(nodes, scheme_.elastic, elastic_past_.data());
  history_sum(nodes, scheme_.damping_history, damped_past_.data());
  history_sum(nodes, scheme_.velocity, kicked_past_.data());
}

BulkResult MeshBody::forces_at_begin(double* force) {
  return model.bulk->evaluate({q_.data(), v_.data(), time, h_, rate_share_, 0, nullptr, time}, force, nullptr);
}

void MeshBody::start_newton(Nodes& nodes) {
  const auto n = std::size_t(model.dofs());
  for (std::vector<double>* v : {&iterate_, &force_end_, &force_step_, &residual_, &trial_, &start_, &c_}) v->resize(n);
  take_history(nodes);
  start_jumps();
  norms_.resize(8 * n);
  for (std::size_t i = 0; i < n && begun_ && !way_end_.empty(); ++i) // nodes may have been set elsewhere
    begun_ = std::abs(q_[i] - way_end_[i]) <= (undone_ ? 0 : 1e-6 * size_);
  double fastest = 0;
  for (const double v : velocity_end_) fastest = std::max(fastest, std::abs(v));
  for (std::size_t i = 0; i < velocity_end_.size() && begun_; ++i)
    begun_ = std::abs(v_[i] - velocity_end_[i]) <= 1e-12 * fastest;
  way_end_ = q_;
  undone_ = true; // unless it is committed
  warmed_ = 0;
  if (!begun_ || !model.bulk->swelling.empty()) { // swelling changes stresses since the end of the last step
    force_begin_.assign(n, 0.0);
    find_swelling_force();
    const Stopwatch watch(&newton_seconds.balance);
    found_ = forces_at_begin(force_end_.data());
    if (!found_.ok()) fail(found_, " at the begin of the step", "");
    force_begin_ = force_end_;
    const double stored = found_.energy + found_.dissipated;
    if (begun_) warmed_ = stored - stored_begin_;
    stored_begin_ = stored;
    begun_ = true;
  }
  if (!pressed.empty()) {
    press_begin_.assign(n, 0.0);
    for (std::size_t i = 0; i < n; ++i) a_[i] = model.reference[i] + q_[i];
    end_share_ = scheme_.end_share;
    for (PressedSides& sides : pressed)
      sides.press(model.dim, a_.data(), (1 - end_share_) * sides.begin, press_begin_.data(), model.mass, 0, nullptr);
    press_ = press_begin_;
  }
  tangent_known_ = false;
  error_before_ = std::numeric_limits<double>::infinity();
  goes_on_ = went_on_; // as the step before
  went_on_ = false;
  iterate_ = v_;
  turn_iterate();
  if (explicit_) {
    predict_force();
  } else {
    found_ = stresses_of(iterate_, true);
    if (!found_.ok()) { // as it stands at the begin of the step every cell is in order
      for (std::size_t i = 0; i < n; ++i) iterate_[i] = -(1 - share_) / share_ * v_[i];
      for (std::size_t i = 0; i < past_.size(); ++i) iterate_[i] -= past_[i] / (h_ * share_);
      turn_iterate();
      found_ = stresses_of(iterate_, true);
      if (!found_.ok()) fail(found_, " at the begin of the step", advice());
    }
  }
  find_free_velocity();
}

// Internal force of an explicit integrator: at the begin of the step, or where the step is predicted to lead.
void MeshBody::predict_force() {
  force_step_ = force_begin_;
  if (!(end_weight_ > 0)) return;
  for (std::size_t i = 0; i < b_.size(); ++i)
    b_[i] = q_[i] + (scheme_.elastic_velocity * v_[i] + elastic_past_[i]) / end_weight_;
  found_ = stresses_there(v_.data(), 0, false);
  if (!found_.ok()) fail(found_, " where the step is predicted to lead", ": give a smaller dt");
  for (std::size_t i = 0; i < b_.size(); ++i)
    force_step_[i] = end_weight_ * force_end_[i] + (1 - end_weight_) * force_begin_[i];
}

// Part of the internal forces that free strains make, at the begin of the step [N]: a body that swelled freely has no
// stress left, but its balance still has terms of this size, to which errors are relative.
void MeshBody::find_swelling_force() {
  swelling_force_.clear();
  if (model.bulk->swelling.empty()) return;
  std::vector<double> swelling;
  swelling.swap(model.bulk->swelling);
  swelling_force_.resize(std::size_t(model.dofs()));
  const BulkResult plain = forces_at_begin(swelling_force_.data());
  swelling.swap(model.bulk->swelling);
  if (plain.ok()) forces_at_begin(force_end_.data());
  for (std::size_t i = 0; i < swelling_force_.size(); ++i)
    swelling_force_[i] = plain.ok() ? swelling_force_[i] - force_end_[i] : 0;
}

// Derivatives of velocity at the start, from M a = F - C v - F(q) and its derivatives under constant loads along the
// known part of the motion. They are differences of forces, exact for linear forces, over as much of a step as leaves
// all cells in order.
void MeshBody::start_bulk_history(Nodes& nodes, const double* gravity, const cairn_scheme& scheme) {
  constexpr int halvings = 4; // each multiplies the rounding of a third derivative by eight
  const auto n = std::size_t(model.dofs());
  std::vector<double> at[5], known[2 + cairn_most_history], next(n), drag(n), speed(n);
  const auto force_at = [&](double time, std::vector<double>& out) {
    for (std::size_t i = 0; i < n; ++i) {
      double way = 0, more = 0; // of the displacement, of the velocity
      for (int k = 1 + cairn_most_history; k >= 1; --k) {
        way = (known[k].empty() ? way : known[k][i] + way) * time / k;
        if (k > 1) more = (known[k].empty() ? more : known[k][i] + more) * time / (k - 1);
      }
      b_[i] = known[0][i] + way;
      speed[i] = known[1][i] + more;
    }
    out.resize(n);
    return model.bulk->evaluate({b_.data(), speed.data(), this->time + time, scheme.h, 1, 0, nullptr, this->time},
                                out.data(), nullptr);
  };
  known[0] = q_;
  known[1] = v_;
  weigh(gravity);
  f_ = weight_;
  for (std::size_t i = 0; i < n && !load_begin.empty(); ++i) f_[i] += load_begin[i];
  for (std::size_t i = 0; i < n && !pressed.empty(); ++i) a_[i] = model.reference[i] + q_[i];
  for (PressedSides& sides : pressed) sides.press(model.dim, a_.data(), sides.begin, f_.data(), model.mass, 0, nullptr);
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
    if (!found.ok()) fail(found, " within two steps of its begin, as it moves there", ": give a smaller dt");
    if (damps_) damping_times(known[k + 1].data(), drag.data());
    for (std::size_t i = 0; i < n; ++i) {
      double force = 0;
      if (k == 0) force = at[2][i];
      if (k == 1) force = (8 * (at[3][i] - at[1][i]) - (at[4][i] - at[0][i])) / (12 * time);
      if (k == 2) force = (at[3][i] - 2 * at[2][i] + at[1][i]) / (time * time);
      if (k == 3) force = (at[4][i] - 2 * at[3][i] + 2 * at[1][i] - at[0][i]) / (2 * time * time * time);
      next[i] = (k == 0 ? f_[i] : 0) - force - drag[i];
    }
    if (!model.ties.rigid_parts_turn())
      solve_mass(next.data());
    else
      for (std::size_t i = 0; i < n; ++i) next[i] = model.held[i] ? 0 : next[i] / force_weight(std::int64_t(i));
    known[k + 2] = next;
    std::copy_n(next.begin(), n, nodes.history(k) + model.dim * first_node);
  }
}

void MeshBody::find_free_velocity() {
  const auto n = std::size_t(model.dofs());
  factorise_tangent();
  const Stopwatch watch(&newton_seconds.balance);
  residual_of(iterate_);
  for (std::size_t i = 0; i < n; ++i)
    free_[i] = !model.held[i] ? residual_[i] : (held_velocity.empty() ? 0 : held_velocity[i]) - iterate_[i];
  solve(free_.data());
  for (std::size_t i = 0; i < n; ++i) free_[i] += iterate_[i];
  add_known_jumps();
}

void MeshBody::linearise(Nodes& nodes) {
  went_on_ = true;
  if (!tangent_known_) found_ = stresses_of(iterate_, true);
  tangent_known_ = false;
  if (!found_.ok()) fail(found_, "", "");
  find_free_velocity();
  scatter(free_.data(), nodes.velocity_free);
}

void MeshBody::factorise_tangent() {
  const Stopwatch watch(&newton_seconds.factorisation);
  if (!own_) {
    own_ = std::make_unique<Factors>();
    own_->soe = make_soe();
    own_->value.resize(model.mass.value.size());
  }
  now_ = own_.get();
  if (const double share = jump_share(scheme_); has_part(share - now_->mixed)) {
    now_->forget(model.nodes());
    now_->mixed = share;
  }
  const bool fresh = now_->place.empty();
  if (fresh || (!by_units() && (!went_on_ || !model.ties.empty()))) // bits depend on when nodes were touched
    now_->forget(model.nodes());
  const auto with = [&](const std::vector<double>& stiffness) {
    bool same = now_->known && !model.ties.rigid_parts_turn();
    for (std::size_t e = 0; e < now_->value.size(); ++e) {
      const double a =
          explicit_ ? model.mass.value[e] + scheme_.damping * model.damping.value[e]
                    : model.mass.value[e] + scheme_.damping * model.damping.value[e] + scheme_.stiffness * stiffness[e];
      same = same && a == now_->value[e];
      now_->value[e] = a;
    }
    if (same) return SoeStatus{}; // to the bit, as of Hooke's law at small strains, or an explicit integrator
    ++factorisations;
    now_->forget(model.nodes());
    const SoeStatus found = factor(*now_->soe, now_->value.data());
    now_->known = bool(found);
    return found;
  };
  SoeStatus status = with(explicit_ ? model.stiffness.value : tangent_);
  // where the material softens, the stiffness at the start is a direction that goes down
  if (!status && !explicit_) status = with(model.stiffness.value);
  if (status) return;
  try {
    refuse(status);
  } catch (const Error& error) { throw StepTooLong(error.what()); }
}

// Stresses where a pass leads are wanted by its balance, and with their tangent by the next pass: both are found at
// once, unless the errors so far tell that none will follow.
NewtonError MeshBody::judge(double tolerance) {
  const double assembled = newton_seconds.assembly;
  NewtonError out;
  {
    const Stopwatch watch(&newton_seconds.balance);
    out = find_change(goes_on_, tolerance);
    error_before_ = out.error;
  }
  newton_seconds.balance -= newton_seconds.assembly - assembled;
  goes_on_ = !(out.error * out.error <= tolerance); // errors become their squares
  return out;
}

// Square of the forces at held dofs, by the inverse of the diagonal of A: scale of the balance where a body is
// stretched between supports, so that forces of its cells cancel at every free node to rounding. The diagonal is finite
// at held dofs too, and its norm is at most a few times that by the inverse of A.
double MeshBody::borne_by_held() const {
  double out = 0;
  for (std::size_t i = 0; i < model.held.size(); ++i) {
    if (!model.held[i]) continue;
    const double force = scheme_.impulse * (c_[i] + force_of(i)), weight = on_diagonal(now_->value, std::int64_t(i));
    if (weight > 0) out += force * force / weight; // softening may leave none there
  }
  return out;
}

// Rounding error of the residual at the iterate, by the inverse of A: rounding of velocities and of displacements,
// which for a body moving as a whole is all of its internal forces.
double MeshBody::rounding() {
  const auto n = std::size_t(model.dofs());
  double *x = norms_.data(), *size = x + n, *right = size + n;
  std::fill_n(size, n, 0.0);
  for (std::size_t i = 0; i < n; ++i) x[i] = std::abs(iterate_[i]) + std::abs(v_[i]);
  add_sizes(model.mass, now_->value, 1, x, size);
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = q_[i] + h_ * (share_ * iterate_[i] + (1 - share_) * v_[i]);
    if (!past_.empty()) x[i] += past_[i];
  }
  const std::vector<double>& stiffness = tangent_.empty() ? model.stiffness.value : tangent_;
  add_sizes(model.mass, stiffness, scheme_.impulse, x, size);
  for (std::size_t i = 0; i < n; ++i) right[i] = size[i] = model.held[i] ? 0 : size[i];
  solve(size);
  double square = 0;
  for (std::size_t i = 0; i < n; ++i) square += size[i] * right[i];
  return std::numeric_limits<double>::epsilon() * std::sqrt(std::max(square, 0.0));
}

// Residual of the balance at the iterate by the inverse of A, the scale of its terms, to which errors are relative, and
// `node` with the largest residual.
double MeshBody::measure_balance(double& scale, std::int64_t& node) {
  const auto n = std::size_t(model.dofs());
  const bool swells = !swelling_force_.empty();
  const std::size_t terms = swells ? 4 : 3;
  for (std::size_t i = 0; i < n; ++i) {
    const bool held = model.held[i];
    norms_[i] = held ? 0 : residual_[i] + impulse[i];
    norms_[n + i] = held ? 0 : b_[i];
    norms_[2 * n + i] = held ? 0 : scheme_.impulse * (c_[i] + force_of(i));
    if (swells) norms_[3 * n + i] = held ? 0 : scheme_.impulse * swelling_force_[i];
  }
  std::copy_n(norms_.begin(), terms * n, norms_.begin() + std::ptrdiff_t(terms * n));
  solve(norms_.data(), std::int64_t(terms));
  double size[4] = {0, 0, 0, 0}, worst = 0;
  for (std::size_t k = 0; k < terms; ++k) {
    for (std::size_t i = 0; i < n; ++i) size[k] += norms_[k * n + i] * norms_[(terms + k) * n + i];
    size[k] = std::sqrt(std::max(size[k], 0.0));
  }
  for (std::size_t i = 0; i < n; ++i)
    if (const double w = norms_[i] * norms_[terms * n + i]; w > worst) worst = w, node = std::int64_t(i) / model.dim;
  scale = std::max(size[1] + size[2] + size[3], std::sqrt(borne_by_held()));
  return size[0];
}

NewtonError MeshBody::find_change(bool with_tangent, double tolerance) {
  const auto n = std::size_t(model.dofs());
  NewtonError out;
  if (explicit_) return out;
  for (std::size_t i = 0; i < n; ++i) trial_[i] = model.held[i] ? 0 : impulse[i];
  respond(trial_.data());
  for (std::size_t i = 0; i < n; ++i) trial_[i] += free_[i] - iterate_[i]; // the change
  const std::size_t jumps = impulse_jump_.size();                          // none, or of each dof
  std::vector<double>&jump_before = known_, &jump_now = responding_;
  if (jumps > 0) {
    jump_before = impulse_jump_;
    jump_now.assign(impulse.begin(), impulse.end());
    solve_mass(jump_now.data());
  }
  double before = 0; // of the balance with these impulses, by the inverse of A: the change solves it
  for (std::size_t i = 0; i < n; ++i)
    if (!model.held[i]) before += trial_[i] * (residual_[i] + impulse[i]);
  std::vector<double>&change = trial_, &start = start_;
  start = iterate_;
  bool moved = false; // a held dof, whose change is no part of the balance
  for (std::size_t i = 0; i < n; ++i) moved = moved || (model.held[i] && (change[i] < 0 || change[i] > 0));
  constexpr int halvings = 10;
  constexpr double small = 1e-6; // where rounding alone may be left
  double share = 1;
  for (int turn = 0; turn <= halvings; ++turn, share /= 2) {
    for (std::size_t i = 0; i < n; ++i) iterate_[i] = start[i] + share * change[i];
    for (std::size_t i = 0; i < jumps; ++i) impulse_jump_[i] = jump_before[i] + share * (jump_now[i] - jump_before[i]);
    turn_iterate();
    tangent_known_ = with_tangent && turn == 0;
    out.fault = stresses_of(iterate_, tangent_known_);
    tangent_known_ = tangent_known_ && out.fault.ok();
    if (!out.fault.ok() && !model.bulk->shorter_helps(out.fault)) break;
    if (!out.fault.ok()) continue;
    residual_of(iterate_);
    double scale = 0;
    const double left = measure_balance(scale, out.node);
    out.error = left > 0 ? (scale > 0 ? left / scale : 1) : 0;
    // Newton's method gains no digit, or its error does not fall from pass to pass: there may be none
    if (out.error > tolerance && (left * left > 0.01 * before || out.error > 0.5 * error_before_)) {
      const double floor = rounding();
      if (left <= floor) out.error = std::min(out.error, std::numeric_limits<double>::epsilon() * left / floor);
    }
    found_ = out.fault;
    out.whole = turn == 0;
    if (moved || out.error < small || left * left <= before * (1 - 1e-4 * share) || turn == halvings) return out;
  }
  if (!out.fault.ok()) {
    iterate_ = start;
    if (jumps > 0) impulse_jump_ = jump_before;
    turn_iterate();
    out.error = 1;
    out.whole = false;
  }
  return out;
}

// Same as `account`, with the forces F of the stresses over the step. Work of the integrator, with other forces f, h'
// the impulse of a force of 1 N, v_m the mean of both velocities and s a the history's part of velocities:
//   (f - F - C v_d).(dq - h' v_m) - v_m.M s a + F.dq - (dU + D).
void MeshBody::account_bulk(Nodes& nodes, const double* gravity) {
  const int dim = model.dim;
  const std::int64_t n = model.dofs();
  std::vector<double>&end = trial_, &inertia = norms_;
  for (std::int64_t i = 0; i < n && !pressed.empty(); ++i) f_[i] += press_[i];
  gather(nodes.velocity, end.data());
  find_stresses_at_end(end);
  watch_stability();
  taken_.resize(end.size());
  work = {};
  damped_velocity(end);
  if (damps_) damping_times(a_.data(), c_.data());
  for (std::int64_t i = 0; i < n; ++i) a_[i] = end[i] - v_[i];
  multiply_mass(a_.data(), inertia.data());
  multiply_mass(end.data(), b_.data());
  const bool keeps = !kicked_past_.empty();
  if (keeps) kept_momentum(momentum_known_.data());
  for (std::int64_t i = 0; i < n; ++i) {
    const double way = way_of(std::size_t(i), end[i]), elastic = force_step_[i];
    taken_[i] = elastic + c_[i];
    work.elastic += way * elastic;
    work.damping += way * c_[i];
    // the history brings momentum beside the forces, to the point masses as well
    const double known = keeps ? momentum_known_[i] : 0, of_points = keeps ? lumped_[i] * kicked_past_[i] : 0;
    const double lumped = lumped_[i] * a_[i] - of_points;
    const double extra = (inertia[i] - known - lumped) / scheme_.impulse, weight = lumped_[i] * gravity[i % dim];
    const double beyond = keeps ? borne_[i] : 0;
    reaction[i] = (inertia[i] - known - impulse[i]) / scheme_.impulse - beyond + elastic + c_[i] - f_[i];
    const double mean = 0.5 * (end[i] + v_[i]);
    work.inertia += way * extra;
    work.kinetic_change += mean * (inertia[i] - lumped_[i] * a_[i]);
    work.integrator += (way - scheme_.impulse * mean) * extra - mean * (known - of_points + scheme_.impulse * beyond);
    if (model.ties.bound(i))
      work.binding += way * reaction[i];
    else if (model.held[i])
      work.driven += way * reaction[i];
    if (model.ties.bound(i) && !way_beside_.empty()) // what the jumps of impulses turned rigid parts by beside
      work.integrator -= (way_beside_[i] - past_[i] - scheme_.position[0] / h_ * jump_[i]) * reaction[i];
    const double force = model.held[i] || model.ties.bound(i)
                             ? (lumped - impulse[i]) / scheme_.impulse - beyond - weight
                             : f_[i] - elastic - c_[i] - weight - extra;
    nodes.force[first_node][i] = force;
    work.kinetic += 0.5 * end[i] * (b_[i] - lumped_[i] * end[i]);
  }
  work.stored = found_.energy;
  work.stored_change = found_.energy - stored_begin_;
  work.material = found_.dissipated;
  work.warmed = warmed_;
  // Work of the step's elastic forces beyond the stored and dissipated energy of the material (sums over its points) is
  // the integrator's: along the straight path of the step stresses themselves would work just that energy. The balance
  // at the nodes is in none of these terms.
  const double beyond = work.elastic - work.stored_change - work.material;
  const bool told = model.bulk->knows_energy() && model.bulk->knows_dissipation();
  (told ? work.integrator : work.absorbed) += beyond;
  account_bulk_means(end);
}

void MeshBody::commit() {
  if (linear()) return;
  way_end_.resize(q_.size());
  for (std::size_t i = 0; i < q_.size(); ++i) way_end_[i] = q_[i] + way_of(i, iterate_[i]);
  force_begin_ = force_end_;
  begun_ = begun_ && !by_energy_; // stresses by energy are none of the end of the step
  stored_begin_ = found_.energy;
  if (!model.bulk->solid()) velocity_end_ = trial_; // as `account` has it: forces of another code may depend on it
  model.bulk->commit();
  undone_ = false;
}

void MeshBody::roll_back() {
  if (!linear()) model.bulk->rollback();
}

void MeshBody::keep(Shown& to) const {
  to.impulse = impulse;
  to.reaction = reaction;
  if (linear()) return;
  const std::span<const double> stress = model.bulk->shown();
  to.stress.assign(stress.begin(), stress.end());
}

void MeshBody::show(const Shown& from) {
  impulse = from.impulse;
  reaction = from.reaction;
  if (!linear()) std::copy(from.stress.begin(), from.stress.end(), model.bulk->shown().begin());
}

std::vector<double> MeshBody::memory() const {
  if (!begun_) return {};
  std::vector<double> out = force_begin_;
  out.push_back(stored_begin_);
  return out;
}

void MeshBody::restore(std::span<const double> state, std::span<const double> memory) {
  const std::int64_t states = linear() ? 0 : model.bulk->history_size(), forces = model.dofs() + 1;
  const bool fits = states < 0 || std::int64_t(state.size()) == states;
  if (!fits || (!memory.empty() && (linear() || std::int64_t(memory.size()) != forces)))
    throw Error("the state of the mesh '" + model.name + "' holds " + std::to_string(state.size()) + " and " +
                std::to_string(memory.size()) + " numbers: it has " + std::to_string(states) + " and " +
                std::to_string(forces) + "; give the file of this scene");
  if (linear()) return;
  model.bulk->take_history(state);
  begun_ = !memory.empty();
  way_end_.clear();
  velocity_end_.clear();
  undone_ = false;
  if (!begun_) return;
  force_begin_.assign(memory.begin(), memory.end() - 1);
  stored_begin_ = memory.back();
}

void MeshBody::forget() {
  if (linear()) return;
  model.bulk->forget_history();
  begun_ = false;
  way_end_.clear();
  velocity_end_.clear();
}

} // namespace cairn
