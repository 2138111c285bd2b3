#include "interaction.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "../base/call.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "../solvers/sweeps/contact_rows.hpp"
#include "../solvers/sweeps/solid_zones.hpp"
#include "../solvers/sweeps/step_solver.hpp"
#include "interaction_state.hpp"
#include "surface_motion.hpp"

namespace cairn {

Interactions::Interactions(int dim) : s_(std::make_unique<State>(dim)) {
  if (dim != 2 && dim != 3) throw std::invalid_argument("interactions: dim is " + std::to_string(dim) + ", not 2 or 3");
}
Interactions::~Interactions() = default;
Interactions::Interactions(Interactions&&) noexcept = default;
Interactions& Interactions::operator=(Interactions&&) noexcept = default;

void Interactions::assemble(const Bodies& bodies, const Contactors& contactors, const Candidates& candidates,
                            const LawTable& laws, const Cell& cell, double h, double theta, MeshSet* meshes,
                            Nodes* nodes) {
  State& s = *s_;
  scratch();
  if (!(h > 0) || !std::isfinite(h))
    throw std::invalid_argument("interactions: step h is " + std::to_string(h) + " s, must be positive and finite");
  s.look_at(bodies, contactors, candidates, laws, cell, meshes, nodes);
  s.in.h = h;
  s.in.theta = theta;
  s.in.sheared =
      cell.any() && (cell.moves() || std::any_of(std::begin(cell.velocity_gradient), std::end(cell.velocity_gradient),
                                                 [](double g) { return g < 0 || g > 0; }));
  s.classes.take_columns();
  const Scratch::Mark planning = s.scratch.mark(); // given back before batches are laid out
  s.classes.take_degrees();
  s.frames.find_joints();
  s.ropes.find(contactors, laws);
  s.records.load();
  s.classes.classify();
  s.system.serial = s.classes.serial;
  if (s.classes.asks_area) find_tributary_areas(s.in, s.frames);
  s.plan.plan();
  s.scratch.release(planning);
  s.matcher.match(s.system.schedule(omp_get_max_threads()).threads);
  s.storage.lay_out(s.matcher.place);
  s.assembly.fill();
}

std::string Interactions::bond(const Bodies& bodies, const Contactors& contactors, const Candidates& candidates,
                               const LawTable& laws, const Cell& cell, double h, double theta, MeshSet* meshes,
                               Nodes* nodes) {
  State& s = *s_;
  s.look_at(bodies, contactors, candidates, laws, cell, meshes, nodes);
  s.classes.mark_mapped();
  find_tributary_areas(s.in, s.frames);
  s.ropes.find(contactors, laws);
  return s.new_bonds.begin(h, theta);
}

void Interactions::measure_anchored(const Bodies& bodies, const Contactors& contactors, const LawTable& laws,
                                    const Cell& cell, std::span<const std::int32_t> numbers, Candidates& found,
                                    MeshSet* meshes, Nodes* nodes) {
  s_->anchors.measure(bodies, contactors, laws, cell, numbers, found, meshes, nodes);
}

ContactOptions& Interactions::options() { return s_->in.options; }
void Interactions::pose(const ContactPose& pose) {
  s_->in.options.pose = pose;
  if (!pose.kernel) s_->memory.forces.clear();
}

bool Interactions::part_overlaps(const Bodies& bodies, bool persisting, Array<double>& velocity) {
  return s_->overlap.find_velocities(bodies, persisting, velocity);
}

OverlapLimit& Interactions::overlap() { return s_->overlap; }

bool Interactions::overlap_adds_up() const { return s_->overlap.adds_up() && s_->overlap.persists(); }

SolveReport Interactions::solve(const Bodies& bodies, const SolverOptions& asked, Cell* moving) {
  State& s = *s_;
  SolverOptions options = asked;
  s.system.pack = options.enough > options.tolerance && !s.overlap.bears_on_faces();
  if (!s.system.pack || s.overlap.adds_up()) options.enough = 0;
  if (s.overlap.is_set()) s.overlap.note_loaded();
  s.system.grows = bodies.stretch.active;
  s.system.clumps = s.system.clumps && options.enough > options.tolerance;
  if (std::isfinite(options.accuracy) || options.associated_start || s.system.may_hold())
    s.records.measure_speeds(bodies);
  const bool over_bodies = SolidZones::alone(s.system);
  for (BatchStorage::LawColumns& own : s.storage.of_law) own.context.over_bodies = over_bodies;
  s.system.refinement = &s.memory.refinement;
  s.system.rest = &s.memory.rest;
  const bool posed = s.storage.given != nullptr;
  if (moving) s.moving_cell.begin(*moving, s.in.dim(), s.in.h, s.system, s.in.candidates->image.data());
  s.system.cell = moving && moving->moves() ? &s.moving_cell : nullptr;
  if (s.system.cell) s.moving_cell.follow(s.system);
  SolveReport report = solve_step(s.system, posed ? s.pose.free_with_given(bodies) : s.in.free(bodies), options);
  if (posed) s.pose.add_given_to_solution();
  if (moving) s.moving_cell.follow(s.system);
  if (moving) s.moving_cell.end(*moving);
  s.system.cell = nullptr;
  if (report.status == SolveStatus::diverged) s_->plugged.find(bodies, report.iterations);
  return report;
}

void Interactions::give_impulses(const double* local) {
  const int d = s_->in.dim();
  s_->system.keeps_velocity = false;
  each_contact(s_->system, [&](const cairn_batch& b, int lane, std::int64_t i) {
    for (int k = 0; k < d; ++k) at(b, b.r, lane, k) = local[d * i + k];
  });
}

void Interactions::update_velocity(Bodies& bodies) {
  State& s = *s_;
  ContactSystem& system = s.system;
  s.energy = {};
  if (!system.batches.empty()) {
    const cairn_schedule schedule = system.schedule(omp_get_max_threads());
    // anew from the free velocity, so that bodies get the sum of impulses to rounding; but light bodies between heavy
    // ones would feel that rounding
    if (!system.keeps_velocity || s.in.meshes) {
      system.load(s.in.free(bodies));
      cairn_add_impulses(&schedule);
    }
    const Velocities now{bodies.velocity, s.in.meshes ? &s.in.nodes->velocity : nullptr};
    const Velocities begin{bodies.velocity_begin, s.in.meshes ? &s.in.nodes->velocity_begin : nullptr};
    if (s.in.meshes) {
      system.unload(bodies.velocity);
      s.transfer.push_meshes();
      system.load(now);
    }
    system.unload_and_add(bodies.velocity, begin);
    s.work.measure(schedule);
    system.load(now);
    s.work.book();
    if (s.storage.parted) s.growth.count();
  } else {
    bodies.velocity.values = bodies.velocity_free.values;
    if (s.in.meshes) s.transfer.push_meshes();
  }
  if (bodies.reaction.active) s.transfer.add_reactions(bodies);
}

double Interactions::work_of_growth(const cairn_batch& b, int lane) const {
  return s_->storage.parted ? s_->growth.work_at(b, lane) : 0;
}

void Interactions::refresh_meshes(const Bodies& bodies) {
  if (!s_->in.meshes || s_->system.batches.empty()) return;
  ContactSystem& system = s_->system;
  s_->in.meshes->condense_again(system.condensed, system.condensed_velocity);
  for (std::size_t i = 0; i < system.condensed.size(); ++i) system.condensed_dofs[i] = system.condensed[i].dofs;
  system.load({bodies.velocity, &s_->in.nodes->velocity});
}

void Interactions::give_meshes() const { s_->transfer.give_meshes(); }

void Interactions::keep_impulses() {
  const std::int64_t seen = s_->memory.contactors_seen; // what bonds on first sight does so once a step
  std::vector<std::int64_t> besides = std::move(s_->memory.seen_besides);
  s_->recorder.record();
  s_->memory.contactors_seen = seen;
  s_->memory.seen_besides = std::move(besides);
}

ContactEnergy Interactions::commit(bool converged) {
  s_->commit.commit();
  s_->commit.mark_bonds(converged);
  s_->recorder.record();
  return s_->energy;
}

std::int64_t Interactions::count() const { return s_->views.count(); }
const ContactViews& Interactions::views() const { return s_->views; }
StepJoints& Interactions::joints() { return s_->joints; }

const std::vector<ContactKey>& Interactions::kept() {
  std::vector<ContactKey>& all = s_->kept_keys;
  all.clear();
  const ContactMemory& m = s_->memory;
  for (std::size_t k = 0; k < m.keys.size() && m.state_components > 0; ++k)
    if (const double first = m.states[k * m.state_components]; first > 0 && first < std::numeric_limits<double>::max())
      all.push_back(m.keys[k]);
  std::sort(all.begin(), all.end(), [](const ContactKey& a, const ContactKey& b) {
    if (a.contactor_a != b.contactor_a) return a.contactor_a < b.contactor_a;
    if (a.contactor_b != b.contactor_b) return a.contactor_b < b.contactor_b;
    return a.feature != b.feature ? a.feature < b.feature : a.image < b.image;
  });
  return all;
}

void Interactions::see_contactors(std::int64_t below) {
  s_->memory.contactors_seen = std::max(s_->memory.contactors_seen, below);
}

ContactSystem& Interactions::system() { return s_->system; }

Scratch& Interactions::scratch() {
  s_->system.batches.clear();
  s_->scratch.begin();
  return s_->scratch;
}

void Interactions::act_at(const double* temperature, const double* potential) {
  s_->in.temperature = temperature;
  s_->in.potential = potential;
}

void Interactions::forget_impulses() { std::fill(s_->memory.impulses.begin(), s_->memory.impulses.end(), 0.0); }

const ContactMemory& Interactions::memory() const { return s_->memory; }

void Interactions::restore(ContactMemory m) {
  const auto wrong = [](const char* what, std::size_t have, std::size_t want) {
    throw std::invalid_argument("contact memory: " + std::string(what) + " has " + std::to_string(have) +
                                " numbers, its keys ask for " + std::to_string(want));
  };
  if (m.impulses.size() != m.keys.size() * m.impulse_components)
    wrong("impulses", m.impulses.size(), m.keys.size() * m.impulse_components);
  if (m.states.size() != m.keys.size() * m.state_components)
    wrong("states", m.states.size(), m.keys.size() * m.state_components);
  if (!m.anchors.empty() && m.anchors.size() != m.keys.size()) wrong("anchors", m.anchors.size(), m.keys.size());
  s_->memory = std::move(m);
  s_->matcher.forget_order();
}

std::span<Anchor> Interactions::anchors() { return s_->memory.anchors; }

std::span<double> Interactions::states(std::size_t key) {
  const auto each = std::size_t(s_->memory.state_components);
  return std::span<double>(s_->memory.states).subspan(key * each, each);
}

std::int64_t Interactions::bytes() const {
  const State& s = *s_;
  const auto of = [](const auto& v) { return std::int64_t(v.capacity() * sizeof(v[0])); };
  const ContactSystem& c = s.system;
  return of(c.batches) + of(c.first_task) + of(c.first_batch) + of(c.work) + of(c.candidate) + of(c.sums) +
         of(c.change) + of(c.before) + of(c.r_before) + of(c.along) + of(c.chosen) + of(c.kept_r) + of(c.kept_u) +
         of(c.best) + of(s.memory.keys) + of(s.memory.impulses) + of(s.memory.states) + of(s.memory.anchors) +
         s.matcher.bytes() + s.anchors.bytes() + s.work.bytes() + s.plan.bytes() + s.scratch.bytes();
}

std::int64_t Interactions::body_bytes() const {
  const ContactSystem& c = s_->system;
  return std::int64_t((c.record.capacity() + c.general.capacity()) * sizeof(cairn_record));
}

} // namespace cairn
