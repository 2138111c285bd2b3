// Rigid parts of a mesh that turn over a step, and what an integrator keeps of such a mesh. Forces that keep a part
// rigid turn with it: at one place they do no work on its motion, and by those of the last step it would be driven
// round, by a share h of its centripetal ones. So the forces alone are kept, with the reactions left out, each over the
// mass of its node: they act on the motion of the step at hand as those of its end do. The way of the step takes the
// acceleration of that motion,
//   a = T y'' + c,   T' M T y'' = T' (f - M c),   c = spin x (spin x arm).
#include <algorithm>

#include "../bodies/nodes.hpp"
#include "mesh_history.hpp"

namespace cairn {

// Momentum of the history [N s].
void MeshHistory::kept_momentum(double* out) const {
  if (!model_.ties.rigid_parts_turn()) return matrices_.multiply_mass(kicked_past.data(), out);
  for (std::int64_t i = 0; i < model_.dofs(); ++i) out[i] = matrices_.force_weight(i) * kicked_past[std::size_t(i)];
}

// Displacement of the history in the step [m], for rigid parts with position and spin of its begin.
void MeshHistory::find_kept_way(Nodes& nodes) {
  const auto n = std::size_t(model_.dofs());
  std::fill(past.begin(), past.end(), 0.0);
  const double factor = step_.scheme.position[0];
  if (!(factor < 0 || factor > 0)) return;
  std::vector<double>&turning = step_.a, &bound = step_.b;
  for (std::size_t i = 0; i < n; ++i) step_.a[i] = model_.reference[i] + step_.q[i];
  model_.ties.stand_at(step_.a.data());
  model_.ties.centripetal(step_.v.data(), turning.data());
  matrices_.multiply_mass(turning.data(), bound.data());
  const double* kept = nodes.history(0) + model_.dim * step_.first_node;
  for (std::size_t i = 0; i < n; ++i)
    past[i] = model_.held[i] ? kept[i] : matrices_.force_weight(std::int64_t(i)) * kept[i] - bound[i];
  equations_.solve_bound_mass(past.data());
  for (std::size_t i = 0; i < n; ++i) past[i] = factor * (past[i] + turning[i]);
}

} // namespace cairn
