// Newton's method of a body whose stresses are those of a material, round the solution of its contacts:
//   M (v - v0) + h (theta F(q) + (1 - theta) F(q0)) + h C (theta v + (1 - theta) v0) = h f + impulses,
//   q = q0 + h (theta v + (1 - theta) v0),   A = M + h theta C + h^2 theta^2 dF/dq   (Jean 1999).
#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "../fe/bulk_model.hpp"
#include "mesh_body.hpp"
#include "nodes.hpp"

namespace cairn {

std::string MeshBody::describe(const BulkResult& fault) const {
  return "the mesh '" + model.name + "': " + model.bulk->describe(fault);
}

BulkResult MeshBody::stresses_of(const std::vector<double>& v, bool tangent) {
  const std::int64_t n = model.dofs();
  if (tangent) {
    tangent_.resize(model.mass.value.size());
    std::fill(tangent_.begin(), tangent_.end(), 0.0);
  }
  for (std::int64_t i = 0; i < n; ++i) b_[i] = q_[i] + h_ * (theta_ * v[i] + (1 - theta_) * v_[i]);
  const BulkResult found = model.bulk->evaluate(b_.data(), h_, theta_, force_end_.data(),
                                                tangent ? tangent_.data() : nullptr, by_energy_ ? q_.data() : nullptr);
  if (found.ok() && !pressed.empty()) press(tangent ? tangent_.data() : nullptr);
  return found;
}

// Pressures on the sides where displacements b_ bring them, into press_: with the tangent of stresses what it lacks by
// them, by its symmetric part, which is all of it where the surface is closed or its rim is held.
void MeshBody::press(double* tangent) {
  const auto n = std::size_t(model.dofs());
  for (std::size_t i = 0; i < n; ++i) b_[i] += model.reference[i];
  press_ = press_begin_;
  for (PressedSides& sides : pressed)
    sides.press(model.dim, b_.data(), end_share_ * sides.end, press_.data(), model.mass,
                -end_share_ / theta_ * sides.end, tangent);
}

double MeshBody::force_of(std::size_t i) const {
  if (explicit_) return force_begin_[i];
  return by_energy_ ? force_end_[i] : theta_ * force_end_[i] + (1 - theta_) * force_begin_[i];
}

// What is left of the balance at velocities v, without impulses of contacts, from the stresses there.
void MeshBody::residual_of(const std::vector<double>& v) {
  const std::int64_t n = model.dofs();
  for (std::int64_t i = 0; i < n; ++i) a_[i] = v[i] - v_[i];
  multiply_mass(a_.data(), b_.data());
  for (std::int64_t i = 0; i < n; ++i) a_[i] = explicit_ ? v_[i] : theta_ * v[i] + (1 - theta_) * v_[i];
  if (damps_) damping_times(a_.data(), c_.data());
  for (std::int64_t i = 0; i < n; ++i) {
    const double load = pressed.empty() ? f_[i] : f_[i] + press_[i];
    residual_[i] = model.held[i] ? 0 : h_ * (load - c_[i] - force_of(std::size_t(i))) - b_[i];
  }
}

// Rigid parts turn as a whole over the step, from velocities of the pass that are linear in their spins.
void MeshBody::turn_iterate() {
  if (!model.ties.rigid_parts_turn()) return;
  std::vector<double>&way = a_, &place = b_;
  for (std::size_t i = 0; i < iterate_.size(); ++i) {
    way[i] = theta_ * iterate_[i] + (1 - theta_) * v_[i];
    place[i] = model.reference[i] + q_[i];
  }
  model.ties.turn(way.data(), place.data(), h_);
  for (const std::int32_t node : model.ties.rigid_node)
    for (int k = 0; k < model.dim; ++k) {
      const auto i = std::size_t(model.dim * node + k);
      iterate_[i] = (way[i] - (1 - theta_) * v_[i]) / theta_;
    }
}

// Stresses of a material are known at the ends of a step: of the integrators these take what balances there.
void MeshBody::take_scheme(const cairn_scheme& scheme, bool check) {
  const bool theta = scheme.damping == scheme.h * scheme.share && scheme.stiffness > 0;
  const bool bare = !(scheme.damping > 0) && !(scheme.stiffness > 0) && !(scheme.elastic_velocity > 0);
  if (scheme.histories > 0 || !(theta || bare))
    throw Error("the mesh '" + model.name +
                "' is of a material of solids, which moves by the theta-method or by central differences: leave the "
                "integrator out, or give CentralDifference()");
  h_ = scheme.h;
  theta_ = scheme.share;
  explicit_ = bare;
  by_energy_ = scheme.by_energy != 0;
  if (explicit_ && model.ties.rigid_parts_turn())
    throw Error("rigid parts of the mesh '" + model.name +
                "' turn over a step, which central differences do not know: give Theta(), or hold these nodes");
  if (const std::int64_t block = by_energy_ ? model.bulk->not_by_energy() : -1; block >= 0) {
    const BulkCells& c = model.bulk->cells()[std::size_t(block)];
    throw Error("the " + std::string(c.element->cell) + " cells of the mesh '" + model.name + "' are of " +
                c.material->python_name +
                (c.material->state.empty() && !c.material->umat
                     ? std::string(c.mean_dilatation ? " with mean dilatation" : " in plane stress")
                     : std::string(", which keeps more than an energy")) +
                ": DiscreteGradient is for hyperelastic materials at large strains in 3D, plane strain and round an "
                "axis, without mean dilatation; give Theta(0.5)");
  }
  if (explicit_ && check && std::isfinite(scheme.largest) && (checked_ < h_ || checked_ > h_)) {
    check_step(scheme);
    checked_ = h_;
  }
}

void MeshBody::start_newton() {
  const auto n = std::size_t(model.dofs());
  for (std::vector<double>* v : {&iterate_, &force_end_, &residual_, &trial_, &start_, &c_}) v->resize(n);
  norms_.resize(8 * n);
  for (std::size_t i = 0; i < n && begun_ && !way_end_.empty(); ++i) // nodes may have been set elsewhere
    begun_ = std::abs(q_[i] - way_end_[i]) <= 1e-6 * size_;
  warmed_ = 0;
  if (!begun_ || !model.bulk->swelling.empty()) { // what swells has other stresses now than at the end of the last step
    force_begin_.assign(n, 0.0);
    find_swelling_force();
    found_ = model.bulk->evaluate(q_.data(), h_, theta_, force_end_.data(), nullptr);
    if (!found_.ok()) throw Error(describe(found_) + " at the begin of the step");
    force_begin_ = force_end_;
    const double stored = found_.energy + found_.dissipated;
    if (begun_) warmed_ = stored - stored_begin_;
    stored_begin_ = stored;
    begun_ = true;
  }
  if (!pressed.empty()) {
    press_begin_.assign(n, 0.0);
    for (std::size_t i = 0; i < n; ++i) a_[i] = model.reference[i] + q_[i];
    end_share_ = explicit_ ? 0 : scheme_.end_share;
    for (PressedSides& sides : pressed)
      sides.press(model.dim, a_.data(), (1 - end_share_) * sides.begin, press_begin_.data(), model.mass, 0, nullptr);
    press_ = press_begin_;
  }
  iterate_ = v_;
  turn_iterate();
  if (!explicit_) {
    found_ = stresses_of(iterate_, true);
    if (!found_.ok()) { // as it stands at the begin of the step every cell is in order
      for (std::size_t i = 0; i < n; ++i) iterate_[i] = -(1 - theta_) / theta_ * v_[i];
      turn_iterate();
      found_ = stresses_of(iterate_, true);
      if (!found_.ok()) throw Error(describe(found_) + " at the begin of the step");
    }
  }
  find_free_velocity();
}

// What free strains make of the forces, at the begin of the step: a body that swelled as it liked has none left, and
// its balance is still one of terms as large as these.
void MeshBody::find_swelling_force() {
  swelling_force_.clear();
  if (model.bulk->swelling.empty()) return;
  std::vector<double> swelling;
  swelling.swap(model.bulk->swelling);
  swelling_force_.resize(std::size_t(model.dofs()));
  const BulkResult plain = model.bulk->evaluate(q_.data(), h_, theta_, swelling_force_.data(), nullptr);
  swelling.swap(model.bulk->swelling);
  if (plain.ok()) model.bulk->evaluate(q_.data(), h_, theta_, force_end_.data(), nullptr);
  for (std::size_t i = 0; i < swelling_force_.size(); ++i)
    swelling_force_[i] = plain.ok() ? swelling_force_[i] - force_end_[i] : 0;
}

void MeshBody::find_free_velocity() {
  const auto n = std::size_t(model.dofs());
  factorise_tangent();
  residual_of(iterate_);
  for (std::size_t i = 0; i < n; ++i)
    free_[i] = !model.held[i] ? residual_[i] : (held_velocity.empty() ? 0 : held_velocity[i]) - iterate_[i];
  solve(free_.data());
  for (std::size_t i = 0; i < n; ++i) free_[i] += iterate_[i];
}

void MeshBody::linearise(Nodes& nodes) {
  found_ = stresses_of(iterate_, true);
  if (!found_.ok()) throw Error(describe(found_));
  find_free_velocity();
  scatter(free_.data(), nodes.velocity_free);
}

void MeshBody::factorise_tangent() {
  if (!own_) {
    own_ = std::make_unique<Factors>();
    own_->soe = make_soe();
    own_->value.resize(model.mass.value.size());
  }
  now_ = own_.get();
  now_->active.clear();
  now_->place.assign(std::size_t(model.nodes()), -1);
  now_->leading = 0;
  const auto with = [&](const std::vector<double>& stiffness) {
    for (std::size_t e = 0; e < now_->value.size(); ++e)
      now_->value[e] = explicit_ ? model.mass.value[e]
                                 : model.mass.value[e] + h_ * theta_ * model.damping.value[e] +
                                       h_ * theta_ * (h_ * theta_) * stiffness[e];
    ++factorisations;
    return factor(*now_->soe, now_->value.data());
  };
  SoeStatus status = with(explicit_ ? model.stiffness.value : tangent_);
  // where the material softens, the stiffness at the start is a direction that goes down
  if (!status && !explicit_) status = with(model.stiffness.value);
  if (!status) refuse(status);
}

NewtonError MeshBody::judge() {
  const auto n = std::size_t(model.dofs());
  NewtonError out;
  if (explicit_) return out;
  for (std::size_t i = 0; i < n; ++i) trial_[i] = model.held[i] ? 0 : impulse[i];
  solve(trial_.data());
  for (std::size_t i = 0; i < n; ++i) trial_[i] += free_[i] - iterate_[i]; // the change
  double before = 0; // of the balance with these impulses, by the inverse of A: the change solves it
  for (std::size_t i = 0; i < n; ++i)
    if (!model.held[i]) before += trial_[i] * (residual_[i] + impulse[i]);
  std::vector<double>&change = trial_, &start = start_;
  start = iterate_;
  bool moved = false; // a held dof, whose change is no part of the balance
  for (std::size_t i = 0; i < n; ++i) moved = moved || (model.held[i] && (change[i] < 0 || change[i] > 0));
  const bool swells = !swelling_force_.empty();
  const std::size_t terms = swells ? 4 : 3;
  constexpr int halvings = 10;
  double share = 1;
  for (int turn = 0; turn <= halvings; ++turn, share /= 2) {
    for (std::size_t i = 0; i < n; ++i) iterate_[i] = start[i] + share * change[i];
    turn_iterate();
    out.fault = stresses_of(iterate_, false);
    if (!out.fault.ok()) continue;
    residual_of(iterate_);
    for (std::size_t i = 0; i < n; ++i) {
      const bool held = model.held[i];
      norms_[i] = held ? 0 : residual_[i] + impulse[i];
      norms_[n + i] = held ? 0 : b_[i];
      norms_[2 * n + i] = held ? 0 : h_ * (c_[i] + force_of(i));
      if (swells) norms_[3 * n + i] = held ? 0 : h_ * swelling_force_[i];
    }
    std::copy_n(norms_.begin(), terms * n, norms_.begin() + std::ptrdiff_t(terms * n));
    const double* right = &norms_[terms * n];
    solve(norms_.data(), int(terms));
    double size[4] = {0, 0, 0, 0}, worst = 0;
    for (std::size_t k = 0; k < terms; ++k)
      for (std::size_t i = 0; i < n; ++i) size[k] += norms_[k * n + i] * right[k * n + i];
    for (std::size_t i = 0; i < n; ++i)
      if (norms_[i] * right[i] > worst) worst = norms_[i] * right[i], out.node = std::int64_t(i) / model.dim;
    const double scale =
        std::sqrt(std::max(size[1], 0.0)) + std::sqrt(std::max(size[2], 0.0)) + std::sqrt(std::max(size[3], 0.0));
    const double left = std::sqrt(std::max(size[0], 0.0));
    out.error = left > 0 ? (scale > 0 ? left / scale : 1) : 0;
    found_ = out.fault;
    out.whole = turn == 0;
    constexpr double small = 1e-6; // where rounding alone may be left
    if (moved || out.error < small || left * left <= before * (1 - 1e-4 * share) || turn == halvings) return out;
  }
  if (!out.fault.ok()) {
    iterate_ = start;
    turn_iterate();
    out.error = 1;
    out.whole = false;
  }
  return out;
}

// As `account`, with the forces of the stresses at both ends.
void MeshBody::account_bulk(Nodes& nodes, const double* gravity) {
  const int dim = model.dim;
  const std::int64_t n = model.dofs();
  std::vector<double>&end = trial_, &inertia = norms_;
  for (std::int64_t i = 0; i < n && !pressed.empty(); ++i) f_[i] += press_[i];
  gather(nodes.velocity, end.data());
  if (explicit_) {
    iterate_ = end;
    found_ = stresses_of(iterate_, false);
    if (!found_.ok()) throw Error(describe(found_) + " at the end of the step: give a smaller dt");
  }
  work = {};
  for (std::int64_t i = 0; i < n; ++i) a_[i] = explicit_ ? v_[i] : theta_ * end[i] + (1 - theta_) * v_[i];
  if (damps_) damping_times(a_.data(), c_.data());
  for (std::int64_t i = 0; i < n; ++i) a_[i] = end[i] - v_[i];
  multiply_mass(a_.data(), inertia.data());
  multiply_mass(end.data(), b_.data());
  for (std::int64_t i = 0; i < n; ++i) {
    const double way = h_ * (theta_ * end[i] + (1 - theta_) * v_[i]);
    const double elastic = force_of(std::size_t(i));
    work.elastic += way * elastic;
    work.damping += way * c_[i];
    const double extra = (inertia[i] - lumped_[i] * a_[i]) / h_, weight = lumped_[i] * gravity[i % dim];
    reaction[i] = (inertia[i] - impulse[i]) / h_ + elastic + c_[i] - f_[i];
    work.inertia += way * extra;
    work.kinetic_change += 0.5 * (end[i] + v_[i]) * (inertia[i] - lumped_[i] * a_[i]);
    const double force = model.held[i] || model.ties.bound(i) ? (lumped_[i] * a_[i] - impulse[i]) / h_ - weight
                                                              : f_[i] - elastic - c_[i] - weight - extra;
    nodes.force[first_node][i] = force;
    work.kinetic += 0.5 * end[i] * (b_[i] - lumped_[i] * end[i]);
  }
  work.stored = found_.energy;
  work.stored_change = found_.energy - stored_begin_;
  work.material = found_.dissipated;
  work.warmed = warmed_;
}

void MeshBody::commit() {
  if (linear()) return;
  model.bulk->commit();
  way_end_.resize(q_.size());
  for (std::size_t i = 0; i < q_.size(); ++i) way_end_[i] = q_[i] + h_ * (theta_ * iterate_[i] + (1 - theta_) * v_[i]);
  force_begin_ = force_end_;
  begun_ = begun_ && !by_energy_; // stresses by energy are none of the end of the step
  stored_begin_ = found_.energy;
}

std::vector<double> MeshBody::memory() const {
  if (!begun_) return {};
  std::vector<double> out = force_begin_;
  out.push_back(stored_begin_);
  return out;
}

void MeshBody::restore(std::span<const double> state, std::span<const double> memory) {
  const std::size_t states = linear() ? 0 : model.bulk->state().size(), forces = std::size_t(model.dofs()) + 1;
  if (state.size() != states || (!memory.empty() && (linear() || memory.size() != forces)))
    throw Error("the state of the mesh '" + model.name + "' holds " + std::to_string(state.size()) + " and " +
                std::to_string(memory.size()) + " numbers: it has " + std::to_string(states) + " and " +
                std::to_string(forces) + "; give the file of this scene");
  if (linear()) return;
  std::copy(state.begin(), state.end(), model.bulk->state().begin());
  begun_ = !memory.empty();
  way_end_.clear();
  if (!begun_) return;
  force_begin_.assign(memory.begin(), memory.end() - 1);
  stored_begin_ = memory.back();
}

} // namespace cairn
