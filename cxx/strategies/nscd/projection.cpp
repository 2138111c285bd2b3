// Overlap removed without changing a velocity (Acary 2013): the smallest displacement in the metric of mass that opens
// every gap, found by the contact solver itself, with displacement / h in the place of velocity; for meshes the metric
// is the effective mass of the step, elastic energy included.
#include "projection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../../base/call.hpp"
#include "../../laws/law_names.hpp"
#include "joints.hpp"

namespace cairn {

ContactMemory OverlapProjection::memory() const { return interactions_ ? interactions_->memory() : ContactMemory{}; }

void OverlapProjection::restore(const Simulation& s, const ContactMemory& memory) {
  if (!interactions_) interactions_.emplace(s.scene.dim);
  interactions_->restore(memory);
}

// A condition on the gap at the end, without friction: overlap is pushed back.
const LawTable& OverlapProjection::laws(const Simulation& s) {
  if (!laws_ || laws_->materials() < s.laws.materials()) {
    const double mu = 0;
    laws_.emplace(std::vector<std::string>(std::size_t(s.laws.materials())));
    laws_->set_default(Law::gap_coulomb, {&mu, 1});
  }
  return *laws_;
}

void OverlapProjection::project(Simulation& s, const NscdOptions& settings, const StepScheme& step,
                                SearchMargins& margins) {
  const double h = step.h;
  Bodies& b = s.scene.bodies;
  Nodes& nodes = s.scene.nodes;
  const int nd = b.dofs(), dim = s.scene.dim;
  double stored = 0;
  for (MeshBody& mesh : s.meshes.meshes) stored -= mesh.stored(nodes), mesh.rest();
  b.velocity_begin.values.swap(b.velocity.values); // kept there; the contacts read zero
  reaction_ = b.reaction.values;
  nodes.velocity_begin.values.swap(nodes.velocity.values);
  for (Field<double>* field : {&b.velocity, &b.velocity_free, &nodes.velocity, &nodes.velocity_free})
    std::fill(field->values.begin(), field->values.end(), 0.0);
  const std::int8_t* driven = b.driven.active ? reinterpret_cast<const std::int8_t*>(b.driven.values.data()) : nullptr;
  if (b.angular_momentum.active)
    cairn_inverse_inertia(b.count, b.inertia.values.data(), b.rotation.values.data(), b.inverse_mass.values.data(),
                          b.inverse_inertia.values.data(), driven);

  // Neighbours that a displacement could meet: as far again as the deepest overlap.
  if (!interactions_) interactions_.emplace(dim);
  Margin margin{};
  margin.per_contactor = margins.each().data();
  if (std::isnan(settings.margin))
    margins.measure(s, h);
  else
    margin = {settings.margin, nullptr};
  s.handler.detect(b, s.scene.contactors, s.scene.cell, margin, candidates_, {.mapped = &s.meshes.mapped()},
                   &interactions_->scratch(), &s.laws.rules());
  s.meshes.weigh_mortar(nodes, {s.scene.contactors, margin, s.laws.rules(), s.scene.cell}, candidates_);
  interactions_->assemble(b, s.scene.contactors, candidates_, laws(s), s.scene.cell, h, step.law_share(), &s.meshes,
                          &nodes);
  SolverOptions options = settings.solver;
  options.accuracy = std::numeric_limits<double>::infinity(); // these velocities move nothing but overlaps
  const SolveReport solved = interactions_->solve(b, options);
  interactions_->update_velocity(b);
  interactions_->commit();
  s.report.projection_error = solved.error;

  double potential = 0;
  for (std::int64_t i = 0; i < b.count; ++i)
    if (std::isfinite(*b.mass[i]))
      for (int d = 0; d < dim; ++d) potential -= *b.mass[i] * s.scene.gravity[d] * h * b.velocity[i][d];
  for (std::int64_t i = 0; i < nodes.count; ++i)
    for (int d = 0; d < dim; ++d) potential -= *nodes.mass[i] * s.scene.gravity[d] * h * nodes.velocity[i][d];
  cairn_theta_advance(dim, dim, nodes.count, h, nodes.velocity.values.data(), nodes.position.values.data(), nullptr);
  cairn_theta_advance(dim, nd, b.count, h, b.velocity.values.data(), b.position.values.data(),
                      dim == 2 && b.rotation.active ? b.rotation.values.data() : nullptr);
  if (dim == 3 && b.rotation.active) {
    std::int64_t unsolved = 0;
    cairn_rotate(b.count, h, b.inertia.values.data(), b.velocity.values.data(), b.rotation.values.data(), nullptr,
                 driven, &unsolved);
  }
  b.velocity_begin.values.swap(b.velocity.values);
  nodes.velocity_begin.values.swap(nodes.velocity.values);
  b.reaction.values.swap(reaction_);
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
void OverlapParting::part(Simulation& s, const SolverOptions& solver, double h) {
  const SolveReport& solved = s.report.solve;
  const bool in_packs = solver.enough > solver.tolerance;
  const bool early = solved.status == SolveStatus::converged && solved.error > solver.tolerance;
  if (in_packs && !early && !s.interactions.overlap_adds_up()) return;
  if (solved.status == SolveStatus::diverged ||
      !s.interactions.part_overlaps(s.scene.bodies, early && in_packs, velocity_))
    return;
  Bodies& b = s.scene.bodies;
  const int nd = b.dofs(), dim = s.scene.dim;
  double potential = 0;
  for (std::int64_t i = 0; i < b.count; ++i)
    if (std::isfinite(*b.mass[i]))
      for (int d = 0; d < dim; ++d)
        potential -= *b.mass[i] * s.scene.gravity[d] * h * velocity_[std::size_t(nd * i + d)];
  move_bodies(s, velocity_, h);
  s.energy.potential += potential;
  s.energy.work_projection += potential;
  s.energy.turned_over += std::abs(potential);
  s.energy.in_play = s.energy.largest_kinetic + s.energy.turned_over;
  s.report.energy = s.energy;
}

} // namespace cairn
