// Rigid parts of a mesh that turn over a step, and what an integrator keeps of such a mesh. Forces that keep a part
// rigid turn with it: at one place they do no work on its motion, and by those of the last step it would be driven
// round, by a share h of its centripetal ones. So the forces alone are kept, with the reactions left out, each over the
// mass of its node: they act on the motion of the step at hand as those of its end do. The way of the step takes the
// acceleration of that motion,
//   a = T y'' + c,   T' M T y'' = T' (f - M c),   c = spin x (spin x arm).
#include <algorithm>

#include "../bodies/nodes.hpp"
#include "mesh_body.hpp"

namespace cairn {

// Rigid parts turn as a whole over the step, from velocities of the pass that are linear in their spins.
void MeshBody::turn_iterate() {
  if (!model.ties.rigid_parts_turn()) return;
  std::vector<double>&way = a_, &place = b_;
  const auto past = [&](std::size_t i) { return past_.empty() ? 0.0 : past_[i] / h_; };
  for (std::size_t i = 0; i < iterate_.size(); ++i) {
    way[i] = share_ * iterate_[i] + (1 - share_) * v_[i] + past(i);
    place[i] = model.reference[i] + q_[i];
  }
  model.ties.turn(way.data(), place.data(), h_);
  for (const std::int32_t node : model.ties.rigid_node)
    for (int k = 0; k < model.dim; ++k) {
      const auto i = std::size_t(model.dim * node + k);
      iterate_[i] = (way[i] - past(i) - (1 - share_) * v_[i]) / share_;
    }
}

// By which forces of a dof are kept [kg]: any that stays, where rows of a consistent mass have none.
double MeshBody::force_weight(std::int64_t i) const {
  return lumped_[std::size_t(i)] > 0 ? lumped_[std::size_t(i)] : mean_mass_;
}

// Momentum of the history [N s].
void MeshBody::kept_momentum(double* out) const {
  if (!model.ties.rigid_parts_turn()) return multiply_mass(kicked_past_.data(), out);
  for (std::int64_t i = 0; i < model.dofs(); ++i) out[i] = force_weight(i) * kicked_past_[std::size_t(i)];
}

// Displacement of the history in the step [m], for rigid parts with position and spin of its begin.
void MeshBody::find_kept_way(Nodes& nodes) {
  const auto n = std::size_t(model.dofs());
  std::fill(past_.begin(), past_.end(), 0.0);
  const double factor = scheme_.position[0];
  if (!(factor < 0 || factor > 0)) return;
  std::vector<double>&turning = a_, &bound = b_;
  for (std::size_t i = 0; i < n; ++i) a_[i] = model.reference[i] + q_[i];
  model.ties.stand_at(a_.data());
  model.ties.centripetal(v_.data(), turning.data());
  multiply_mass(turning.data(), bound.data());
  const double* kept = nodes.history(0) + model.dim * first_node;
  for (std::size_t i = 0; i < n; ++i)
    past_[i] = model.held[i] ? kept[i] : force_weight(std::int64_t(i)) * kept[i] - bound[i];
  solve_bound_mass(past_.data());
  for (std::size_t i = 0; i < n; ++i) past_[i] = factor * (past_[i] + turning[i]);
}

// Impulses of contacts move rigid parts beside the way by which the balance is judged: with that they turn whole, too.
void MeshBody::turn_way(const Nodes& nodes, double* way) {
  if (linear() || !model.ties.rigid_parts_turn()) return;
  const auto n = std::size_t(model.dofs());
  const double factor = scheme_.position[0] / h_;
  std::vector<double>&all = a_, &place = b_;
  const double* end = nodes.velocity[first_node];
  way_beside_.resize(n);
  bool moved = false;
  for (std::size_t i = 0; i < n; ++i) {
    const double more = factor * jump_[i];
    moved = moved || more < 0 || more > 0;
    way_beside_[i] = past_[i] + more;
    all[i] = share_ * end[i] + (1 - share_) * v_[i] + way_beside_[i] / h_;
    place[i] = model.reference[i] + q_[i];
  }
  if (moved) {
    model.ties.turn(all.data(), place.data(), h_);
    for (const std::int32_t node : model.ties.rigid_node)
      for (int k = 0; k < model.dim; ++k) {
        const auto i = std::size_t(model.dim * node + k);
        way_beside_[i] = h_ * (all[i] - share_ * end[i] - (1 - share_) * v_[i]);
      }
  }
  std::copy(way_beside_.begin(), way_beside_.end(), way + std::ptrdiff_t(model.dim) * first_node);
}

} // namespace cairn
