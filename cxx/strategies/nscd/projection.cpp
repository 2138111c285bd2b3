// Overlap removed without changing a velocity (Acary 2013): the smallest displacement in the metric of mass that opens
// every gap, found by the contact solver itself, with displacement / h in the place of velocity; for meshes the metric
// is the effective mass of the step, elastic energy included.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../../base/call.hpp"
#include "../../laws/law_names.hpp"
#include "nscd.hpp"

namespace cairn {

ContactMemory Nscd::projection_memory() const { return projector_ ? projector_->memory() : ContactMemory{}; }

void Nscd::restore_projection(const Simulation& s, const ContactMemory& memory) {
  if (!projector_) projector_.emplace(s.scene.dim);
  projector_->restore(memory);
}

// A condition on the gap at the end, without friction: overlap is pushed back.
const LawTable& Nscd::projection_laws(const Simulation& s) {
  if (!projection_laws_ || projection_laws_->materials() < s.laws.materials()) {
    const double mu = 0;
    projection_laws_.emplace(std::vector<std::string>(std::size_t(s.laws.materials())));
    projection_laws_->set_default(Law::gap_coulomb, {&mu, 1});
  }
  return *projection_laws_;
}

void Nscd::project_positions(Simulation& s) {
  Bodies& b = s.scene.bodies;
  Nodes& nodes = s.scene.nodes;
  const int nd = b.dofs(), dim = s.scene.dim;
  double stored = 0;
  unstiffen(s);
  for (MeshBody& mesh : s.meshes.meshes) stored -= mesh.stored(nodes), mesh.rest();
  b.velocity_begin.values.swap(b.velocity.values); // kept there; the contacts read zero
  reaction_kept_ = b.reaction.values;
  nodes.velocity_begin.values.swap(nodes.velocity.values);
  for (Field<double>* field : {&b.velocity, &b.velocity_free, &nodes.velocity, &nodes.velocity_free})
    std::fill(field->values.begin(), field->values.end(), 0.0);
  const std::int8_t* driven = b.driven.active ? reinterpret_cast<const std::int8_t*>(b.driven.values.data()) : nullptr;
  if (b.angular_momentum.active)
    cairn_inverse_inertia(b.count, b.inertia.values.data(), b.rotation.values.data(), b.inverse_mass.values.data(),
                          b.inverse_inertia.values.data(), driven);

  // Neighbours that a displacement could meet: as far again as the deepest overlap.
  if (!projector_) projector_.emplace(dim);
  Margin margin{};
  margin.per_contactor = margins_.data();
  if (std::isnan(settings.margin))
    measure_margins(s);
  else
    margin = {settings.margin, nullptr};
  s.handler.detect(b, s.scene.contactors, s.scene.cell, margin, projection_candidates_, {.mapped = &s.meshes.mapped()},
                   &projector_->scratch(), &s.laws.rules());
  s.meshes.weigh_mortar(nodes, {s.scene.contactors, margin, s.laws.rules(), s.scene.cell}, projection_candidates_);
  projector_->assemble(b, s.scene.contactors, projection_candidates_, projection_laws(s), s.scene.cell, h_, law_share(),
                       &s.meshes, &nodes);
  SolverOptions options = settings.solver;
  options.accuracy = std::numeric_limits<double>::infinity(); // these velocities move nothing but overlaps
  const SolveReport solved = projector_->solve(b, options);
  projector_->update_velocity(b);
  projector_->commit();
  s.report.projection_error = solved.error;

  double potential = 0;
  for (std::int64_t i = 0; i < b.count; ++i)
    if (std::isfinite(*b.mass[i]))
      for (int d = 0; d < dim; ++d) potential -= *b.mass[i] * s.scene.gravity[d] * h_ * b.velocity[i][d];
  for (std::int64_t i = 0; i < nodes.count; ++i)
    for (int d = 0; d < dim; ++d) potential -= *nodes.mass[i] * s.scene.gravity[d] * h_ * nodes.velocity[i][d];
  cairn_theta_advance(dim, dim, nodes.count, h_, nodes.velocity.values.data(), nodes.position.values.data(), nullptr);
  cairn_theta_advance(dim, nd, b.count, h_, b.velocity.values.data(), b.position.values.data(),
                      dim == 2 && b.rotation.active ? b.rotation.values.data() : nullptr);
  if (dim == 3 && b.rotation.active) {
    std::int64_t unsolved = 0;
    cairn_rotate(b.count, h_, b.inertia.values.data(), b.velocity.values.data(), b.rotation.values.data(), nullptr,
                 driven, &unsolved);
  }
  b.velocity_begin.values.swap(b.velocity.values);
  nodes.velocity_begin.values.swap(nodes.velocity.values);
  b.reaction.values.swap(reaction_kept_);
  s.scene.state_assigned(); // the spin is kept, so the angular momentum follows the new orientation
  for (MeshBody& mesh : s.meshes.meshes) stored += mesh.stored(nodes);
  s.follow_meshes();
  s.interactions.refresh_meshes(b);
  s.energy.potential += potential;
  s.energy.stored += stored;
  s.energy.work_projection += potential + stored;
  s.energy.turned_over += std::abs(potential) + std::abs(stored);
  s.energy.in_play = s.energy.largest_kinetic + s.energy.turned_over;
  s.report.energy = s.energy;
}

// Where a larger error may end a step, after those alone that it ended, so that what rests stays to the bit.
void Nscd::part_overlaps(Simulation& s) {
  const SolveReport& solved = s.report.solve;
  const bool in_packs = settings.solver.enough > settings.solver.tolerance;
  const bool early = solved.status == SolveStatus::converged && solved.error > settings.solver.tolerance;
  if (in_packs && !early && !s.interactions.overlap_adds_up()) return;
  if (solved.status == SolveStatus::diverged ||
      !s.interactions.part_overlaps(s.scene.bodies, early && in_packs, parting_))
    return;
  Bodies& b = s.scene.bodies;
  const int nd = b.dofs(), dim = s.scene.dim;
  double potential = 0;
  for (std::int64_t i = 0; i < b.count; ++i)
    if (std::isfinite(*b.mass[i]))
      for (int d = 0; d < dim; ++d)
        potential -= *b.mass[i] * s.scene.gravity[d] * h_ * parting_[std::size_t(nd * i + d)];
  move_bodies(s, parting_);
  s.energy.potential += potential;
  s.energy.work_projection += potential;
  s.energy.turned_over += std::abs(potential);
  s.energy.in_play = s.energy.largest_kinetic + s.energy.turned_over;
  s.report.energy = s.energy;
}

} // namespace cairn
