// The stages of NSCD: what step() calls, one function each.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../../base/call.hpp"
#include "../../base/stopwatch.hpp"
#include "../../fluid/fluid.hpp"
#include "../../laws/bond_laws.hpp"
#include "../../meshes/mesh_rates.hpp"
#include "../../networks/network.hpp"
#include "../../networks/unknowns.hpp"
#include "../../simulation/controls.hpp"
#include "../../solvers/nlgs/extrapolation.hpp"
#include "nscd.hpp"
#include "step_energy.hpp"

namespace cairn {
namespace {

// Forces and steps that are each in order may together be too much for a double.
void check_free_velocity(const Simulation& s, double h) {
  const auto check = [&](const char* what, const Field<double>& velocity, const Field<std::int64_t>& id) {
    for (std::size_t i = 0; i < velocity.values.size(); ++i)
      if (!std::isfinite(velocity.values[i]))
        throw Error(std::string("velocity of ") + what + " " +
                    std::to_string(*id[std::int64_t(i) / velocity.components]) +
                    " would not be finite after a step of " + std::to_string(h) +
                    " s; give smaller forces, a smaller dt or a larger mass");
  };
  check("body", s.scene.bodies.velocity_free, s.scene.bodies.id);
  check("node", s.scene.nodes.velocity_free, s.scene.nodes.id);
}

// By internal numbers.
std::vector<RimSeat> seats_of_contactors(const Simulation& s) {
  std::vector<RimSeat> seats;
  for (const RimSeat& seat : s.interactions.memory().seats)
    if (const std::int32_t node = s.contactor(seat.node), side = s.contactor(seat.side); node >= 0 && side >= 0)
      seats.push_back({node, side, seat.face});
  return seats;
}

} // namespace

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
  views_.keep(s, settings.cut_back > 0 || !s.meshes.linear()); // with the numbers that contacts know
  step_.h = h;
  step_.scheme = settings.integrator.scheme(h);
  s.apply_controls(h, step_.scheme.end_share, !settings.pose.kernel);
  // Order is state, and changes with the number of the step alone.
  if (s.steps > 0 && s.steps % settings.renumber_every == 0) s.scene.renumber();
  if (s.scene.cell.any()) s.wrap_into_cell(); // bodies set outside the cell from outside; images of contacts follow
  s.place_meshes();
  constexpr double swept_sooner = 0x1p26; // by reaches, where nothing but sweeps asks for compliances [bytes]
  const double most = settings.solver.max_bytes;
  const bool swept = settings.solver.solver == "nlgs";
  s.meshes.compliance_bytes = {most, swept ? std::min(most, swept_sooner) : most};
  bool anew = false;
  try {
    anew = histories_.start(s, step_);
  } catch (...) {
    views_.put_back_meshes(s);
    throw;
  }
  begin_.save(s);
  Bodies& b = s.scene.bodies;
  const double* temperature = values_of(b.temperature, s.scene.nodes.temperature, temperature_);
  if (s.networks && s.networks->thermal) temperature = s.networks->thermal->seen(temperature);
  s.interactions.act_at(temperature, values_of(b.potential, s.scene.nodes.potential, potential_));
  bonds_.make(s, step_, [&] {
    s.contacts_known = false;
    views_.hide();
    compute_free_velocity(s);
  });
  stiff_.begin();
  seats_.begin();
  phase_ = anew ? Phase::begun_with_new_histories : Phase::begun;
}

void Nscd::undo_step(Simulation& s) {
  if (phase_ == Phase::none) return;
  for (MeshBody& mesh : s.meshes.meshes) mesh.roll_back();
  if (phase_ == Phase::begun_with_new_histories)
    forget_histories(s); // other forces may be there when the next step begins
  forces_.leave(s);
  begin_.restore(s);
  phase_ = Phase::none;
  LastViews kept; // views that forgotten contacts take along
  std::swap(kept, views_);
  s.forget_contacts();
  std::swap(kept, views_);
  views_.show(s);
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
  double ahead = step_.h * (1 - step_.scheme.share);
  if (step_.scheme.histories > 0 && std::any_of(laws.begin(), laws.end(), holds))
    ahead -= step_.scheme.position[0] / step_.h;
  return ahead;
}

// q_m: the displacement of the step without what the velocity at its end adds, nor what an integrator keeps: that is
// undone by the impulses of contacts on what rests.
void Nscd::predict_configuration(Simulation& s) {
  Bodies& b = s.scene.bodies;
  const double ahead = step_.ahead = flight_to_detection(s);
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
  if (!s.forces.empty()) forces_.add(s, step_);
  const std::int64_t n = s.scene.bodies.count;
  cairn_theta_free_velocity(s.scene.dim, b.dofs(), n, step_.scheme.impulse, step_.scheme.implicit,
                            s.scene.gravity.data(), b.mass.values.data(), b.inertia.values.data(),
                            b.velocity.values.data(), b.velocity_free.values.data(), b.inverse_mass.values.data(),
                            pointer(b.force), pointer(b.damping), bits(b.driven), pointer(b.driven_velocity));
  for (int k = 0; k < step_.scheme.histories; ++k)
    cairn_history_velocity(b.dofs(), n, &step_.scheme, k + 1, b.history(k), b.inverse_mass.values.data(),
                           b.velocity_free.values.data(), pointer(b.damping));
  if (b.angular_momentum.active) {
    cairn_inverse_inertia(n, b.inertia.values.data(), b.rotation.values.data(), b.inverse_mass.values.data(),
                          b.inverse_inertia.values.data(), bits(b.driven));
    cairn_free_spin(n, step_.h, step_.scheme.share, b.inertia.values.data(), b.angular_momentum.values.data(),
                    b.inverse_inertia.values.data(), b.velocity.values.data(), b.velocity_free.values.data(),
                    pointer(b.force), pointer(b.damping), bits(b.driven));
  }
  if (!s.meshes.empty()) {
    if (s.networks && s.networks->thermal) s.networks->thermal->load_meshes(s);
    for (MeshBody& mesh : s.meshes.meshes) {
      const Stopwatch first_pass(mesh.linear() ? nullptr : &s.pass_seconds.all);
      mesh.loads.time = s.time;
      mesh.free_velocity(s.scene.nodes, s.scene.gravity.data(), step_.scheme, settings.refuse_unstable);
    }
  }
  if (!s.free_velocity) return;
  s.free_velocity->routine(s.scene.dim, b.dofs(), n, step_.h, step_.scheme.share, s.time,
                           s.free_velocity->params.data(), b.id.values.data(), b.mass.values.data(),
                           b.inertia.values.data(), b.position.values.data(), b.velocity.values.data(), bits(b.driven),
                           b.velocity_free.values.data(), b.inverse_mass.values.data());
  for (std::int64_t i = 0; i < n * b.dofs(); ++i)
    if (!(b.inverse_mass.values[i] >= 0) || !std::isfinite(b.inverse_mass.values[i]))
      throw Error("the plugged free velocity " + s.free_velocity->name + " gave the inverse mass " +
                  std::to_string(b.inverse_mass.values[i]) + " to body " + std::to_string(*b.id[i / b.dofs()]) +
                  ": give finite numbers >= 0");
}

void Nscd::detect_contacts(Simulation& s) {
  check_free_velocity(s, step_.h);
  Margin margin{};
  double reach = 0; // of laws that act before bodies touch
  for (int e = 0; e < s.laws.entries(); ++e)
    reach = std::max(reach, law_infos()[std::size_t(s.laws.entry(e).law)].acts_from(s.laws.entry(e).params));
  if (std::isnan(settings.margin)) {
    s.report.way = margins_.measure(s, step_.h);
    for (double& m : margins_.each()) m += reach;
    margin.per_contactor = margins_.each().data();
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
  s.contacts_known = false;
  views_.hide();
  const std::vector<RimSeat> seats = seats_of_contactors(s);
  s.handler.detect(s.scene.bodies, s.scene.contactors, s.scene.cell, margin, s.candidates,
                   {.mapped = &s.meshes.mapped(), .seats = seats, .step = step_.h, .soon_again = true},
                   &s.interactions.scratch(), &s.laws.rules());
  if (leave_out) leave_out(s.candidates);
  s.meshes.let_past_ends(s.candidates);
  s.meshes.weigh_mortar(s.scene.nodes, {s.scene.contactors, margin, s.laws.rules(), s.scene.cell}, s.candidates);
  anchored_.measure(s);
  look_at_meshes(s, step_, margin.per_contactor);
  nested_.look(s);
}

void Nscd::prepare_contacts(Simulation& s) {
  const Stopwatch watch(s.meshes.linear() ? nullptr : &s.pass_seconds.contacts);
  if (!settings.warm_start) s.interactions.forget_impulses();
  ContactOptions& options = s.interactions.options();
  options.impulse_point = settings.act_on_surfaces ? ImpulsePoint::own_surface : ImpulsePoint::middle_of_gap;
  options.configuration =
      settings.act_on_surfaces || settings.pose.kernel ? LawConfiguration::detection : LawConfiguration::midpoint;
  constexpr double slow = 0.01;
  const bool beside =
      step_.scheme.stiffness > 0 && step_.scheme.histories > 0 && std::abs(step_.scheme.position[0]) > 0;
  options.mesh_correction = beside ? slow : 1;
  const bool theta = by_theta();
  const double share = theta ? step_.law_share() : 0.5;
  options.joint_theta = share > 0 ? std::optional(share) : std::nullopt;
  options.time_left = theta ? share : 1 - step_.ahead / step_.h;
  options.overlap_limit = settings.overlap;
  s.interactions.pose(settings.pose);
  assemble_contacts(s);
  if (s.meshes.linear())
    seats_.seat(s, step_.h, [this, &s] {
      s.follow_meshes();
      forces_.leave(s);
      compute_free_velocity(s);
      detect_contacts(s);
      assemble_contacts(s);
    });
  if (stiff_.stiffen(s, step_.h)) assemble_contacts(s);
  s.contacts_known = true;
}

void Nscd::assemble_contacts(Simulation& s) {
  s.interactions.assemble(s.scene.bodies, s.scene.contactors, s.candidates, s.laws, s.scene.cell, step_.h,
                          step_.law_share(), &s.meshes, &s.scene.nodes);
}

void Nscd::solve_contacts(Simulation& s) {
  const Stopwatch watch(s.meshes.linear() ? nullptr : &s.pass_seconds.contacts);
  const bool driven = s.controls && s.controls->has_cell();
  s.report.solve = s.interactions.solve(s.scene.bodies, settings.solver, driven ? &s.scene.cell : nullptr);
  hold_joints(s, settings.solver, step_.h);
  stiffen_further(s);
}

void Nscd::update_velocity(Simulation& s) {
  Bodies& b = s.scene.bodies;
  if (b.reaction.active) std::fill(b.reaction.values.begin(), b.reaction.values.end(), 0.0);
  std::swap(b.velocity_begin.values, b.velocity.values); // with the spin that the contacts saw
  std::swap(s.scene.nodes.velocity_begin.values, s.scene.nodes.velocity.values);
  Cell& cell = s.scene.cell;
  double rate[9] = {};
  if (cell.moves()) // its part in the work of contacts is by the mean of both ends, as that of bodies
    for (int e = 0; e < 9; ++e) {
      rate[e] = cell.velocity_gradient[e];
      cell.velocity_gradient[e] = 0.5 * (begin_.cell().velocity_gradient[e] + rate[e]);
    }
  s.interactions.update_velocity(b);
  if (s.fluid && s.fluid->incompressible()) s.fluid->settle(s.scene);
  if (cell.moves()) std::copy(std::begin(rate), std::end(rate), cell.velocity_gradient);
  if (b.angular_momentum.active)
    cairn_momentum_update(b.count, 1, b.inertia.values.data(), b.rotation.values.data(), b.velocity_begin.values.data(),
                          b.velocity.values.data(), b.angular_momentum.values.data(), bits(b.driven));
}

// Energy is measured here, where the inertia of turning bodies is still that of the contacts.
void Nscd::commit_contacts(Simulation& s) {
  histories_.measure(s, step_);
  if (!s.meshes.empty())
    for (MeshBody& mesh : s.meshes.meshes) mesh.account(s.scene.nodes, s.scene.gravity.data());
  const ContactEnergy contacts = s.interactions.commit(s.report.solve.status == SolveStatus::converged);
  account_for_energy(s, step_, by_theta(), histories_, contacts, work_beside(s));
  s.account_for_meshes();
  s.advance_networks(step_.h);
}

// The rest of the displacement, and what the integrator keeps of the step.
void Nscd::update_configuration(Simulation& s) {
  Bodies& b = s.scene.bodies;
  forces_.leave(s);
  histories_.update(s, step_);
  Nodes& nodes = s.scene.nodes;
  const auto advance = [&](double time, Field<double>& of_bodies, Field<double>& of_nodes) {
    cairn_theta_advance(s.scene.dim, b.dofs(), b.count, time, of_bodies.values.data(), b.position.values.data(),
                        s.scene.dim == 2 ? pointer(b.rotation) : nullptr);
    cairn_theta_advance(nodes.dim, nodes.dim, nodes.count, time, of_nodes.values.data(), nodes.position.values.data(),
                        nullptr);
  };
  const double before = step_.h * (1 - step_.scheme.share), moved = before - step_.ahead;
  constexpr double rounding = 1e-9;
  const bool elsewhere = std::abs(moved) > rounding * step_.h; // contacts were detected where impulses act
  const double rest = elsewhere ? step_.h - step_.ahead : step_.h * step_.scheme.share;
  if (elsewhere) advance(moved, b.velocity_begin, nodes.velocity_begin);
  advance(step_.h * step_.scheme.share, b.velocity, nodes.velocity);
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
  s.report.h = step_.h;
  s.report.time_detection = s.time + step_.ahead;
  s.report.time = s.time += step_.h;
  s.report.contacts = s.candidates.count;
  s.report.energy = s.energy;
  if (s.report.solve.hint.empty()) s.report.solve.hint = s.report.mesh_within;
  if (s.report.solve.hint.empty()) s.report.solve.hint = s.report.unjoined;
  if (s.report.solve.hint.empty()) s.report.solve.hint = s.report.mesh_hint;
  phase_ = Phase::none;
  for (MeshBody& mesh : s.meshes.meshes) mesh.commit();
}

void Nscd::project_positions(Simulation& s) {
  stiff_.restore(s);
  projection_.project(s, settings, step_, margins_);
}

void Nscd::part_overlaps(Simulation& s) { parting_.part(s, settings.solver, step_.h); }

void Nscd::stiffen_again(Simulation& s) {
  s.interactions.keep_impulses();
  assemble_contacts(s);
  if (stiff_.stiffen(s, step_.h)) assemble_contacts(s);
}

// Loads that came with this step are known when it is solved: then it is solved once more, stiffened for them.
void Nscd::stiffen_further(Simulation& s) {
  constexpr int most = 3;
  SolveReport& report = s.report.solve;
  if (!stiff_.swing(s, step_.h)) return;
  const ContactMemory at_begin = s.interactions.memory();
  for (int pass = 0; pass < most && report.status != SolveStatus::diverged && stiff_.swing(s, step_.h); ++pass) {
    const int before = report.iterations;
    SolverOptions options = settings.solver;
    options.max_iterations -= before;
    if (options.max_iterations < std::max(options.min_iterations, 1)) break;
    stiffen_again(s);
    report = s.interactions.solve(s.scene.bodies, options);
    hold_joints(s, settings.solver, step_.h, before);
    report.iterations += before;
  }
  s.interactions.restore(at_begin);
}

void Nscd::read(Simulation& s, std::string_view field, int components, double* out) {
  views_.read(s, field, components, out);
}

void Nscd::status(Simulation& s, std::int32_t* out) { views_.status(s, out); }

void Nscd::changed(Simulation& s, bool places) {
  if (places)
    forget_histories(s);
  else
    views_.forget();
}

ContactMemory Nscd::projection_memory() const { return projection_.memory(); }

void Nscd::restore_projection(const Simulation& s, const ContactMemory& memory) { projection_.restore(s, memory); }

void Nscd::move_images(const Simulation& s, const std::vector<std::array<int, 3>>& moved) {
  projection_.replace_memory([&](const ContactMemory& memory) { return s.after_move(memory, moved); });
}

void Nscd::lean_images(int k, int i, int cells) {
  projection_.replace_memory([&](const ContactMemory& memory) { return after_lean(memory, k, i, cells); });
}

} // namespace cairn
