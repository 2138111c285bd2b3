// The stages of NSCD: what step() calls, one function each.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../../base/call.hpp"
#include "../../base/stopwatch.hpp"
#include "../../laws/bond_laws.hpp"
#include "../../meshes/mesh_rates.hpp"
#include "../../networks/network.hpp"
#include "../../networks/unknowns.hpp"
#include "../../simulation/controls.hpp"
#include "../../solvers/sweeps/extrapolation.hpp"
#include "nscd.hpp"

namespace cairn {
std::vector<std::pair<std::string_view, double>> Nscd::figures(Simulation& s) {
  const ContactSystem& system = s.interactions.system();
  if (!s.contacts_known || system.batches.empty()) return {};
  const ExtrapolationGrounds grounds = extrapolation_grounds(system);
  return {{"extrapolates", grounds.extrapolates()},
          {"mass_ratio", grounds.mass_ratio},
          {"faced_share", grounds.faced_share}};
}

double Nscd::stable_step(Simulation& s) {
  const cairn_scheme scheme = settings.integrator.scheme(1); // none of its shares is of the step
  const DragBound drag = drag_bound(scheme);
  double least = std::numeric_limits<double>::infinity();
  for (MeshBody& mesh : s.meshes.meshes) {
    if (!std::isfinite(scheme.largest)) continue;
    least = std::min(least, scheme.largest / 2 * mesh.stable_step(drag.rate, s.scene.nodes) / drag.frequency);
    if (drag.frequency < 1) least = std::min(least, scheme.largest / 2 * mesh.stable_step(0, s.scene.nodes));
  }
  return least;
}

void Nscd::begin_step(Simulation& s, double h) {
  if (!(h > 0) || !std::isfinite(h)) throw Error("dt is " + std::to_string(h) + "; give a positive, finite step [s]");
  check_scene(s);
  check_laws(s);
  if (!s.laws.curves().empty() && !s.scene.bodies.temperature.active)
    throw Error("a parameter of a law depends on temperature, and the scene has none: call scene.thermal(...)");
  keep_shown(s); // with the numbers that contacts know
  h_ = h;
  scheme_ = settings.integrator.scheme(h);
  s.apply_controls(h, scheme_.end_share, !settings.pose.kernel);
  // Order is state, and changes with the number of the step alone.
  if (s.steps > 0 && s.steps % settings.renumber_every == 0) s.scene.renumber();
  if (s.scene.cell.any()) s.wrap_into_cell(); // bodies set outside the cell from outside; images of contacts follow
  s.place_meshes();
  constexpr double swept_sooner = 0x1p26; // by reaches, where nothing but sweeps asks for compliances [bytes]
  const double most = settings.solver.max_bytes;
  s.meshes.compliance_bytes = {most, settings.solver.solver == "nlgs" ? std::min(most, swept_sooner) : most};
  try {
    start_histories(s);
  } catch (...) {
    for (std::size_t k = 0; k < s.meshes.meshes.size(); ++k) s.meshes.meshes[k].put_back(shown_.meshes[k]);
    throw;
  }
  save_begin(s);
  Bodies& b = s.scene.bodies;
  const double* temperature = values_of(b.temperature, s.scene.nodes.temperature, temperature_);
  if (s.networks && s.networks->thermal) temperature = s.networks->thermal->seen(temperature);
  s.interactions.act_at(temperature, values_of(b.potential, s.scene.nodes.potential, potential_));
  make_bonds(s);
  stiffened_.clear();
  seated_ = false;
  seated_work_ = 0;
  begun_ = true;
}

void Nscd::save_begin(Simulation& s) {
  Bodies& b = s.scene.bodies;
  b.position_begin.values = b.position.values;
  b.velocity_begin.values = b.velocity.values;
  if (b.rotation.active) b.rotation_begin.values = b.rotation.values;
  if (b.angular_momentum.active) b.momentum_begin.values = b.angular_momentum.values;
  Nodes& nodes = s.scene.nodes;
  nodes.position_begin.values = nodes.position.values;
  nodes.velocity_begin.values = nodes.velocity.values;
  cell_begin_ = s.scene.cell;
}

void Nscd::undo_step(Simulation& s) {
  if (!begun_) return;
  for (MeshBody& mesh : s.meshes.meshes) mesh.roll_back();
  if (started_) changed(s, true); // other forces may be there when the next step begins
  leave_plugged_forces(s);
  Bodies& b = s.scene.bodies;
  b.position.values = b.position_begin.values;
  b.velocity.values = b.velocity_begin.values;
  if (b.rotation.active) b.rotation.values = b.rotation_begin.values;
  if (b.angular_momentum.active) {
    b.angular_momentum.values = b.momentum_begin.values;
    // of bodies whose spin is driven it followed their orientation
    cairn_momentum_update(b.count, 1, b.inertia.values.data(), b.rotation.values.data(), b.velocity.values.data(),
                          b.velocity.values.data(), b.angular_momentum.values.data(), bits(b.driven));
  }
  Nodes& nodes = s.scene.nodes;
  nodes.position.values = nodes.position_begin.values;
  nodes.velocity.values = nodes.velocity_begin.values;
  s.scene.cell = cell_begin_;
  begun_ = false;
  Shown shown; // that forgotten contacts take along
  std::swap(shown, shown_);
  s.forget_contacts();
  std::swap(shown, shown_);
  show_again(s, shown_);
}

// Time from the begin of the step to detection [s]. Impulses move bodies by a share of the step, mostly by the mean of
// the velocities at both ends; an integrator that keeps derivatives adds a part of its own. Where the rest of the step
// after detection equals that share, the work of impulses along the axes of a joint or bond is of second order. Axes of
// another time would give stiff joints an error in energy and angular momentum proportional to the offset in time.
double Nscd::flight_to_detection(const Simulation& s) const {
  const auto holds = [](Law law) {
    const LawInfo& of = law_infos()[std::size_t(law)];
    return of.joins || of.spans || can_bond(law);
  };
  const std::vector<Law>& laws = s.laws.laws();
  double ahead = h_ * (1 - scheme_.share);
  if (scheme_.histories > 0 && std::any_of(laws.begin(), laws.end(), holds)) ahead -= scheme_.position[0] / h_;
  return ahead;
}

// q_m: the displacement of the step without what the velocity at its end adds, nor what an integrator keeps: that is
// undone by the impulses of contacts on what rests.
void Nscd::predict_configuration(Simulation& s) {
  Bodies& b = s.scene.bodies;
  const double ahead = ahead_ = flight_to_detection(s);
  cairn_theta_advance(s.scene.dim, b.dofs(), b.count, ahead, b.velocity.values.data(), b.position.values.data(),
                      s.scene.dim == 2 ? pointer(b.rotation) : nullptr);
  Nodes& nodes = s.scene.nodes;
  cairn_theta_advance(nodes.dim, nodes.dim, nodes.count, ahead, nodes.velocity.values.data(),
                      nodes.position.values.data(), nullptr);
  if (s.scene.dim == 3 && b.rotation.active) {
    std::int64_t unsolved = 0;
    cairn_rotate(b.count, ahead, b.inertia.values.data(), b.velocity.values.data(), b.rotation.values.data(),
                 pointer(b.angular_momentum), bits(b.driven), &unsolved);
    s.report.unresolved_rotations = unsolved;
  }
  if (b.angular_momentum.active) { // of bodies whose spin is driven: they turned with their spin
    cairn_momentum_update(b.count, 1, b.inertia.values.data(), b.rotation.values.data(), b.velocity_begin.values.data(),
                          b.velocity.values.data(), b.angular_momentum.values.data(), bits(b.driven));
    b.momentum_begin.values = b.angular_momentum.values;
  }
  s.advance_cell(ahead);
}

void Nscd::compute_free_velocity(Simulation& s) {
  Bodies& b = s.scene.bodies;
  s.follow_meshes();
  if (!s.forces.empty()) add_plugged_forces(s);
  const std::int64_t n = s.scene.bodies.count;
  cairn_theta_free_velocity(s.scene.dim, b.dofs(), n, scheme_.impulse, scheme_.implicit, s.scene.gravity.data(),
                            b.mass.values.data(), b.inertia.values.data(), b.velocity.values.data(),
                            b.velocity_free.values.data(), b.inverse_mass.values.data(), pointer(b.force),
                            pointer(b.damping), bits(b.driven), pointer(b.driven_velocity));
  for (int k = 0; k < scheme_.histories; ++k)
    cairn_history_velocity(b.dofs(), n, &scheme_, k + 1, b.history(k), b.inverse_mass.values.data(),
                           b.velocity_free.values.data(), pointer(b.damping));
  if (b.angular_momentum.active) {
    cairn_inverse_inertia(n, b.inertia.values.data(), b.rotation.values.data(), b.inverse_mass.values.data(),
                          b.inverse_inertia.values.data(), bits(b.driven));
    cairn_free_spin(n, h_, scheme_.share, b.inertia.values.data(), b.angular_momentum.values.data(),
                    b.inverse_inertia.values.data(), b.velocity.values.data(), b.velocity_free.values.data(),
                    pointer(b.force), pointer(b.damping), bits(b.driven));
  }
  if (!s.meshes.empty()) {
    if (s.networks && s.networks->thermal) s.networks->thermal->load_meshes(s);
    for (MeshBody& mesh : s.meshes.meshes) {
      const Stopwatch first_pass(mesh.linear() ? nullptr : &s.pass_seconds.all);
      mesh.loads.time = s.time;
      mesh.free_velocity(s.scene.nodes, s.scene.gravity.data(), scheme_, settings.refuse_unstable);
    }
  }
  if (!s.free_velocity) return;
  s.free_velocity->routine(s.scene.dim, b.dofs(), n, h_, scheme_.share, s.time, s.free_velocity->params.data(),
                           b.id.values.data(), b.mass.values.data(), b.inertia.values.data(), b.position.values.data(),
                           b.velocity.values.data(), bits(b.driven), b.velocity_free.values.data(),
                           b.inverse_mass.values.data());
  for (std::int64_t i = 0; i < n * b.dofs(); ++i)
    if (!(b.inverse_mass.values[i] >= 0) || !std::isfinite(b.inverse_mass.values[i]))
      throw Error("the plugged free velocity " + s.free_velocity->name + " gave the inverse mass " +
                  std::to_string(b.inverse_mass.values[i]) + " to body " + std::to_string(*b.id[i / b.dofs()]) +
                  ": give finite numbers >= 0");
}

// Beside the forces that were given; these come back when the step is accounted for.
void Nscd::add_plugged_forces(Simulation& s) {
  Bodies& b = s.scene.bodies;
  if (!b.force.active) b.force.activate(b.count);
  force_given_ = b.force.values;
  const std::int64_t n = s.scene.bodies.count;
  for (const PluggedForce& f : s.forces) {
    f.routine(s.scene.dim, b.dofs(), n, s.time + scheme_.end_share * h_, f.params.data(), b.id.values.data(),
              b.mass.values.data(), b.position.values.data(), b.velocity.values.data(), b.force.values.data());
    for (std::int64_t i = 0; i < n * b.dofs(); ++i)
      if (!std::isfinite(b.force.values[i]))
        throw Error("the plugged body force " + f.name + " gave " + std::to_string(b.force.values[i]) + " to body " +
                    std::to_string(*b.id[i / b.dofs()]) + ": give finite numbers");
  }
}

void Nscd::leave_plugged_forces(Simulation& s) {
  if (!force_given_.empty()) s.scene.bodies.force.values.swap(force_given_);
  force_given_.clear();
}

// Forces and steps that are each in order may together be too much for a double.
void Nscd::check_free_velocity(const Simulation& s) const {
  const auto check = [&](const char* what, const Field<double>& velocity, const Field<std::int64_t>& id) {
    for (std::size_t i = 0; i < velocity.values.size(); ++i)
      if (!std::isfinite(velocity.values[i]))
        throw Error(std::string("velocity of ") + what + " " +
                    std::to_string(*id[std::int64_t(i) / velocity.components]) +
                    " would not be finite after a step of " + std::to_string(h_) +
                    " s; give smaller forces, a smaller dt or a larger mass");
  };
  check("body", s.scene.bodies.velocity_free, s.scene.bodies.id);
  check("node", s.scene.nodes.velocity_free, s.scene.nodes.id);
}

// A pair is a candidate if it could close within the step at the speeds at hand, and a little beyond: five hundredths
// of a radius each, for what collisions may add to the speeds. Returns the longest way of a body over its size.
double Nscd::measure_margins(Simulation& s) {
  double longest = 0;
  const Bodies& b = s.scene.bodies;
  const Contactors& c = s.scene.contactors;
  const int nd = b.dofs(), dim = s.scene.dim;
  margins_.resize(c.count);
  for (std::int64_t k = 0; k < c.count; ++k) {
    if (*c.body[k] < 0) {
      margins_[k] = margin_of_mapped(s, std::int32_t(k));
      continue;
    }
    const double* v = b.velocity[*c.body[k]];
    const double* v_free = b.velocity_free[*c.body[k]];
    double begin = 0, free = 0, arm = 0, spin = 0, grown = 0;
    for (int d = 0; d < dim; ++d) begin += v[d] * v[d], free += v_free[d] * v_free[d];
    if (c.offset.active) {
      for (int d = 0; d < dim; ++d) arm += c.offset[k][d] * c.offset[k][d];
      for (int d = dim; d < nd; ++d) spin += v_free[d] * v_free[d];
    }
    const double grain = info(Shape(*c.shape[k])).ball() ? *c.radius[k] : 0;
    if (b.stretch.active) { // a gap that shrinking left is closed, whatever the speeds at hand
      const double size = *c.radius[k] + std::sqrt(arm);
      grown = std::abs(*b.stretch[*c.body[k]]) * size;
      for (int d = 0; d < dim && b.bend.active; ++d) grown += 1.5 * std::abs(b.bend[*c.body[k]][d]) * size * size;
    }
    const double speed = std::sqrt(std::max(begin, free));
    margins_[k] = 0.05 * grain + grown + h_ * (speed + std::sqrt(arm * spin));
    if (!(speed > 0)) continue;
    const double size = grain > 0 ? grain : c.size(std::int32_t(k));
    if (size > 0 && h_ * speed > longest * size) longest = h_ * speed / size;
  }
  return longest;
}

// Search margin of a mesh contactor [m]: a node has no size, so the size of a cell counts instead.
double Nscd::margin_of_mapped(const Simulation& s, std::int32_t contactor) const {
  const MeshSet::Middle& middle = s.meshes.middle(contactor);
  double begin = 0, free = 0;
  for (int d = 0; d < s.scene.dim; ++d) {
    const double v = middle.of(s.scene.nodes.velocity, d), v_free = middle.of(s.scene.nodes.velocity_free, d);
    begin += v * v;
    free += v_free * v_free;
  }
  return 0.05 * s.meshes.meshes[s.meshes.mesh_of(contactor)].size() + h_ * std::sqrt(std::max(begin, free));
}

std::vector<RimSeat> Nscd::seats_of_contactors(const Simulation& s) {
  std::vector<RimSeat> seats;
  for (const RimSeat& seat : s.interactions.memory().seats)
    if (const std::int32_t node = s.contactor(seat.node), side = s.contactor(seat.side); node >= 0 && side >= 0)
      seats.push_back({node, side, seat.face});
  return seats;
}

void Nscd::detect_contacts(Simulation& s) {
  check_free_velocity(s);
  Margin margin{};
  double reach = 0; // of laws that act before bodies touch
  for (int e = 0; e < s.laws.entries(); ++e)
    reach = std::max(reach, law_infos()[std::size_t(s.laws.entry(e).law)].acts_from(s.laws.entry(e).params));
  if (std::isnan(settings.margin)) {
    s.report.way = measure_margins(s);
    for (double& m : margins_) m += reach;
    margin.per_contactor = margins_.data();
  } else {
    margin.constant = std::max(settings.margin, reach);
  }
  std::vector<DeclaredPair>& declared = s.handler.declared();
  declared.clear();
  const auto keeps = [](Law law) { return law_infos()[std::size_t(law)].keeps; };
  if (std::any_of(s.laws.laws().begin(), s.laws.laws().end(), keeps))
    for (const ContactKey& key : s.interactions.kept()) {
      const std::int32_t a = s.contactor(key.contactor_a), b = s.contactor(key.contactor_b);
      if (a < 0 || b < 0) continue;
      const int entry = s.laws.find(*s.scene.contactors.material[a], *s.scene.contactors.material[b]);
      if (entry >= 0 && keeps(s.laws.entry(entry).law)) declared.push_back({key.contactor_a, key.contactor_b});
    }
  s.contacts_known = shows_kept_ = false;
  const std::vector<RimSeat> seats = seats_of_contactors(s);
  s.handler.detect(s.scene.bodies, s.scene.contactors, s.scene.cell, margin, s.candidates,
                   {.mapped = &s.meshes.mapped(), .seats = seats, .step = h_, .soon_again = true},
                   &s.interactions.scratch(), &s.laws.rules());
  s.meshes.let_past_ends(s.candidates);
  s.meshes.weigh_mortar(s.scene.nodes, {s.scene.contactors, margin, s.laws.rules(), s.scene.cell}, s.candidates);
  measure_anchored(s);
  look_at_meshes(s);
  look_for_nested_meshes(s);
}

void Nscd::prepare_contacts(Simulation& s) {
  const Stopwatch watch(s.meshes.linear() ? nullptr : &s.pass_seconds.contacts);
  if (!settings.warm_start) s.interactions.forget_impulses();
  s.interactions.act_on_surfaces(settings.act_on_surfaces);
  s.interactions.hold_at_detection(settings.act_on_surfaces || settings.pose.kernel);
  constexpr double slow = 0.01;
  const bool beside = scheme_.stiffness > 0 && scheme_.histories > 0 && std::abs(scheme_.position[0]) > 0;
  s.interactions.correct_meshes_by(beside ? slow : 1);
  const bool by_theta = settings.integrator.name == "theta";
  s.interactions.centre_joints(by_theta ? law_share() : 0.5, by_theta ? law_share() : 1 - ahead_ / h_);
  s.interactions.limit_overlap(settings.overlap);
  s.interactions.pose(settings.pose);
  assemble_contacts(s);
  seat_joints(s);
  if (stiffen_joints(s)) assemble_contacts(s);
  s.contacts_known = true;
}

void Nscd::assemble_contacts(Simulation& s) {
  s.interactions.assemble(s.scene.bodies, s.scene.contactors, s.candidates, s.laws, s.scene.cell, h_, law_share(),
                          &s.meshes, &s.scene.nodes);
}

void Nscd::solve_contacts(Simulation& s) {
  const Stopwatch watch(s.meshes.linear() ? nullptr : &s.pass_seconds.contacts);
  const bool driven = s.controls && s.controls->has_cell();
  s.report.solve = s.interactions.solve(s.scene.bodies, settings.solver, driven ? &s.scene.cell : nullptr);
  hold_joints(s);
  stiffen_further(s);
}

void Nscd::update_velocity(Simulation& s) {
  Bodies& b = s.scene.bodies;
  if (b.reaction.active) std::fill(b.reaction.values.begin(), b.reaction.values.end(), 0.0);
  std::swap(b.velocity_begin.values, b.velocity.values); // with the spin that the contacts saw
  std::swap(s.scene.nodes.velocity_begin.values, s.scene.nodes.velocity.values);
  Cell& cell = s.scene.cell;
  if (cell.moves()) // its part in the work of contacts is by the mean of both ends, as that of bodies
    for (int e = 0; e < 9; ++e) {
      cell_rate_[e] = cell.velocity_gradient[e];
      cell.velocity_gradient[e] = 0.5 * (cell_begin_.velocity_gradient[e] + cell_rate_[e]);
    }
  s.interactions.update_velocity(b);
  if (cell.moves()) std::copy(std::begin(cell_rate_), std::end(cell_rate_), cell.velocity_gradient);
  if (b.angular_momentum.active)
    cairn_momentum_update(b.count, 1, b.inertia.values.data(), b.rotation.values.data(), b.velocity_begin.values.data(),
                          b.velocity.values.data(), b.angular_momentum.values.data(), bits(b.driven));
}

// Energy is measured here, where the inertia of turning bodies is still that of the contacts.
void Nscd::commit_contacts(Simulation& s) {
  measure_histories(s);
  if (!s.meshes.empty())
    for (MeshBody& mesh : s.meshes.meshes) mesh.account(s.scene.nodes, s.scene.gravity.data());
  const ContactEnergy contacts = s.interactions.commit(s.report.solve.status == SolveStatus::converged);
  account(s, contacts);
  s.account_for_meshes();
  s.advance_networks(h_);
}

void Nscd::account(Simulation& s, const ContactEnergy& contacts) {
  Bodies& b = s.scene.bodies;
  Nodes& nodes = s.scene.nodes;
  double terms[8], of_nodes[8];
  const cairn_scheme* scheme = settings.integrator.name == "theta" ? nullptr : &scheme_;
  const bool keeps = scheme_.histories > 0;
  cairn_energy_terms(s.scene.dim, b.dofs(), b.count, h_, scheme_.share, s.scene.gravity.data(), b.mass.values.data(),
                     b.inertia.values.data(), b.velocity_begin.values.data(), b.velocity.values.data(), terms,
                     pointer(b.force), pointer(b.damping), bits(b.driven), pointer(b.reaction),
                     pointer(b.momentum_begin), pointer(b.angular_momentum), scheme, keeps ? way_.data() : nullptr,
                     b.history(0), b.history(1), b.history(2), b.history(3));
  if (nodes.count > 0) {
    cairn_energy_terms(nodes.dim, nodes.dim, nodes.count, h_, scheme_.share, s.scene.gravity.data(),
                       nodes.mass.values.data(), nullptr, nodes.velocity_begin.values.data(),
                       nodes.velocity.values.data(), of_nodes, nodes.force.values.data(), nullptr, nullptr, nullptr,
                       nullptr, nullptr, scheme, keeps ? node_way_.data() : nullptr, nodes.history(0), nodes.history(1),
                       nodes.history(2), nodes.history(3));
    for (int k = 0; k < 8; ++k) terms[k] += of_nodes[k];
  }
  const auto [kinetic, d_kinetic, d_potential, external, driven, bulk, by_theta, fall] = terms;
  s.energy.kinetic = kinetic;
  s.energy.potential += d_potential + seated_work_;
  s.energy.work_projection += seated_work_;
  s.energy.work_external += external;
  s.energy.work_driven += driven + contacts.jump_work + contacts.driven;
  s.energy.dissipated_normal += contacts.normal;
  s.energy.dissipated_friction += contacts.tangential;
  s.energy.dissipated_bulk += bulk;
  double strained = 0; // what growth gave to the springs of contacts between two steps
  if (b.stretch.active) {
    double before = s.energy.stored;
    for (const MeshBody& mesh : s.meshes.meshes)
      before -= mesh.work.stored - mesh.work.stored_change - mesh.work.warmed;
    strained = contacts.stored - before - contacts.stored_change;
  }
  s.energy.work_growth += contacts.grown + strained;
  s.energy.stored = contacts.stored;
  s.energy.released += contacts.released;
  const double stiffened = energy_of_stiffened(s);
  s.energy.dissipated_integrator += by_theta + stiffened;
  s.energy.closure += d_kinetic + d_potential - external - driven - contacts.jump_work - contacts.driven +
                      contacts.normal + contacts.tangential + bulk + by_theta + stiffened +
                      (contacts.stored_change + contacts.released) - contacts.grown;
  s.energy.turned_over += std::abs(d_potential) + std::abs(seated_work_) + std::abs(external) + std::abs(driven) +
                          std::abs(contacts.normal) + std::abs(contacts.tangential) + std::abs(bulk) +
                          (std::abs(contacts.stored_change) + contacts.released) + std::abs(strained);
  // Nodes count as points of mass here; what the mass matrix of a mesh adds to that belongs to the largest, too.
  double moving = kinetic, moved = kinetic - d_kinetic;
  for (const MeshBody& mesh : s.meshes.meshes) {
    moving += mesh.work.kinetic;
    moved += mesh.work.kinetic - mesh.work.kinetic_change;
  }
  s.energy.largest_kinetic = std::max({s.energy.largest_kinetic, moving, moved});
  s.energy.in_play = s.energy.largest_kinetic + s.energy.turned_over;
  // a broken bond bears nothing at the end of the step, but released the energy of its springs in it
  const double of_springs = std::abs(contacts.stored_change) + contacts.released;
  const double of_step = std::max(moving, moved) + contacts.turned_over + of_springs + fall + std::abs(strained);
  // bodies at rest have rounding errors alone
  const bool moves = of_step > std::numeric_limits<double>::epsilon() * s.energy.in_play;
  s.report.solve.energy_created = moves ? contacts.created / of_step : 0;
}

// The rest of the displacement, and what the integrator keeps of the step.
void Nscd::update_configuration(Simulation& s) {
  Bodies& b = s.scene.bodies;
  leave_plugged_forces(s);
  if (scheme_.histories > 0) {
    cairn_theta_advance(s.scene.dim, b.dofs(), b.count, 1, way_.data(), b.position.values.data(),
                        s.scene.dim == 2 ? pointer(b.rotation) : nullptr);
    cairn_history_update(s.scene.dim, b.dofs(), b.count, &scheme_, change_.data(), b.inertia.values.data(),
                         b.history(0), b.history(1), b.history(2), b.history(3));
    Nodes& nodes = s.scene.nodes;
    cairn_theta_advance(nodes.dim, nodes.dim, nodes.count, 1, node_way_.data(), nodes.position.values.data(), nullptr);
    cairn_history_update(nodes.dim, nodes.dim, nodes.count, &scheme_, node_change_.data(), nullptr, nodes.history(0),
                         nodes.history(1), nodes.history(2), nodes.history(3));
  }
  Nodes& nodes = s.scene.nodes;
  const auto advance = [&](double time, Field<double>& of_bodies, Field<double>& of_nodes) {
    cairn_theta_advance(s.scene.dim, b.dofs(), b.count, time, of_bodies.values.data(), b.position.values.data(),
                        s.scene.dim == 2 ? pointer(b.rotation) : nullptr);
    cairn_theta_advance(nodes.dim, nodes.dim, nodes.count, time, of_nodes.values.data(), nodes.position.values.data(),
                        nullptr);
  };
  const double before = h_ * (1 - scheme_.share), moved = before - ahead_;
  constexpr double rounding = 1e-9;
  const bool elsewhere = std::abs(moved) > rounding * h_; // contacts were detected where impulses act
  const double rest = elsewhere ? h_ - ahead_ : h_ * scheme_.share;
  if (elsewhere) advance(moved, b.velocity_begin, nodes.velocity_begin);
  advance(h_ * scheme_.share, b.velocity, nodes.velocity);
  if (s.scene.dim == 3 && b.rotation.active) {
    std::int64_t unsolved = 0;
    cairn_rotate(b.count, rest, b.inertia.values.data(), b.velocity.values.data(), b.rotation.values.data(),
                 pointer(b.angular_momentum), bits(b.driven), &unsolved);
    s.report.unresolved_rotations += unsolved;
  }
  if (b.angular_momentum.active)
    cairn_momentum_update(b.count, 0, b.inertia.values.data(), b.rotation.values.data(), b.velocity_begin.values.data(),
                          b.velocity.values.data(), b.angular_momentum.values.data(), bits(b.driven));
  s.advance_cell(rest);
  s.follow_meshes();
  if (s.scene.cell.any()) s.wrap_into_cell();
  s.tell_of_small_turns();
  s.report.step = ++s.steps;
  s.report.h = h_;
  s.report.time_detection = s.time + ahead_;
  s.report.time = s.time += h_;
  s.report.contacts = s.candidates.count;
  s.report.energy = s.energy;
  if (s.report.solve.hint.empty()) s.report.solve.hint = s.report.mesh_within;
  if (s.report.solve.hint.empty()) s.report.solve.hint = s.report.unjoined;
  if (s.report.solve.hint.empty()) s.report.solve.hint = s.report.mesh_hint;
  begun_ = false;
  for (MeshBody& mesh : s.meshes.meshes) mesh.commit();
}

} // namespace cairn
