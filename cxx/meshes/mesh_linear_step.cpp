#include "mesh_linear_step.hpp"

#include <algorithm>

#include "../base/call.hpp"
#include "../bodies/nodes.hpp"

namespace cairn {

void MeshLinearStep::start() {
  const auto n = std::size_t(model_.dofs());
  for (std::vector<double>* v :
       {&stiff_q_, &stiff_, &damped_, &momentum_, &stiff_begin_, &damped_begin_, &momentum_begin_})
    v->assign(n, 0);
}

// The velocity that a step ended with is that which the next begins with, unless someone set it.
void MeshLinearStep::times_velocity(const double* v) {
  const std::size_t n = matrices_.lumped.size();
  if (moving_.size() == n && std::equal(moving_.begin(), moving_.end(), v)) return;
  moving_.assign(v, v + n);
  matrices_.stiffness_times(v, stiff_.data());
  if (matrices_.damps) matrices_.damping_times(v, damped_.data());
  matrices_.multiply_mass(v, momentum_.data());
}

double MeshLinearStep::stored(const Nodes& nodes) {
  step_.gather(nodes.position, step_.a.data());
  for (std::int64_t i = 0; i < model_.dofs(); ++i) step_.a[i] -= model_.reference[i];
  matrices_.stiffness_times(step_.a.data(), step_.b.data());
  double twice = 0;
  for (std::int64_t i = 0; i < model_.dofs(); ++i) twice += step_.a[i] * step_.b[i];
  for (std::size_t i = 0; i < model_.initial_force.size(); ++i) twice += 2 * step_.a[i] * model_.initial_force[i];
  return twice / 2;
}

// Stored energy at the begin and the end of a step along `way` [J], and work of the integrator's elastic forces K q_e
// beyond those at the midpoint q_m, (q_e - q_m).K way [J]: computed from increments and coefficients of the scheme,
// since a difference of energies would lose digits.
void MeshLinearStep::account_stored(Nodes& nodes, const std::vector<double>& end, const std::vector<double>& way) {
  const std::int64_t n = model_.dofs();
  const cairn_scheme& s = step_.scheme;
  const double way_end = s.h * s.share, way_begin = s.h * (1 - s.share);
  const double of_begin = s.elastic_velocity - 0.5 * s.h, of_change = s.stiffness / s.impulse - 0.5 * way_end;
  const bool keeps = s.histories > 0;
  std::vector<double>&pull = step_.free, &apart = step_.b; // K way, q_e - q_m
  double of_history[cairn_most_history];
  for (int k = 0; k < cairn_most_history; ++k) of_history[k] = s.elastic[k] - 0.5 * s.position[k];
  history_.sum(nodes, of_history, apart.data());
  const double of_jump = (jumps_.given.empty() ? -0.5 : s.end_share - 0.5) * s.position[0] / s.h;
  for (std::int64_t i = 0; i < n && keeps; ++i) apart[i] += of_jump * jumps_.all[i];
  if (keeps) // K of the way is not that of the velocities alone
    matrices_.stiffness_times(way.data(), pull.data());
  for (std::int64_t i = 0; i < n && !keeps; ++i) pull[i] = way_end * stiff_[i] + way_begin * stiff_begin_[i];
  double begin = 0;
  for (std::int64_t i = 0; i < n; ++i) {
    work_.integrator += (apart[i] + of_begin * step_.v[i] + of_change * (end[i] - step_.v[i])) * pull[i];
    begin += 0.5 * step_.q[i] * stiff_q_[i];
    work_.stored += 0.5 * (step_.q[i] + way[i]) * (stiff_q_[i] + pull[i]);
  }
  const std::vector<double>& initial = model_.initial_force; // half of whose work is in the products above
  for (std::size_t i = 0; i < initial.size(); ++i) {
    begin += 0.5 * step_.q[i] * initial[i];
    work_.stored += 0.5 * (step_.q[i] + way[i]) * initial[i];
  }
  work_.stored_change = work_.stored - begin;
  work_.stored += model_.initial_energy;
}

// Works of a body with linear forces; `pull` is K `way`.
void MeshLinearStep::account_means(const std::vector<double>& way, const std::vector<double>& pull) {
  work_.drag = work_.damping;
  if (!works_.weighs_an_end()) return;
  works_.find_loads_beyond(way);
  works_.mean.resize(way.size());
  works_.drag.resize(way.size());
  for (std::size_t i = 0; i < way.size(); ++i) {
    works_.mean[i] = stiff_q_[i] + 0.5 * pull[i];
    works_.drag[i] = 0.5 * (damped_begin_[i] + damped_[i]);
  }
  works_.account_means(way);
}

void MeshLinearStep::find_free_velocity(Nodes& nodes) {
  const std::int64_t n = model_.dofs();
  const cairn_scheme& scheme = step_.scheme;
  matrices_.stiffness_times(step_.q.data(), stiff_q_.data());
  for (std::size_t i = 0; i < model_.initial_force.size(); ++i) stiff_q_[i] += model_.initial_force[i];
  times_velocity(step_.v.data());
  history_.multiply(nodes);
  stiff_begin_ = stiff_;
  damped_begin_ = damped_;
  momentum_begin_ = momentum_;
  const double ahead = scheme.elastic_velocity;
  for (std::int64_t i = 0; i < n && !loads_.thermal.empty(); ++i) step_.f[i] += loads_.thermal[i];
  jumps_.start();
  if (!jumps_.given.empty())
    jumps_.add_forces(jumps_.given, step_.scratch.data()); // a given velocity is known before the step
  bool moved = false;
  for (std::int64_t i = 0; i < n; ++i) {
    const double damped = damped_begin_[i] + history_.damped[i];
    const double stiff = stiff_q_[i] + ahead * stiff_begin_[i] + history_.stiff[i];
    step_.free[i] = history_.momentum[i] + scheme.impulse * (step_.f[i] - damped - stiff);
    if (!model_.held[i]) continue;
    step_.free[i] = (loads_.held_velocity.empty() ? 0 : loads_.held_velocity[i]) - step_.v[i];
    moved = moved || step_.free[i] < 0 || step_.free[i] > 0;
  }
  if (moved && !factors_.now->soe)
    throw Error("held dofs of the mesh '" + model_.name +
                "' change their velocity, which its own solver is not told of");
  factors_.solve(step_.free.data());
  for (std::int64_t i = 0; i < n; ++i) step_.free[i] += step_.v[i];
}

// The scene keeps the balance of the nodes as points of mass: what else acts on them is a force on them here, and its
// work is taken apart again.
void MeshLinearStep::account(Nodes& nodes, const double* gravity) {
  const int dim = model_.dim;
  const std::int64_t n = model_.dofs();
  const cairn_scheme& s = step_.scheme;
  const double way_end = s.h * s.share, way_begin = s.h * (1 - s.share), ahead = s.elastic_velocity;
  const double stiff_more = s.stiffness / s.impulse, damped_more = s.damping / s.impulse;
  std::vector<double>&end = step_.a, &x = step_.b, &way = step_.scratch;
  step_.gather(nodes.velocity, end.data());
  times_velocity(end.data());
  history_.sum(nodes, s.position, way.data());
  for (std::int64_t i = 0; i < n; ++i) way[i] += way_end * end[i] + way_begin * step_.v[i];
  for (std::int64_t i = 0; i < n && s.histories > 0; ++i) way[i] += s.position[0] / s.h * jumps_.all[i];
  if (!jumps_.given.empty()) jumps_.take(step_.free.data());
  works_.taken.resize(end.size());
  work_ = {};
  for (std::int64_t i = 0; i < n; ++i) {
    const double elastic =
        stiff_q_[i] + ahead * stiff_begin_[i] + history_.stiff[i] + stiff_more * (stiff_[i] - stiff_begin_[i]);
    const double damping = damped_begin_[i] + history_.damped[i] + damped_more * (damped_[i] - damped_begin_[i]);
    work_.elastic += way[i] * elastic;
    work_.damping += way[i] * damping;
    step_.f[i] -= elastic + damping;
    works_.taken[i] = elastic + damping;
  }
  history_.sum(nodes, s.velocity, x.data());
  for (std::int64_t i = 0; i < n; ++i) {
    const double change = end[i] - step_.v[i], inertia = momentum_[i] - momentum_begin_[i];
    const double lumped = matrices_.lumped[i] * (change - x[i]); // what the points of mass take of the forces
    const double beyond = s.histories > 0 ? jumps_.beyond_scheme[i] : 0;
    reaction_[i] = (inertia - history_.momentum[i] - impulse_[i]) / s.impulse - beyond - step_.f[i];
    const double extra = (inertia - history_.momentum[i] - lumped) / s.impulse,
                 weight = matrices_.lumped[i] * gravity[i % dim];
    const double mean = 0.5 * (end[i] + step_.v[i]);
    work_.inertia += way[i] * extra;
    work_.kinetic_change += mean * (inertia - matrices_.lumped[i] * change);
    work_.integrator +=
        (way[i] - s.impulse * mean) * extra - mean * (history_.momentum[i] - matrices_.lumped[i] * x[i]);
    work_.integrator -= s.impulse * mean * beyond;
    if (model_.ties.bound(i))
      work_.binding += way[i] * reaction_[i];
    else if (model_.held[i])
      work_.driven += way[i] * reaction_[i];
    const bool given = model_.held[i] || model_.ties.bound(i);
    const double force = given ? (lumped - impulse_[i]) / s.impulse - beyond - weight : step_.f[i] - weight - extra;
    nodes.force[step_.first_node][i] = force;
    work_.kinetic += 0.5 * end[i] * (momentum_[i] - matrices_.lumped[i] * end[i]);
  }
  account_stored(nodes, end, way);
  account_means(way, step_.free);
}

// M a = F - C v - K q, and the derivatives of that under constant loads.
void MeshLinearStep::start_history(Nodes& nodes) {
  const std::int64_t n = model_.dofs();
  step_.f = step_.weight;
  for (std::int64_t i = 0; i < n && !loads_.begin.empty(); ++i) step_.f[i] += loads_.begin[i];
  for (std::int64_t i = 0; i < n && !loads_.thermal.empty(); ++i) step_.f[i] += loads_.thermal[i];
  for (std::size_t i = 0; i < model_.initial_force.size(); ++i) step_.f[i] -= model_.initial_force[i];
  std::vector<double>&place = step_.q, &speed = step_.v, &next = step_.a, &stiff = step_.b, &damped = step_.scratch;
  for (int k = 0; k < cairn_most_history && nodes.history(k); ++k) {
    matrices_.stiffness_times(place.data(), stiff.data());
    matrices_.damping_times(speed.data(), damped.data());
    for (std::int64_t i = 0; i < n; ++i) next[i] = (k == 0 ? step_.f[i] : 0) - stiff[i] - damped[i];
    equations_.solve_mass(next.data());
    std::copy_n(next.begin(), n, nodes.history(k) + model_.dim * step_.first_node);
    place.swap(speed);
    speed = next;
  }
}

} // namespace cairn
