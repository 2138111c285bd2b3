#include "mesh_history.hpp"

#include <algorithm>

#include "../bodies/nodes.hpp"

namespace cairn {

// The derivatives that an integrator keeps, each with its factor.
void MeshHistory::sum(Nodes& nodes, const double* factors, double* out) const {
  std::fill_n(out, model_.dofs(), 0.0);
  for (int k = 0; k < step_.scheme.histories; ++k) {
    const double* derivative = nodes.history(k) + model_.dim * step_.first_node;
    for (std::int64_t i = 0; i < model_.dofs(); ++i) out[i] += factors[k] * derivative[i];
  }
}

void MeshHistory::multiply(Nodes& nodes) {
  for (std::vector<double>* v : {&stiff, &damped, &momentum}) v->assign(v->size(), 0.0);
  if (step_.scheme.histories == 0) return;
  sum(nodes, step_.scheme.elastic, step_.scratch.data());
  matrices_.stiffness_times(step_.scratch.data(), stiff.data());
  sum(nodes, step_.scheme.damping_history, step_.scratch.data());
  if (matrices_.damps) matrices_.damping_times(step_.scratch.data(), damped.data());
  sum(nodes, step_.scheme.velocity, step_.scratch.data());
  matrices_.multiply_mass(step_.scratch.data(), momentum.data());
}

// Applies the ties to the stored derivatives of velocity as well: with several of them a part that violates the ties,
// even of rounding, grows from step to step; see cairn_smooth_change.
void MeshHistory::follow_leaders(Nodes& nodes) {
  if (model_.ties.empty() || model_.ties.rigid_parts_turn()) return;
  for (int k = 0; k < cairn_most_history && nodes.history(k); ++k)
    model_.ties.follow(nodes.history(k) + model_.dim * step_.first_node);
}

// Adds the history to the displacement of the step, to the prediction for stresses, to damping and to velocities.
void MeshHistory::take(Nodes& nodes) {
  const std::size_t n = step_.scheme.histories > 0 ? std::size_t(model_.dofs()) : 0;
  for (std::vector<double>* v : {&past, &elastic_past, &damped_past, &kicked_past}) v->resize(n);
  if (n == 0) {
    elastic_past.assign(step_.is_explicit() ? std::size_t(model_.dofs()) : 0, 0.0);
    return;
  }
  if (model_.ties.rigid_parts_turn())
    find_kept_way(nodes);
  else
    sum(nodes, step_.scheme.position, past.data());
  sum(nodes, step_.scheme.elastic, elastic_past.data());
  sum(nodes, step_.scheme.damping_history, damped_past.data());
  sum(nodes, step_.scheme.velocity, kicked_past.data());
}

} // namespace cairn
