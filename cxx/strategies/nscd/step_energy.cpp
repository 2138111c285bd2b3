#include "step_energy.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

void account_for_energy(Simulation& s, const StepScheme& step, bool theta, const Histories& histories,
                        const ContactEnergy& contacts, const WorkBeside& beside) {
  Bodies& b = s.scene.bodies;
  Nodes& nodes = s.scene.nodes;
  double terms[8], of_nodes[8];
  const cairn_scheme* scheme = theta ? nullptr : &step.scheme;
  const bool keeps = step.scheme.histories > 0;
  cairn_energy_terms(s.scene.dim, b.dofs(), b.count, step.h, step.scheme.share, s.scene.gravity.data(),
                     b.mass.values.data(), b.inertia.values.data(), b.velocity_begin.values.data(),
                     b.velocity.values.data(), terms, pointer(b.force), pointer(b.damping), bits(b.driven),
                     pointer(b.reaction), pointer(b.momentum_begin), pointer(b.angular_momentum), scheme,
                     keeps ? histories.way() : nullptr, b.history(0), b.history(1), b.history(2), b.history(3));
  if (nodes.count > 0) {
    cairn_energy_terms(nodes.dim, nodes.dim, nodes.count, step.h, step.scheme.share, s.scene.gravity.data(),
                       nodes.mass.values.data(), nullptr, nodes.velocity_begin.values.data(),
                       nodes.velocity.values.data(), of_nodes, nodes.force.values.data(), nullptr, nullptr, nullptr,
                       nullptr, nullptr, scheme, keeps ? histories.node_way() : nullptr, nodes.history(0),
                       nodes.history(1), nodes.history(2), nodes.history(3));
    for (int k = 0; k < 8; ++k) terms[k] += of_nodes[k];
  }
  balance_energy(s, s.meshes.meshes, terms, contacts, beside);
}

void balance_energy(Simulation& s, const MeshList& meshes, const double (&terms)[8], const ContactEnergy& contacts,
                    const WorkBeside& beside) {
  const auto [kinetic, d_kinetic, d_potential, external, driven, bulk, by_theta, fall] = terms;
  s.energy.kinetic = kinetic;
  s.energy.potential += d_potential + beside.seated;
  s.energy.work_projection += beside.seated;
  s.energy.work_external += external;
  s.energy.work_driven += driven + contacts.jump_work + contacts.driven;
  s.energy.dissipated_normal += contacts.normal;
  s.energy.dissipated_friction += contacts.tangential;
  s.energy.dissipated_bulk += bulk;
  double strained = 0; // what growth gave to the springs of contacts between two steps
  if (s.scene.has(Need::growing)) {
    double before = s.energy.stored;
    for (const MeshBody& mesh : meshes) before -= mesh.work.stored - mesh.work.stored_change - mesh.work.warmed;
    strained = contacts.stored - before - contacts.stored_change;
  }
  s.energy.work_growth += contacts.grown + strained;
  s.energy.stored = contacts.stored;
  s.energy.released += contacts.released;
  const double stiffened = beside.stiffened;
  s.energy.dissipated_integrator += by_theta + stiffened;
  s.energy.closure += d_kinetic + d_potential - external - driven - contacts.jump_work - contacts.driven +
                      contacts.normal + contacts.tangential + bulk + by_theta + stiffened +
                      (contacts.stored_change + contacts.released) - contacts.grown;
  s.energy.turned_over += std::abs(d_potential) + std::abs(beside.seated) + std::abs(external) + std::abs(driven) +
                          std::abs(contacts.normal) + std::abs(contacts.tangential) + std::abs(bulk) +
                          (std::abs(contacts.stored_change) + contacts.released) + std::abs(strained);
  // Nodes count as points of mass here; what the mass matrix of a mesh adds to that belongs to the largest, too.
  double moving = kinetic, moved = kinetic - d_kinetic;
  for (const MeshBody& mesh : meshes) {
    moving += mesh.work.kinetic;
    moved += mesh.work.kinetic - mesh.work.kinetic_change;
  }
  s.energy.largest_kinetic = std::max({s.energy.largest_kinetic, moving, moved});
  s.energy.in_play = s.energy.largest_kinetic + s.energy.turned_over;
  // a broken bond bears nothing at the end of the step, but released the energy of its springs in it
  const double of_springs = std::abs(contacts.stored_change) + contacts.released;
  const double of_step = std::max(moving, moved) + contacts.turned_over + of_springs + fall + std::abs(strained);
  s.report.solve.energy_created = created_share(contacts.created, of_step, s.energy.in_play, s.steps);
}

double created_share(double created, double of_step, double in_play, std::int64_t steps) {
  constexpr double few = 1000;
  const double all = of_step + in_play / std::max(few, double(steps));
  return all > 0 ? created / all : 0;
}

} // namespace cairn
