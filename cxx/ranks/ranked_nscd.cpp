// The step of NSCD over ranks: stages of each part in turn, with communication between them.
#include "ranked_nscd.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "../base/call.hpp"
#include "../base/number_text.hpp"
#include "../base/threads.hpp"
#include "../contacts/assembly_input.hpp"
#include "../contacts/surface_motion.hpp"
#include "../fluid/fluid.hpp"
#include "../laws/zone_laws.hpp"
#include "../networks/network.hpp"
#include "../simulation/controls.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "../solvers/sweeps/solid_zones.hpp"
#include "ranked_sweeps.hpp"

namespace cairn {

const StepReport& RankedNscd::step(Simulation& s, double h) {
  return exchange_->together([&]() -> const StepReport& { return step_of_all(s, h); });
}

const StepReport& RankedNscd::step_of_all(Simulation& s, double h) {
  if (!(h > 0) || !std::isfinite(h)) throw Error("dt is " + number_text(h) + "; give a positive, finite step [s]");
  begin(s, h, settings().renumber_every);
  s.place_meshes();
  const Threads threads(settings().solver.threads, s.scene.bodies.count);
  constexpr int most_tries = 20; // each doubles how far ghosts are sought
  for (int tries = 0; !attempt(s, h); ++tries) {
    if (tries == most_tries)
      throw Error("bodies move too far in a step of " + number_text(h) + " s for ghosts to be found: lower dt");
    if (tries > 0 || since_partition_ == 0) reach_factor_ *= 2;
    anew_ = true;
  }
  reach_factor_ = std::max(1.0, reach_factor_ / 2);
  return s.report;
}

void RankedNscd::undo() {
  liquid_.undo();
  for (Part& part : parts_) of(part).undo_step(*part.simulation);
}

void RankedNscd::check_scene(const Simulation& s) const {
  const NscdOptions& o = settings();
  if (o.solver.associated_start) refuse("associated_start is asked for");
  if (o.pose.kernel) refuse("the strategy is " + model_->name);
  if (o.integrator.name != "theta")
    throw Error("the integrator is " + o.integrator.name +
                ", and over ranks NSCD makes steps by theta: give integrator=cn.Theta(), or leave out ranks");
  if (std::isfinite(o.overlap) && o.solver.enough > o.solver.tolerance)
    refuse("overlap is limited, to " + number_text(o.overlap) +
           ", beside steps of dense packs that end at enough=" + number_text(o.solver.enough));
  if (std::isfinite(o.overlap) && rhythm_ == Rhythm::sweep)
    refuse("overlap is limited, to " + number_text(o.overlap) + ", beside one exchange a sweep");
  if (o.project_positions) refuse("project_positions is asked for");
  if (o.cut_back > 0) refuse("cut_back is asked for");
  OverRanks::check_scene(s);
}

std::vector<std::string_view> RankedNscd::stages(const Simulation& s) const {
  std::vector<std::string_view> names = {"predict_configuration",
                                         "compute_free_velocity",
                                         "detect_contacts",
                                         "colour_contacts",
                                         "prepare_contacts",
                                         "solve_contacts",
                                         "update_velocity",
                                         "commit_contacts",
                                         "account",
                                         "update_configuration",
                                         "gather"};
  if (!s.meshes.linear()) names.insert(names.begin() + 6, "newton_passes");
  if (RankedLiquid::flows_in(s)) {
    names.insert(names.begin() + 4, "press_fluid");
    names.insert(names.begin() + 7, "fluid_passes");
    names.insert(names.end() - 1, "finish_fluid");
  }
  if (std::isfinite(settings().overlap)) names.insert(names.end() - 1, "part_overlaps");
  return names;
}

std::vector<std::pair<std::string_view, double>> RankedNscd::figures(Simulation& s) {
  auto rows = OverRanks::figures(s);
  rows.emplace_back("gathered_solves", gathered_ ? double(gathered_->calls) : 0);
  rows.emplace_back("gathered_rank", gathered_ ? gathered_->rank : 0);
  rows.emplace_back("gathered_bytes", gathered_ ? gathered_->bytes : 0);
  return rows;
}

namespace {

bool changes_shape(const Cell& cell) {
  return std::ranges::any_of(cell.velocity_gradient, [](double g) { return g < 0 || g > 0; });
}

// Deformable bodies are with the part that makes their step, until it is made.
class LentMeshes {
public:
  LentMeshes(Simulation& whole, Part* to) : whole_(whole.meshes.meshes), to_(to) { lend(true); }
  ~LentMeshes() { lend(false); }
  LentMeshes(const LentMeshes&) = delete;
  LentMeshes& operator=(const LentMeshes&) = delete;
  void lend(bool lent) {
    if (to_ && lent != lent_) std::swap(whole_, to_->simulation->meshes.meshes);
    lent_ = lent;
  }

private:
  MeshList& whole_;
  Part* to_;
  bool lent_ = false;
};

// An incompressible liquid is with its bodies' copy until the step is made.
class LentLiquid {
public:
  LentLiquid(Simulation& whole, RankedLiquid& to) : whole_(whole), to_(to) {}
  ~LentLiquid() { to_.give_back(whole_); }
  LentLiquid(const LentLiquid&) = delete;
  LentLiquid& operator=(const LentLiquid&) = delete;

private:
  Simulation& whole_;
  RankedLiquid& to_;
};

// The whole has its meshes, and for networks nodes as the part has them.
class SeenMeshes {
public:
  SeenMeshes(Simulation& whole, const Part* part, LentMeshes& lent) : whole_(whole), lent_(lent) {
    lent_.lend(false);
    if (!part || !whole.networks) return;
    nodes_ = whole.scene.nodes;
    take_nodes(*part, whole_);
    whole_.follow_meshes();
  }
  // Temperatures and potentials stay as networks found them.
  ~SeenMeshes() {
    if (nodes_) {
      whole_.scene.nodes.position.values = nodes_->position.values;
      whole_.scene.nodes.velocity.values = nodes_->velocity.values;
      whole_.scene.nodes.force.values = nodes_->force.values;
    }
    lent_.lend(true);
  }
  SeenMeshes(const SeenMeshes&) = delete;
  SeenMeshes& operator=(const SeenMeshes&) = delete;

private:
  Simulation& whole_;
  LentMeshes& lent_;
  std::optional<Nodes> nodes_;
};

// Part of the detection margin of a body that its radius and its speed do not give [m].
double margin_of(const Simulation& s, double given) {
  double law = 0;
  for (int e = 0; e < s.laws.entries(); ++e) {
    const LawTable::Entry& entry = s.laws.entry(e);
    const LawInfo& info = law_infos()[std::size_t(entry.law)];
    law = std::max(law, info.acts_from(entry.params));
    if (info.within >= 0 && std::isfinite(entry.params[info.within])) law = std::max(law, entry.params[info.within]);
  }
  return law + (std::isnan(given) ? 0 : given / 2);
}

} // namespace

void RankedNscd::find_contacts(Simulation& s, double h) {
  s.timed("predict_configuration", [&] { bring_parts(s); });
  on_ranks(s, "predict_configuration", [&](Part& part) {
    of(part).leave_out = [this, &part](Candidates& found) { keep_own_contacts(part, found); };
    of(part).begin_step(*part.simulation, h);
    leave_contacts_of_others(part);
    of(part).predict_configuration(*part.simulation);
  });
  on_ranks(s, "compute_free_velocity", [&](Part& part) { of(part).compute_free_velocity(*part.simulation); });
  on_ranks(s, "detect_contacts", [&](Part& part) { of(part).detect_contacts(*part.simulation); });
}

void RankedNscd::choose_hint(Simulation& s) {
  std::string& hint = s.report.solve.hint;
  if (hint.empty()) hint = s.report.mesh_within;
  for (const Part& part : parts_)
    if (hint.empty()) hint = part.simulation->report.unjoined;
  if (hint.empty()) hint = s.report.mesh_hint;
}

// False: a body went farther than ghosts were sought, and nothing happened.
bool RankedNscd::attempt(Simulation& s, double h) {
  if (must_partition(s)) s.timed("partition", [&] { partition(s, margin_of(s, settings().margin)); });
  if (s.networks && s.networks->thermal && !s.meshes.empty()) s.networks->thermal->load_meshes(s);
  LentMeshes lent(s, mesh_part());
  const LentLiquid liquid(s, liquid_);
  if (RankedLiquid::flows_in(s)) liquid_.take(s, *model_, parts_, owner_, exchange_->ranks(), partitions_);
  find_contacts(s, h);
  if (!reaches_far_enough()) {
    undo();
    return false;
  }
  if (joint_rank_ >= 0) seat_joints(s);
  s.timed("colour_contacts", [&] { choose_colours(); });
  press_fluid(s, h);
  on_ranks(s, "prepare_contacts", [&](Part& part) { of(part).prepare_contacts(*part.simulation); });
  try {
    s.timed("solve_contacts", [&] { solve_step(s, settings().solver, h); });
    fluid_passes(s, settings().solver, h);
  } catch (...) {
    undo(); // a solver may refuse the contacts, on all ranks alike; a second undo does nothing
    throw;
  }
  if (Part* part = mesh_part(); part && !part->simulation->meshes.linear())
    s.timed("newton_passes", [&] { newton_passes(s, *part, h); });
  ExactSum work[contact_terms];
  s.timed("update_velocity", [&] {
    end_velocities(s);
    add_contact_sums(s.scene.cell, work);
  });
  on_ranks(s, "commit_contacts", [&](Part& part) {
    Interactions& contacts = part.simulation->interactions;
    contacts.system().load({part.simulation->scene.bodies.velocity, &part.simulation->scene.nodes.velocity});
    contacts.commit(s.report.solve.status == SolveStatus::converged);
  });
  s.timed("account", [&] { account(s, h, work); });
  try {
    const SeenMeshes seen(s, mesh_part(), lent);
    s.account_for_meshes();
    advance_networks(s, h);
  } catch (...) {
    undo();
    throw;
  }
  for (Part& part : parts_) {
    part.velocity = part.simulation->scene.bodies.velocity.values;
    part.node_velocity = part.simulation->scene.nodes.velocity.values;
  }
  on_ranks(s, "update_configuration", [&](Part& part) { of(part).update_configuration(*part.simulation); });
  finish_fluid(s); // after all that may refuse the step, which takes the liquid back
  if (s.scene.cell.any()) add_work_of_cell(s);
  if (std::isfinite(settings().overlap)) s.timed("part_overlaps", [&] { part_overlaps(s, h); });
  lent.lend(false);
  liquid_.give_back(s);
  s.timed("gather", [&] { collect_meshes(s); });
  choose_hint(s);
  s.timed("gather", [&] { collect(s); });
  return true;
}

void RankedNscd::solve_step(Simulation& s, const SolverOptions& options, double h) {
  s.report.solve = solve(options, s.controls && s.controls->has_cell() ? h : 0);
  if (joint_rank_ >= 0) hold_joints(s, h);
}

// h: of the step, where the periodic cell is driven; 0: its rates stay as they are.
SolveReport RankedNscd::solve(const SolverOptions& options, double h) {
  look_for_zones();
  RankedSweeps sweeps(parts_, links_, colours_, *exchange_, options, rhythm_ == Rhythm::sweep ? &once_ : nullptr);
  sweeps.meshes_are_with(mesh_rank_);
  if (h > 0) sweeps.drive_cell(h);
  if (options.solver != "nlgs" || std::isfinite(options.accuracy)) {
    if (!gathered_) gathered_ = std::make_unique<GatheredMemory>(parts_[0].simulation->scene.dim);
    gathered_->rank = std::max(mesh_rank_, 0);
    sweeps.ask_help(shares_, *gathered_);
  }
  return sweeps.solve();
}

// Zones are solved over all bodies at once where no rank has other contacts, as without ranks.
void RankedNscd::look_for_zones() {
  const LawTable& laws = parts_[0].simulation->laws; // alike on all ranks
  bool known = false;
  for (int e = 0; e < laws.entries(); ++e) known = known || zone_of(std::int32_t(laws.entry(e).law)) != nullptr;
  if (!known) return;
  double any[] = {0, 0}; // zones, others
  for (const Part& part : parts_) {
    const SolidZones::Kinds kinds = SolidZones::kinds(part.simulation->interactions.system());
    any[0] = std::max(any[0], double(kinds.zones));
    any[1] = std::max(any[1], double(kinds.others));
  }
  exchange_->largest(any);
  for (Part& part : parts_)
    for (const cairn_batch& b : part.simulation->interactions.system().batches)
      const_cast<cairn_law_context*>(b.context)->over_bodies = any[0] > 0 && !(any[1] > 0); // of its storage
}

// Ghosts were sought up to a gap that bodies use up by their ways and margins.
bool RankedNscd::reaches_far_enough() {
  std::vector<std::vector<double>> margins;
  for (Part& part : parts_) {
    const Simulation& s = *part.simulation;
    std::vector<double>& used = margins.emplace_back(part.bodies.size(), 0.0);
    const double constant = settings().margin / 2;
    for (std::int64_t k = 0; k < s.scene.contactors.count; ++k) {
      if (*s.scene.contactors.body[k] < 0) continue;
      double& of_body = used[std::size_t(*s.scene.contactors.body[k])];
      of_body = std::max(of_body, std::isnan(constant) ? of(part).margins()[std::size_t(k)] : constant);
    }
  }
  add_growth(margins);
  return exchange_->ranks() == 1 || 2 * farthest(margins, way_of_meshes()) <= reach_;
}

void RankedNscd::keep_own_contacts(const Part& part, Candidates& c) const {
  if (exchange_->ranks() == 1) return;
  const auto dim = std::size_t(part.simulation->scene.dim);
  std::size_t to = 0;
  for (std::size_t i = 0; i < std::size_t(c.count); ++i) {
    if (!owns_contact(part, c.contactor_a[i], c.contactor_b[i])) continue;
    for (auto* array : {&c.contactor_a, &c.contactor_b, &c.feature, &c.image}) (*array)[to] = (*array)[i];
    c.gap[to] = c.gap[i];
    for (auto* array : {&c.normal, &c.point})
      std::copy_n(array->begin() + std::ptrdiff_t(dim * i), dim, array->begin() + std::ptrdiff_t(dim * to));
    ++to;
  }
  for (auto* array : {&c.contactor_a, &c.contactor_b, &c.feature, &c.image}) array->resize(to);
  c.gap.resize(to);
  c.normal.resize(dim * to);
  c.point.resize(dim * to);
  c.count = std::int64_t(to);
}

// Contacts that are those of the last step keep their colours: these follow from their keys.
void RankedNscd::choose_colours() {
  shares_.resize(parts_.size());
  double changed[] = {colours_of_ == partitions_ ? 0.0 : 1.0};
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    const Candidates& c = parts_[l].simulation->candidates;
    const Field<std::int64_t>& id = parts_[l].simulation->scene.contactors.id;
    std::vector<ContactKey>& known = shares_[l].key;
    if (known.size() != std::size_t(c.count)) changed[0] = 1;
    known.resize(std::size_t(c.count));
    for (std::size_t k = 0; k < known.size(); ++k) {
      const ContactKey key = {*id[c.contactor_a[k]], *id[c.contactor_b[k]], c.feature[k], c.image[k]};
      if (known[k] == key) continue;
      known[k] = key;
      changed[0] = 1;
    }
  }
  exchange_->largest(changed);
  if (changed[0] > 0) colour_anew();
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    ContactSystem& system = parts_[l].simulation->interactions.system();
    system.colours = std::max(colours_, 1);
    system.colour = shares_[l].colour;
  }
}

void RankedNscd::colour_anew() {
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    const Part& part = parts_[l];
    const Candidates& c = part.simulation->candidates;
    const Contactors& contactors = part.simulation->scene.contactors;
    const Array<std::int64_t>& id = part.simulation->scene.bodies.id.values;
    ColourShare& share = shares_[l];
    share.id.assign(id.begin(), id.end());
    share.owner = part.owner;
    share.body.clear();
    share.in_turn.clear();
    for (std::size_t k = 0; k < std::size_t(c.count); ++k) {
      std::array<std::int32_t, 2> bodies = {*contactors.body[c.contactor_a[k]], *contactors.body[c.contactor_b[k]]};
      const bool on_mesh = bodies[0] < 0 || bodies[1] < 0;
      for (std::int32_t& body : bodies)
        if (body < 0 || part.fixed[std::size_t(body)]) body = -1;
      share.body.push_back(bodies);
      if (mesh_rank_ >= 0) share.in_turn.push_back(on_mesh);
    }
  }
  colours_ = colour_contacts(shares_, *exchange_);
  const int numbers = parts_[0].simulation->interactions.system().velocities();
  links_ = link_colours(shares_, *exchange_, colours_, numbers);
  if (rhythm_ == Rhythm::sweep && exchange_->ranks() > 1) once_.link(shares_, *exchange_, numbers);
  if (colours_of_ != partitions_) return_freed_memory(); // of the cut, before contacts take theirs
  colours_of_ = partitions_;
}

// Velocities at the end of the step: of own bodies from the sweeps, of ghosts from their owners.
void RankedNscd::end_velocities(Simulation& s) {
  for (Part& part : parts_) {
    Bodies& b = part.simulation->scene.bodies;
    std::swap(b.velocity_begin.values, b.velocity.values); // with the spin that the contacts saw
    part.simulation->interactions.system().unload(b.velocity);
  }
  follow_ghosts(&Bodies::velocity);
  push_meshes();
  if (liquid_.taken()) liquid_.settle(parts_, *exchange_, mesh_part());
  add_reactions(s);
  for (Part& part : parts_) {
    Bodies& b = part.simulation->scene.bodies;
    if (b.angular_momentum.active)
      cairn_momentum_update(b.count, 1, b.inertia.values.data(), b.rotation.values.data(),
                            b.velocity_begin.values.data(), b.velocity.values.data(), b.angular_momentum.values.data(),
                            bits(b.driven));
  }
}

// Impulses of contacts on driven bodies, from all ranks.
void RankedNscd::add_reactions(Simulation& s) {
  if (!s.scene.bodies.reaction.active) return;
  const int nd = s.scene.bodies.dofs(), dim = s.scene.dim;
  std::vector<std::int32_t> place(std::size_t(s.scene.bodies.count), -1);
  std::size_t driven = 0;
  bool moves = false; // contacts do a driven body
  for (std::int64_t i = 0; i < s.scene.bodies.count; ++i) {
    if (!*s.scene.bodies.driven[i]) continue;
    place[std::size_t(i)] = std::int32_t(driven++);
    moves = moves || !fixed_[std::size_t(i)];
  }
  std::vector<ExactSum> sums(driven * std::size_t(nd));
  for (const Part& part : parts_) {
    ContactSystem& system = part.simulation->interactions.system();
    for (const cairn_batch& b : system.batches) {
      if (b.moves_a && b.moves_b && !moves) continue;
      for (int lane = 0; lane < b.contacts; ++lane)
        for (const double sign : {1.0, -1.0}) {
          if (sign > 0 ? b.mapped_a : b.mapped_b) continue; // meshes account for their own supports
          const std::int32_t body = (sign > 0 ? b.body_a : b.body_b)[lane];
          const std::int32_t to = place[std::size_t(part.bodies[std::size_t(body)])];
          if (to < 0) continue;
          double p[3], m[3], l[3] = {0, 0, 0};
          space_impulse(dim, b, lane, p, m);
          const std::int32_t side = sign > 0 ? b.side_a : b.side_b;
          double* lever = sign > 0 ? b.lever_a : b.lever_b;
          for (int k = 0; k < dim; ++k)
            l[k] = is_radial(side) ? at(b, lever, lane, 0) * at(b, b.frame, lane, k) : at(b, lever, lane, k);
          ExactSum* sum = &sums[std::size_t(to) * std::size_t(nd)];
          for (int k = 0; k < dim; ++k) sum[k].add(sign * p[k]);
          if (dim == 2) sum[2].add(sign * (l[0] * p[1] - l[1] * p[0] + m[2]));
          for (int k = 0; k < 3 && dim == 3; ++k)
            sum[3 + k].add(sign * (l[(k + 1) % 3] * p[(k + 2) % 3] - l[(k + 2) % 3] * p[(k + 1) % 3] + m[k]));
        }
    }
  }
  add_over_ranks(sums, *exchange_);
  for (Part& part : parts_) {
    Field<double>& reaction = part.simulation->scene.bodies.reaction;
    std::fill(reaction.values.begin(), reaction.values.end(), 0.0);
    for (std::size_t i = 0; i < part.bodies.size(); ++i)
      if (const std::int32_t from = place[std::size_t(part.bodies[i])]; from >= 0)
        for (int k = 0; k < nd; ++k)
          reaction[std::int64_t(i)][k] = sums[std::size_t(from) * std::size_t(nd) + std::size_t(k)].value();
  }
}

// Work of contacts at the mean of the velocities at both ends of the step, by contact: normal, rest, given, size; with
// the velocities of surfaces and images, the work of these, and that of bodies which grew.
void RankedNscd::add_contact_sums(const Cell& begin, std::span<ExactSum> sums) {
  for (Part& part : parts_) {
    ContactSystem& system = part.simulation->interactions.system();
    const Scene& scene = part.simulation->scene;
    const Bodies& b = scene.bodies;
    if (system.batches.empty()) continue;
    Cell cell = scene.cell; // at the mean of both ends, too
    for (int e = 0; cell.moves() && e < 9; ++e)
      cell.velocity_gradient[e] = 0.5 * (begin.velocity_gradient[e] + cell.velocity_gradient[e]);
    AssemblyInput in(scene.dim);
    in.bodies = &b;
    in.meshes = part.has_meshes ? &part.simulation->meshes : nullptr;
    in.nodes = &part.simulation->scene.nodes;
    in.contactors = &scene.contactors;
    in.candidates = &part.simulation->candidates;
    in.cell = &cell;
    in.sheared = cell.any() && changes_shape(cell);
    Field<double> spare = b.velocity;
    system.load({b.velocity, &scene.nodes.velocity});
    system.unload_and_add(spare, {b.velocity_begin, &scene.nodes.velocity_begin});
    const cairn_schedule schedule = system.schedule(1);
    for (std::size_t k = 0; k < system.batches.size(); ++k) {
      const cairn_batch& batch = system.batches[k];
      const bool jumps = in.has_jumps() && has_jumps(in, &system.candidate[batch.first], batch.contacts);
      double u[6 * 128], jump[6 * 128] = {};
      cairn_relative_velocities(&schedule, std::int32_t(k), 0, u);
      for (int lane = 0; lane < batch.contacts; ++lane) {
        if (jumps) add_jump(in, system, batch, lane, jump);
        double work[2] = {0, 0}, of_jump = 0;
        for (int c = 0; c < batch.components; ++c) {
          const int at_lane = c * batch.count + lane;
          const double r = at(batch, batch.r, lane, c);
          work[c > 0] += r * u[at_lane] + 2 * r * jump[at_lane];
          of_jump -= r * jump[at_lane];
        }
        batch.scale[lane] = work[0] + work[1];
        const double grown = part.simulation->interactions.work_of_growth(batch, lane);
        batch.scale[lane] -= 2 * grown;
        sums[0].add(work[0]);
        sums[1].add(work[1]);
        sums[2].add(std::max(0.0, batch.scale[lane]));
        sums[3].add(std::abs(batch.scale[lane]) + 2 * std::abs(grown));
        if (jumps) sums[4].add(of_jump);
        if (grown < 0 || grown > 0) sums[5].add(grown);
      }
    }
    system.load({b.velocity, &scene.nodes.velocity});
  }
}

// Bodies that leave a cell which changes its shape take the velocity of the image that they become.
void RankedNscd::add_work_of_cell(Simulation& s) {
  if (!changes_shape(parts_[0].simulation->scene.cell)) return;
  ExactSum sum[1];
  const auto n = std::size_t(s.scene.bodies.dofs());
  for (const Part& part : parts_) {
    const Bodies& b = part.simulation->scene.bodies;
    for (std::size_t i = 0; i < part.bodies.size(); ++i) {
      const double mass = *b.mass[std::int64_t(i)];
      if (!part.own[i] || !std::isfinite(mass)) continue;
      double change = 0;
      for (std::size_t k = 0; k < std::size_t(s.scene.dim); ++k) {
        const double now = b.velocity[std::int64_t(i)][k], was = part.velocity[n * i + k];
        change += now * now - was * was;
      }
      sum[0].add(mass * change / 2);
    }
  }
  if (const Part* part = mesh_part(); part && part->rank == mesh_rank_) {
    const Nodes& nodes = part->simulation->scene.nodes;
    for (std::int64_t i = 0; i < nodes.count; ++i)
      for (std::int64_t k = s.scene.dim * i; k < s.scene.dim * (i + 1); ++k) {
        const double now = nodes.velocity.values[std::size_t(k)], was = part->node_velocity[std::size_t(k)];
        sum[0].add(*nodes.mass[i] * (now * now - was * was) / 2);
      }
  }
  add_over_ranks(sum, *exchange_);
  const double work = sum[0].value();
  s.energy.work_driven += work;
  s.energy.turned_over += std::abs(work);
}

void RankedNscd::add_energy_of_bodies(const cairn_scheme& scheme, double h, std::span<ExactSum> sums) {
  for (Part& part : parts_) {
    Scene& scene = part.simulation->scene;
    Bodies& b = scene.bodies;
    const auto row = [](auto& field, std::int64_t i) { return field.active ? field[i] : nullptr; };
    for (std::int64_t i = 0; i < b.count; ++i) {
      if (!part.own[std::size_t(i)]) continue;
      double terms[body_terms];
      cairn_energy_terms(scene.dim, b.dofs(), 1, h, scheme.share, scene.gravity.data(), b.mass[i], b.inertia[i],
                         b.velocity_begin[i], b.velocity[i], terms, row(b.force, i), row(b.damping, i),
                         reinterpret_cast<const std::int8_t*>(row(b.driven, i)), row(b.reaction, i),
                         row(b.momentum_begin, i), row(b.angular_momentum, i), nullptr, nullptr, nullptr, nullptr,
                         nullptr, nullptr);
      for (std::size_t k = 0; k < body_terms; ++k) sums[k].add(terms[k]);
    }
  }
}

// What joints did beside contacts, and energies that laws tell.
void RankedNscd::add_energy_of_laws(std::span<ExactSum> beside, std::span<ExactSum> told) {
  for (Part& part : parts_) {
    if (part.has_joints) {
      const WorkBeside work = of(part).work_beside(*part.simulation);
      beside[0].add(work.seated);
      beside[1].add(work.stiffened);
    }
    const ContactSystem& system = part.simulation->interactions.system();
    for (const cairn_batch& b : system.batches)
      for (std::size_t k = 0; k < law_terms * std::size_t(b.contacts) && law_infos()[std::size_t(b.law)].energy; ++k)
        told[k % law_terms].add(system.law_energy[law_terms * std::size_t(b.first) + k]);
  }
}

// The balance of energy, from exact sums over bodies and contacts.
void RankedNscd::account(Simulation& s, double h, std::span<ExactSum> work) {
  constexpr std::size_t of_contacts = body_terms, beside = of_contacts + contact_terms, told = beside + beside_terms;
  ExactSum sums[told + law_terms];
  const std::span<ExactSum> all(sums);
  const cairn_scheme scheme = settings().integrator.scheme(h);
  add_energy_of_bodies(scheme, h, sums);
  add_energy_of_nodes(scheme, h, sums);
  std::copy(work.begin(), work.end(), sums + of_contacts);
  add_energy_of_laws(all.subspan(beside, beside_terms), all.subspan(told));
  const bool laws_tell =
      std::ranges::any_of(s.laws.laws(), [](Law law) { return law_infos()[std::size_t(law)].energy != nullptr; });
  add_over_ranks(all.first(told + (laws_tell ? law_terms : 0)), *exchange_);
  double of_bodies[body_terms], value[std::size(sums) - body_terms];
  for (std::size_t k = 0; k < body_terms; ++k) of_bodies[k] = sums[k].value();
  for (std::size_t k = 0; k < std::size(value); ++k) value[k] = sums[body_terms + k].value();
  const auto [w_normal, w_rest, given, size, of_jumps, grown, seated, stiffened, stored, taken_normal, taken_rest,
              released, law_created, law_turned_over, driven_rest, driven_normal] = value;
  ContactEnergy contacts;
  contacts.normal = -0.5 * w_normal + grown - taken_normal + driven_normal;
  contacts.tangential = -0.5 * w_rest - taken_rest + driven_rest;
  contacts.jump_work = of_jumps;
  contacts.created = 0.5 * given + law_created;
  contacts.turned_over = 0.5 * size + law_turned_over;
  contacts.grown = grown;
  contacts.driven = driven_rest + driven_normal;
  contacts.stored = stored;
  contacts.stored_change = taken_normal + taken_rest - released;
  contacts.released = released;
  const Part* part = mesh_part();
  balance_energy(s, (part ? *part->simulation : s).meshes.meshes, of_bodies, contacts, {seated, stiffened});
}

} // namespace cairn
