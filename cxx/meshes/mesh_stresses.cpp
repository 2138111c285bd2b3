#include "mesh_stresses.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "../base/stopwatch.hpp"
#include "../bodies/nodes.hpp"

namespace cairn {

// Forces at the begin of the step, as the last one left them, unless nodes were set elsewhere or something swelled.
void MeshStresses::begin(double size) {
  const auto n = std::size_t(model_.dofs());
  for (std::size_t i = 0; i < n && begun_ && !way_end_.empty(); ++i) // nodes may have been set elsewhere
    begun_ = std::abs(step_.q[i] - way_end_[i]) <= (undone_ ? 0 : 1e-6 * size);
  double fastest = 0;
  for (const double v : velocity_end_) fastest = std::max(fastest, std::abs(v));
  for (std::size_t i = 0; i < velocity_end_.size() && begun_; ++i)
    begun_ = std::abs(step_.v[i] - velocity_end_[i]) <= 1e-12 * fastest;
  way_end_ = step_.q;
  undone_ = true; // unless it is committed
  warmed = 0;
  if (!begun_ || !model_.bulk->swelling.empty()) { // swelling changes stresses since the end of the last step
    force_begin.assign(n, 0.0);
    find_swelling_force();
    const Stopwatch watch(&seconds_.balance);
    found = forces_at_begin(force_end.data());
    if (!found.ok()) fail(found, " at the begin of the step", "");
    force_begin = force_end;
    const double stored = found.energy + found.dissipated;
    if (begun_) warmed = stored - stored_begin;
    stored_begin = stored;
    begun_ = true;
  }
  if (!loads_.pressed.empty()) {
    press_begin_.assign(n, 0.0);
    for (std::size_t i = 0; i < n; ++i) step_.a[i] = model_.reference[i] + step_.q[i];
    end_share_ = step_.scheme.end_share;
    for (PressedSides& sides : loads_.pressed)
      sides.press(model_.dim, step_.a.data(), (1 - end_share_) * sides.begin, press_begin_.data(), model_.mass, 0,
                  nullptr);
    press = press_begin_;
  }
}

// The way of the step of node dofs that end with velocities v.
double MeshStresses::way_of(std::size_t i, double v) const {
  const double way = step_.h() * (step_.share() * v + (1 - step_.share()) * step_.v[i]);
  if (!way_beside.empty()) return way + way_beside[i];
  return history_.past.empty() ? way : way + history_.past[i] + step_.scheme.position[0] / step_.h() * jumps_.all[i];
}

// Stresses where the step ends, if that is not where its balance has them.
void MeshStresses::find_at_end(const std::vector<double>& end) {
  for (std::size_t i = 0; i < end.size(); ++i) force_step[i] = force_of(i);
  bool elsewhere = step_.is_explicit();
  for (std::size_t i = 0; i < history_.past.size() && !elsewhere && jumps_.given.empty(); ++i) {
    const double moved = step_.scheme.position[0] * jumps_.all[i];
    elsewhere = moved < 0 || moved > 0;
  }
  if (!elsewhere) return;
  step_.iterate = end;
  for (std::size_t i = 0; i < end.size(); ++i) step_.b[i] = step_.q[i] + way_of(i, end[i]);
  found = evaluate_at(end.data(), 0, false);
  if (!found.ok()) fail(found, " at the end of the step", advice());
}

BulkResult MeshStresses::evaluate(const std::vector<double>& v, bool with_tangent) {
  const std::int64_t n = model_.dofs();
  if (with_tangent) {
    tangent.resize(model_.mass.value.size());
    std::fill(tangent.begin(), tangent.end(), 0.0);
  }
  for (std::int64_t i = 0; i < n; ++i)
    step_.b[i] = step_.q[i] + step_.h() * (step_.share() * v[i] + (1 - step_.share()) * step_.v[i]);
  for (std::size_t i = 0; i < history_.past.size(); ++i) step_.b[i] += history_.past[i] + jumps_.way_of(i);
  return evaluate_at(v.data(), 1 / (step_.h() * step_.share()), with_tangent);
}

// At displacements step.b, where velocities are v and change with them by `rate`.
BulkResult MeshStresses::evaluate_at(const double* v, double rate, bool with_tangent) {
  const Stopwatch watch(with_tangent ? &seconds_.assembly : nullptr); // else a part of the balance
  const MeshMotion there{step_.b.data(),
                         v,
                         loads_.time + step_.h(),
                         step_.h(),
                         step_.rate_share(),
                         rate,
                         step_.by_energy() ? step_.q.data() : nullptr,
                         loads_.time};
  const BulkResult found = model_.bulk->evaluate(there, force_end.data(), with_tangent ? tangent.data() : nullptr);
  if (found.ok() && !loads_.pressed.empty()) add_press(with_tangent ? tangent.data() : nullptr);
  return found;
}

// Pressures at displacements step.b, into press; adds the symmetric part of their derivative to the tangent of
// stresses. The derivative is symmetric where the surface is closed or its rim is held.
void MeshStresses::add_press(double* to) {
  const auto n = std::size_t(model_.dofs());
  for (std::size_t i = 0; i < n; ++i) step_.b[i] += model_.reference[i];
  press = press_begin_;
  for (PressedSides& sides : loads_.pressed)
    sides.press(model_.dim, step_.b.data(), end_share_ * sides.end, press.data(), model_.mass, -sides.end, to);
}

double MeshStresses::force_of(std::size_t i) const {
  if (step_.is_explicit()) return force_step[i];
  return step_.by_energy() ? force_end[i]
                           : step_.end_weight() * force_end[i] + (1 - step_.end_weight()) * force_begin[i];
}

// Refuses schemes that do not fit rigid parts that turn, or the material.
void MeshStresses::take_scheme(bool check) {
  if (step_.is_explicit() && model_.ties.rigid_parts_turn())
    throw Error("rigid parts of the mesh '" + model_.name +
                "' turn over a step, which explicit integrators do not know: give Theta(), or hold these nodes");
  if (step_.share() < 0.5 * (1 - 4 * std::numeric_limits<double>::epsilon()) && model_.ties.rigid_parts_turn())
    throw Error(
        "rigid parts of the mesh '" + model_.name +
        "' turn over a step, and what their velocities are beside a rigid motion would grow by gamma/beta - 1 a "
        "step of Newmark: give a beta of gamma/2 or more");
  if (const std::string why = step_.by_energy() ? model_.bulk->not_by_energy(model_.name) : ""; !why.empty())
    throw Error(why + ": DiscreteGradient is for hyperelastic materials at large strains in 3D, plane strain and round "
                      "an axis, without mean dilatation; give Theta(0.5)");
  if (check) stability_.check_if_asked(step_.scheme);
}

BulkResult MeshStresses::forces_at_begin(double* force) {
  return model_.bulk->evaluate(
      {step_.q.data(), step_.v.data(), loads_.time, step_.h(), step_.rate_share(), 0, nullptr, loads_.time}, force,
      nullptr);
}

// Internal force of an explicit integrator: at the begin of the step, or where the step is predicted to lead.
void MeshStresses::predict() {
  force_step = force_begin;
  if (!(step_.end_weight() > 0)) return;
  for (std::size_t i = 0; i < step_.b.size(); ++i)
    step_.b[i] =
        step_.q[i] + (step_.scheme.elastic_velocity * step_.v[i] + history_.elastic_past[i]) / step_.end_weight();
  found = evaluate_at(step_.v.data(), 0, false);
  if (!found.ok()) fail(found, " where the step is predicted to lead", ": give a smaller dt");
  for (std::size_t i = 0; i < step_.b.size(); ++i)
    force_step[i] = step_.end_weight() * force_end[i] + (1 - step_.end_weight()) * force_begin[i];
}

// Part of the internal forces that free strains make, at the begin of the step [N]: a body that swelled freely has no
// stress left, but its balance still has terms of this size, to which errors are relative.
void MeshStresses::find_swelling_force() {
  swelling_force.clear();
  if (model_.bulk->swelling.empty()) return;
  std::vector<double> swelling;
  swelling.swap(model_.bulk->swelling);
  swelling_force.resize(std::size_t(model_.dofs()));
  const BulkResult plain = forces_at_begin(swelling_force.data());
  swelling.swap(model_.bulk->swelling);
  if (plain.ok()) forces_at_begin(force_end.data());
  for (std::size_t i = 0; i < swelling_force.size(); ++i)
    swelling_force[i] = plain.ok() ? swelling_force[i] - force_end[i] : 0;
}

void MeshStresses::commit(const std::vector<double>& end) {
  way_end_.resize(step_.q.size());
  for (std::size_t i = 0; i < step_.q.size(); ++i) way_end_[i] = step_.q[i] + way_of(i, step_.iterate[i]);
  force_begin = force_end;
  begun_ = begun_ && !step_.by_energy(); // stresses by energy are none of the end of the step
  stored_begin = found.energy;
  if (!model_.bulk->solid()) velocity_end_ = end; // as `account` has it: forces of another code may depend on it
  model_.bulk->commit();
  undone_ = false;
}

std::vector<double> MeshStresses::memory() const {
  if (!begun_) return {};
  std::vector<double> out = force_begin;
  out.push_back(stored_begin);
  return out;
}

void MeshStresses::restore(std::span<const double> state, std::span<const double> memory) {
  const std::int64_t states = model_.linear() ? 0 : model_.bulk->history_size(), forces = model_.dofs() + 1;
  const bool fits = states < 0 || std::int64_t(state.size()) == states;
  if (!fits || (!memory.empty() && (model_.linear() || std::int64_t(memory.size()) != forces)))
    throw Error("the state of the mesh '" + model_.name + "' holds " + std::to_string(state.size()) + " and " +
                std::to_string(memory.size()) + " numbers: it has " + std::to_string(states) + " and " +
                std::to_string(forces) + "; give the file of this scene");
  if (model_.linear()) return;
  model_.bulk->take_history(state);
  begun_ = !memory.empty();
  way_end_.clear();
  velocity_end_.clear();
  undone_ = false;
  if (!begun_) return;
  force_begin.assign(memory.begin(), memory.end() - 1);
  stored_begin = memory.back();
}

void MeshStresses::forget() {
  if (model_.linear()) return;
  model_.bulk->forget_history();
  begun_ = false;
  way_end_.clear();
  velocity_end_.clear();
}

// Impulses of contacts move rigid parts beside the way by which the balance is judged: with that they turn whole, too.
void MeshStresses::turn_way(const Nodes& nodes, double* way) {
  if (model_.linear() || !model_.ties.rigid_parts_turn()) return;
  const auto n = std::size_t(model_.dofs());
  const double factor = step_.scheme.position[0] / step_.h();
  std::vector<double>&all = step_.a, &place = step_.b;
  const double* end = nodes.velocity[step_.first_node];
  way_beside.resize(n);
  bool moved = false;
  for (std::size_t i = 0; i < n; ++i) {
    const double more = factor * jumps_.all[i];
    moved = moved || more < 0 || more > 0;
    way_beside[i] = history_.past[i] + more;
    all[i] = step_.share() * end[i] + (1 - step_.share()) * step_.v[i] + way_beside[i] / step_.h();
    place[i] = model_.reference[i] + step_.q[i];
  }
  if (moved) {
    model_.ties.turn(all.data(), place.data(), step_.h());
    for (const std::int32_t node : model_.ties.rigid_node)
      for (int k = 0; k < model_.dim; ++k) {
        const auto i = std::size_t(model_.dim * node + k);
        way_beside[i] = step_.h() * (all[i] - step_.share() * end[i] - (1 - step_.share()) * step_.v[i]);
      }
  }
  std::copy(way_beside.begin(), way_beside.end(), way + std::ptrdiff_t(model_.dim) * step_.first_node);
}

} // namespace cairn
