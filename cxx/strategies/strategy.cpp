// The stages of NSCD: what step() calls, one function each.
#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "simulation.hpp"
#include "smooth/smooth_dynamics.hpp"

namespace cairn {
namespace {

template <class T>
auto pointer(Field<T>& field) {
  return field.active ? field.values.data() : nullptr;
}

const std::int8_t* bits(Field<std::uint8_t>& field) { return reinterpret_cast<const std::int8_t*>(pointer(field)); }

} // namespace

Simulation::Simulation(Scene s, LawTable l, Nscd n)
    : scene(std::move(s)), laws(std::move(l)), strategy(n), interactions(scene.dim) {
  if (!(strategy.theta >= 0.5 && strategy.theta <= 1))
    throw Error("theta is " + std::to_string(strategy.theta) +
                "; give a value in [1/2, 1], below 1/2 the method is unstable");
  scene.renumber();
}

Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;

void Simulation::use(const Nscd& nscd) {
  strategy = nscd;
  smooth_.reset();
}

// Contacts of one strategy mean nothing to the other.
void Simulation::use(const SmoothDem& dem) {
  if (!forces.empty() || free_velocity)
    throw Error("SmoothDEM calls no plugged routines of bodies, and this simulation has some: keep NSCD");
  if (!smooth_) {
    interactions.restore({});
    forget_contacts();
    smooth_ = std::make_unique<SmoothDynamics>(*this, dem);
  }
  smooth_->options = dem;
  smooth_->invalidate(false);
}

ContactMemory Simulation::contact_memory() const { return smooth_ ? smooth_->memory(*this) : interactions.memory(); }

void Simulation::restore_contacts(ContactMemory memory) {
  if (smooth_)
    smooth_->restore(std::move(memory));
  else
    interactions.restore(std::move(memory));
}

void Simulation::check_laws() const {
  for (int e = 0; e < laws.entries(); ++e) {
    const LawInfo& law = law_infos()[std::size_t(laws.entry(e).law)];
    if (smooth_ ? law.force != nullptr : law.prepare != nullptr) continue;
    throw Error("law " + law.python_name +
                (smooth_
                     ? " has no force that a gap and a velocity give, which SmoothDEM needs; give LinearSpring, "
                       "HertzMindlin or JKR, or use NSCD"
                     : " gives a force and no condition on impulses, which NSCD needs; give Coulomb, Restitution or "
                       "the like, or use SmoothDEM"));
  }
}

void Simulation::begin_step(double h) {
  if (!(h > 0) || !std::isfinite(h)) throw Error("dt is " + std::to_string(h) + "; give a positive, finite step [s]");
  check_laws();
  h_ = h;
  // Order is state, and changes with the number of the step alone.
  if (steps > 0 && steps % strategy.renumber_every == 0) scene.renumber();
  if (scene.cell.any()) wrap_into_cell(); // what was put outside; the images of contacts follow
  place_meshes();
  save_begin();
  make_bonds();
  begun_ = true;
}

void Simulation::save_begin() {
  Bodies& b = scene.bodies;
  b.position_begin.values = b.position.values;
  b.velocity_begin.values = b.velocity.values;
  if (b.rotation.active) b.rotation_begin.values = b.rotation.values;
  if (b.angular_momentum.active) b.momentum_begin.values = b.angular_momentum.values;
  cell_begin_ = scene.cell;
}

void Simulation::undo_step() {
  if (!begun_) return;
  leave_plugged_forces();
  Bodies& b = scene.bodies;
  b.position.values = b.position_begin.values;
  b.velocity.values = b.velocity_begin.values;
  if (b.rotation.active) b.rotation.values = b.rotation_begin.values;
  if (b.angular_momentum.active) {
    b.angular_momentum.values = b.momentum_begin.values;
    // of bodies whose spin is driven it followed their orientation
    cairn_momentum_update(b.count, 1, b.inertia.values.data(), b.rotation.values.data(), b.velocity.values.data(),
                          b.velocity.values.data(), b.angular_momentum.values.data(), bits(b.driven));
  }
  scene.cell = cell_begin_;
  begun_ = false;
  forget_contacts();
}

void Simulation::forget_contacts() {
  candidates.count = 0;
  contacts_known_ = false;
  if (smooth_) smooth_->invalidate(false);
}

// q_m = q + h (1 - theta) v
void Simulation::predict_configuration() {
  Bodies& b = scene.bodies;
  const double ahead = h_ * (1 - strategy.theta);
  cairn_theta_advance(scene.dim, b.dofs(), b.count, ahead, b.velocity.values.data(), b.position.values.data(),
                      scene.dim == 2 ? pointer(b.rotation) : nullptr);
  if (scene.dim == 3 && b.rotation.active) {
    std::int64_t unsolved = 0;
    cairn_rotate(b.count, ahead, b.inertia.values.data(), b.velocity.values.data(), b.rotation.values.data(),
                 pointer(b.angular_momentum), bits(b.driven), &unsolved);
    report.unresolved_rotations = unsolved;
  }
  if (b.angular_momentum.active) { // of bodies whose spin is driven: they turned with their spin
    cairn_momentum_update(b.count, 1, b.inertia.values.data(), b.rotation.values.data(), b.velocity_begin.values.data(),
                          b.velocity.values.data(), b.angular_momentum.values.data(), bits(b.driven));
    b.momentum_begin.values = b.angular_momentum.values;
  }
  advance_cell(ahead);
}

void Simulation::compute_free_velocity() {
  Bodies& b = scene.bodies;
  follow_meshes();
  if (!forces.empty()) add_plugged_forces();
  cairn_theta_free_velocity(scene.dim, b.dofs(), b.count, h_, strategy.theta, scene.gravity.data(),
                            b.mass.values.data(), b.inertia.values.data(), b.velocity.values.data(),
                            b.velocity_free.values.data(), b.inverse_mass.values.data(), pointer(b.force),
                            pointer(b.damping), bits(b.driven), pointer(b.driven_velocity));
  if (b.angular_momentum.active) {
    cairn_inverse_inertia(b.count, b.inertia.values.data(), b.rotation.values.data(), b.inverse_mass.values.data(),
                          b.inverse_inertia.values.data(), bits(b.driven));
    cairn_free_spin(b.count, h_, strategy.theta, b.inertia.values.data(), b.angular_momentum.values.data(),
                    b.inverse_inertia.values.data(), b.velocity.values.data(), b.velocity_free.values.data(),
                    pointer(b.force), pointer(b.damping), bits(b.driven));
  }
  if (!meshes.empty()) {
    const BulkStep bulk = !strategy.explicit_bulk    ? BulkStep::implicit
                          : strategy.refuse_unstable ? BulkStep::central_difference
                                                     : BulkStep::unchecked_central_difference;
    for (MeshBody& mesh : meshes.meshes) mesh.free_velocity(b, scene.gravity.data(), h_, strategy.theta, bulk);
    for (const MeshBody& mesh : meshes.meshes) mesh.follow(b);
  }
  if (!free_velocity) return;
  free_velocity->routine(scene.dim, b.dofs(), b.count, h_, strategy.theta, time, free_velocity->params.data(),
                         b.id.values.data(), b.mass.values.data(), b.inertia.values.data(), b.position.values.data(),
                         b.velocity.values.data(), bits(b.driven), b.velocity_free.values.data(),
                         b.inverse_mass.values.data());
  for (std::int64_t i = 0; i < b.count * b.dofs(); ++i)
    if (!(b.inverse_mass.values[i] >= 0) || !std::isfinite(b.inverse_mass.values[i]))
      throw Error("the plugged free velocity " + free_velocity->name + " gave the inverse mass " +
                  std::to_string(b.inverse_mass.values[i]) + " to body " + std::to_string(*b.id[i / b.dofs()]) +
                  ": give finite numbers >= 0");
}

// Beside the forces that were given; these come back when the step is accounted for.
void Simulation::add_plugged_forces() {
  Bodies& b = scene.bodies;
  if (!b.force.active) b.force.activate(b.count);
  force_given_ = b.force.values;
  for (const PluggedForce& f : forces) {
    f.routine(scene.dim, b.dofs(), b.count, time + strategy.theta * h_, f.params.data(), b.id.values.data(),
              b.mass.values.data(), b.position.values.data(), b.velocity.values.data(), b.force.values.data());
    for (std::int64_t i = 0; i < b.count * b.dofs(); ++i)
      if (!std::isfinite(b.force.values[i]))
        throw Error("the plugged body force " + f.name + " gave " + std::to_string(b.force.values[i]) + " to body " +
                    std::to_string(*b.id[i / b.dofs()]) + ": give finite numbers");
  }
}

void Simulation::leave_plugged_forces() {
  if (!force_given_.empty()) scene.bodies.force.values.swap(force_given_);
  force_given_.clear();
}

// Forces and steps that are each in order may together be too much for a double.
void Simulation::check_free_velocity() const {
  const Bodies& b = scene.bodies;
  for (std::int64_t i = 0; i < b.count; ++i)
    for (int k = 0; k < b.dofs(); ++k)
      if (!std::isfinite(b.velocity_free[i][k]))
        throw Error("velocity of body " + std::to_string(*b.id[i]) + " would not be finite after a step of " +
                    std::to_string(h_) + " s; give smaller forces, a smaller dt or a larger mass");
}

// A pair is a candidate if it could close within the step at the speeds at hand, and a little beyond: five hundredths
// of a radius each, for what collisions may add to the speeds.
void Simulation::measure_margins() {
  const Bodies& b = scene.bodies;
  const Contactors& c = scene.contactors;
  const int nd = b.dofs(), dim = scene.dim;
  margins_.resize(c.count);
  for (std::int64_t k = 0; k < c.count; ++k) {
    const double* v = b.velocity[*c.body[k]];
    const double* v_free = b.velocity_free[*c.body[k]];
    double begin = 0, free = 0, arm = 0, spin = 0;
    for (int d = 0; d < dim; ++d) begin += v[d] * v[d], free += v_free[d] * v_free[d];
    if (c.offset.active) {
      for (int d = 0; d < dim; ++d) arm += c.offset[k][d] * c.offset[k][d];
      for (int d = dim; d < nd; ++d) spin += v_free[d] * v_free[d];
    }
    const double grain = info(Shape(*c.shape[k])).ball() ? *c.radius[k] : 0;
    margins_[k] = 0.05 * grain + h_ * (std::sqrt(std::max(begin, free)) + std::sqrt(arm * spin));
    if (meshes.empty() || !meshes.carries(*c.body[k])) continue;
    // a node has no size: what a cell has counts instead
    margins_[k] = 0.05 * meshes.meshes[meshes.mesh_of(*c.body[k])].size() + h_ * std::sqrt(std::max(begin, free));
  }
}

void Simulation::detect_contacts() {
  check_free_velocity();
  Margin margin{};
  if (std::isnan(strategy.margin)) {
    measure_margins();
    margin.per_contactor = margins_.data();
  } else {
    margin.constant = strategy.margin;
  }
  std::vector<DeclaredPair>& declared = handler.declared();
  declared.clear();
  const auto bonding = [](Law law) { return law_infos()[std::size_t(law)].bonds(); };
  if (std::any_of(laws.laws().begin(), laws.laws().end(), bonding))
    for (const ContactKey& key : interactions.bonds()) {
      const std::int32_t a = contactor(key.contactor_a), b = contactor(key.contactor_b);
      if (a < 0 || b < 0) continue;
      const int entry = laws.find(*scene.contactors.material[a], *scene.contactors.material[b]);
      if (entry >= 0 && bonding(laws.entry(entry).law)) declared.push_back({key.contactor_a, key.contactor_b});
    }
  contacts_known_ = false;
  handler.detect(scene.bodies, scene.contactors, scene.cell, margin, candidates, {}, &interactions.scratch(),
                 &laws.rules());
}

void Simulation::prepare_contacts() {
  if (!strategy.warm_start) interactions.forget_impulses();
  interactions.act_on_surfaces(strategy.act_on_surfaces);
  interactions.hold_at_detection(strategy.act_on_surfaces || strategy.pose.kernel);
  interactions.pose(strategy.pose);
  interactions.assemble(scene.bodies, scene.contactors, candidates, laws, scene.cell, h_, strategy.theta, &meshes);
  contacts_known_ = true;
}

void Simulation::solve_contacts() { report.solve = interactions.solve(scene.bodies, strategy.solver); }

void Simulation::update_velocity() {
  Bodies& b = scene.bodies;
  if (b.reaction.active) std::fill(b.reaction.values.begin(), b.reaction.values.end(), 0.0);
  std::swap(b.velocity_begin.values, b.velocity.values); // with the spin that the contacts saw
  interactions.update_velocity(b);
  if (b.angular_momentum.active)
    cairn_momentum_update(b.count, 1, b.inertia.values.data(), b.rotation.values.data(), b.velocity_begin.values.data(),
                          b.velocity.values.data(), b.angular_momentum.values.data(), bits(b.driven));
}

// Energy is measured here, where the inertia of turning bodies is still that of the contacts.
void Simulation::commit_contacts() {
  if (!meshes.empty())
    for (MeshBody& mesh : meshes.meshes) mesh.account(scene.bodies, scene.gravity.data());
  const ContactEnergy contacts = interactions.commit();
  account(contacts);
  account_for_meshes();
}

void Simulation::account(const ContactEnergy& contacts) {
  Bodies& b = scene.bodies;
  double terms[8];
  cairn_energy_terms(scene.dim, b.dofs(), b.count, h_, strategy.theta, scene.gravity.data(), b.mass.values.data(),
                     b.inertia.values.data(), b.velocity_begin.values.data(), b.velocity.values.data(), terms,
                     pointer(b.force), pointer(b.damping), bits(b.driven), pointer(b.reaction),
                     pointer(b.momentum_begin), pointer(b.angular_momentum));
  const auto [kinetic, d_kinetic, d_potential, external, driven, bulk, by_theta, fall] = terms;
  energy.kinetic = kinetic;
  energy.potential += d_potential;
  energy.work_external += external;
  energy.work_driven += driven + contacts.cell_work;
  energy.dissipated_normal += contacts.normal;
  energy.dissipated_friction += contacts.tangential;
  energy.dissipated_bulk += bulk;
  energy.dissipated_theta += by_theta;
  energy.closure += d_kinetic + d_potential - external - driven - contacts.cell_work + contacts.normal +
                    contacts.tangential + bulk + by_theta;
  energy.turned_over += std::abs(d_potential) + std::abs(external) + std::abs(driven) + std::abs(contacts.normal) +
                        std::abs(contacts.tangential) + std::abs(bulk);
  energy.largest_kinetic = std::max({energy.largest_kinetic, kinetic, kinetic - d_kinetic});
  energy.in_play = energy.largest_kinetic + energy.turned_over;
  const double of_step = std::max(kinetic, kinetic - d_kinetic) + contacts.turned_over + fall;
  report.solve.energy_created = of_step > 0 ? contacts.created / of_step : 0;
}

// q+ = q_m + h theta v+
void Simulation::update_configuration() {
  Bodies& b = scene.bodies;
  leave_plugged_forces();
  const double ahead = h_ * strategy.theta;
  cairn_theta_advance(scene.dim, b.dofs(), b.count, ahead, b.velocity.values.data(), b.position.values.data(),
                      scene.dim == 2 ? pointer(b.rotation) : nullptr);
  if (scene.dim == 3 && b.rotation.active) {
    std::int64_t unsolved = 0;
    cairn_rotate(b.count, ahead, b.inertia.values.data(), b.velocity.values.data(), b.rotation.values.data(),
                 pointer(b.angular_momentum), bits(b.driven), &unsolved);
    report.unresolved_rotations += unsolved;
  }
  if (b.angular_momentum.active)
    cairn_momentum_update(b.count, 0, b.inertia.values.data(), b.rotation.values.data(), b.velocity_begin.values.data(),
                          b.velocity.values.data(), b.angular_momentum.values.data(), bits(b.driven));
  advance_cell(ahead);
  follow_meshes();
  if (scene.cell.any()) wrap_into_cell();
  report.step = ++steps;
  report.h = h_;
  report.time_detection = time + h_ * (1 - strategy.theta);
  report.time = time += h_;
  report.contacts = candidates.count;
  report.energy = energy;
  begun_ = false;
}

std::pair<std::int64_t, std::int64_t> Simulation::bytes() {
  std::int64_t bodies = 0;
  auto add = [&bodies](auto& field) { bodies += field.values.capacity() * sizeof(field.values[0]); };
  scene.bodies.for_each_field(add);
  scene.contactors.for_each_field(add);
  bodies += margins_.capacity() * sizeof(double) + handler.bytes() + interactions.body_bytes();
  bodies += 4 * (scene.insertion_order().capacity() + scene.contactor_insertion_order().capacity());
  std::int64_t contacts = interactions.bytes();
  contacts += 4 * (candidates.contactor_a.capacity() + candidates.contactor_b.capacity() +
                   candidates.feature.capacity() + candidates.image.capacity());
  contacts += 8 * (candidates.gap.capacity() + candidates.normal.capacity() + candidates.point.capacity());
  for (const MeshBody& mesh : meshes.meshes) bodies += mesh.bytes();
  if (smooth_) {
    bodies += smooth_->body_bytes();
    contacts += smooth_->contact_bytes();
  }
  return {bodies, contacts};
}

} // namespace cairn
