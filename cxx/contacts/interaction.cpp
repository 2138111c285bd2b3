#include "interaction.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "../base/call.hpp"
#include "../solvers/sweeps/associated_start.hpp"
#include "../solvers/sweeps/contact_rows.hpp"
#include "../solvers/sweeps/jointed_problem.hpp"
#include "../solvers/sweeps/step_solver.hpp"
#include "interaction_state.hpp"

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
  s.bodies = &bodies;
  s.contactors = &contactors;
  s.candidates = &candidates;
  s.laws = &laws;
  s.cell = &cell;
  s.meshes = meshes && !meshes->empty() ? meshes : nullptr;
  s.nodes = nodes;
  s.h = h;
  s.theta = theta;
  s.sheared = cell.any() && std::any_of(std::begin(cell.velocity_gradient), std::end(cell.velocity_gradient),
                                        [](double g) { return g < 0 || g > 0; });
  s.load_bodies();
  s.classify();
  s.plan();
  s.fill();
}

void Interactions::act_on_surfaces(bool surfaces) { s_->gap_share = surfaces ? 0 : 0.5; }

void Interactions::measure_from(const std::array<double, 3>& origin) { s_->origin = origin; }
void Interactions::hold_at_detection(bool there) { s_->flies = !there; }
void Interactions::limit_overlap(double share) { s_->overlap_limit = share; }
void Interactions::correct_meshes_by(double share) { s_->correction = share; }
void Interactions::centre_joints(double share, double left) {
  s_->joint_theta = share;
  s_->left_of_step = left;
}
void Interactions::pose(const ContactPose& pose) {
  s_->pose = pose;
  if (!pose.kernel) s_->memory.forces.clear();
}

// Impulses besides those that are sought: they change the free velocity, and come on top of the solution.
void Interactions::State::add_given(const Bodies& bodies) {
  velocity_given = bodies.velocity_free;
  if (meshes) nodes_given = nodes->velocity_free;
  if (system.batches.empty()) return;
  const auto swap_in = [&] {
    for (const cairn_batch& b : system.batches)
      for (std::size_t i = 0; i < std::size_t(b.count) * dim(); ++i)
        std::swap(b.r[i], given[std::size_t(dim()) * b.first + i]);
  };
  swap_in();
  system.load(free(bodies));
  const cairn_schedule schedule = system.schedule(1);
  cairn_add_impulses(&schedule);
  system.unload(velocity_given, meshes ? &nodes_given : nullptr);
  swap_in();
}

// Speeds and weights to which velocity errors are relative.
void Interactions::State::measure_speeds(const Bodies& bodies) {
  double by_loads = 0, at_begin = 0, of_meshes = 0;
  for (std::int64_t b = 0; b < bodies.count; ++b) {
    const double mass = *bodies.mass[b];
    if (!(mass > 0) || !std::isfinite(mass) || !(bodies.inverse_mass[b][0] > 0)) continue;
    for (int k = 0; k < dim(); ++k) {
      const double change = bodies.velocity_free[b][k] - bodies.velocity_begin[b][k];
      by_loads += mass * change * change;
      at_begin += mass * bodies.velocity_begin[b][k] * bodies.velocity_begin[b][k];
    }
  }
  for (std::int64_t i = 0; meshes && i < nodes->count; ++i)
    for (int k = 0; k < dim(); ++k) {
      const double v = nodes->velocity_free[i][k], change = v - nodes->velocity_begin[i][k], mass = *nodes->mass[i];
      by_loads += mass * change * change;
      of_meshes += mass * v * v;
    }
  system.weight_speed_square = by_loads;
  system.begin_speed_square = at_begin;
  system.mesh_speed_square = of_meshes;
}

SolveReport Interactions::solve(const Bodies& bodies, const SolverOptions& asked) {
  State& s = *s_;
  SolverOptions options = asked;
  if (!s.may_end_early()) options.enough = 0;
  if (s.overlap_limit < std::numeric_limits<double>::infinity()) s.note_loaded();
  s.system.grows = bodies.stretch.active;
  s.system.clumps = s.system.clumps && options.enough > options.tolerance;
  if (std::isfinite(options.accuracy) || options.associated_start || s.system.may_hold()) s.measure_speeds(bodies);
  if (s.given) s.add_given(bodies);
  const Velocities given{s.velocity_given, s.meshes ? &s.nodes_given : nullptr};
  s.system.refinement = &s.memory.refinement;
  s.system.rest = &s.memory.rest;
  SolveReport report = solve_step(s.system, s.given ? given : s.free(bodies), options);
  for (const cairn_batch& b : s.system.batches)
    for (std::size_t i = 0; i < std::size_t(b.count) * s.dim() && s.given; ++i)
      b.r[i] += s.given[std::size_t(s.dim()) * b.first + i];
  if (report.status == SolveStatus::diverged) s_->find_fault(bodies, report.iterations);
  return report;
}

bool Interactions::jointed() const { return JointedProblem::needed(s_->system); }

FrictionProblem Interactions::jointed_problem(const Bodies& bodies) {
  State& s = *s_;
  if (const std::string obstacle = JointedProblem::obstacle(s.system); !obstacle.empty())
    throw Error(obstacle + ": leave such laws out");
  const Array<cairn_record> record = s.system.record; // as the stage at hand has them
  const Array<double> condensed = s.system.condensed_velocity;
  const cairn_schedule schedule = s.system.schedule(1);
  JointedProblem step(s.system, schedule, s.free(bodies));
  step.pose_all();
  const bool held = step.hold();
  if (held) step.form();
  std::copy(record.begin(), record.end(), s.system.record.begin());
  std::copy(condensed.begin(), condensed.end(), s.system.condensed_velocity.begin());
  if (!held) throw Error("joints of the step have no factors, masses or velocities are not finite: lower dt");
  return step.in_order();
}

void Interactions::give_impulses(const double* local) {
  const int d = s_->dim();
  s_->system.keeps_velocity = false;
  s_->each([&](const cairn_batch& b, int lane, std::int64_t i) {
    for (int k = 0; k < d; ++k) at(b, b.r, lane, k) = local[d * i + k];
  });
}

void Interactions::update_velocity(Bodies& bodies) {
  State& s = *s_;
  ContactSystem& system = s.system;
  s.energy = {};
  if (!system.batches.empty()) {
    const cairn_schedule schedule = system.schedule(omp_get_max_threads());
    fit(s.work_sums, 4 * system.batches.size());
    // anew from the free velocity, so that bodies get the sum of impulses to rounding; but light bodies between heavy
    // ones would feel that rounding
    if (!system.keeps_velocity || s.meshes) {
      system.load(s.free(bodies));
      cairn_add_impulses(&schedule);
    }
    const Velocities now{bodies.velocity, s.meshes ? &s.nodes->velocity : nullptr};
    const Velocities begin{bodies.velocity_begin, s.meshes ? &s.nodes->velocity_begin : nullptr};
    if (s.meshes) {
      system.unload(bodies.velocity);
      s.push_meshes();
      system.load(now);
    }
    system.unload_and_add(bodies.velocity, begin);
    cairn_contact_work(&schedule, s.work_sums.data());
    system.load(now);
    if (s.sheared) s.count_cell_work();
    for (std::size_t b = 0; b < system.batches.size(); ++b) {
      const double* sums = &s.work_sums[4 * b];
      s.energy.normal -= 0.5 * sums[0];
      s.energy.tangential -= 0.5 * sums[1];
      s.energy.created += 0.5 * sums[2];
      s.energy.turned_over += 0.5 * sums[3];
    }
    if (s.parted) s.count_growth();
  } else {
    bodies.velocity.values = bodies.velocity_free.values;
    if (s.meshes) s.push_meshes();
  }
  if (bodies.reaction.active) s.add_reactions(bodies);
}

void Interactions::refresh_meshes(const Bodies& bodies) {
  if (!s_->meshes || s_->system.batches.empty()) return;
  ContactSystem& system = s_->system;
  s_->meshes->condense_again(system.condensed, system.condensed_velocity);
  for (std::size_t i = 0; i < system.condensed.size(); ++i) system.condensed_dofs[i] = system.condensed[i].dofs;
  system.load({bodies.velocity, &s_->nodes->velocity});
}

// Impulses of contacts to the nodes of meshes.
void Interactions::State::give_meshes() const {
  for (MeshBody& mesh : meshes->meshes) std::fill(mesh.impulse.begin(), mesh.impulse.end(), 0.0);
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts && (b.mapped_a || b.mapped_b); ++lane) {
      double p[3], m[3];
      space_impulse(b, lane, p, m);
      const auto give = [&](std::int32_t which, const std::int32_t* node, const double* weight, double sign) {
        MeshBody& mesh = meshes->meshes[which];
        for (int j = 0; j < 4; ++j)
          system.condensed[which].each_node(std::size_t(node[j * b.count + lane]), [&](std::int32_t at, double share) {
            for (int k = 0; k < dim(); ++k)
              mesh.impulse[dim() * (at - mesh.node(0)) + k] += share * (sign * weight[j * b.count + lane]) * p[k];
          });
      };
      if (b.mapped_a) give(b.body_a[lane], b.node_a, b.lever_a, 1);
      if (b.mapped_b) give(b.body_b[lane], b.node_b, b.lever_b, -1);
      if (b.turns) give_moment(b, lane);
    }
}

// Their velocities follow from one solution each.
void Interactions::State::push_meshes() const {
  give_meshes();
  for (MeshBody& mesh : meshes->meshes) mesh.push(*nodes);
}

void Interactions::give_meshes() const { s_->give_meshes(); }

void Interactions::keep_impulses() {
  const std::int64_t seen = s_->memory.contactors_seen; // what bonds on first sight does so once a step
  std::vector<std::int64_t> besides = std::move(s_->memory.seen_besides);
  s_->remember();
  s_->memory.contactors_seen = seen;
  s_->memory.seen_besides = std::move(besides);
}

// The image of B moves with the cell: relative velocities of contacts see it, bodies do not.
void Interactions::State::count_cell_work() {
  for (std::size_t k = 0; k < system.batches.size(); ++k) {
    const cairn_batch& b = system.batches[k];
    double* sums = &work_sums[4 * k];
    sums[2] = sums[3] = 0;
    for (int lane = 0; lane < b.contacts; ++lane) {
      double jump[3 * 128];
      const int n = b.count;
      for (int c = 0; c < dim(); ++c) jump[c * n + lane] = 0;
      add_image_jump(b, lane, 1, jump);
      double normal = b.r[lane] * jump[lane], tangential = 0;
      for (int c = 1; c < dim(); ++c) tangential += b.r[c * n + lane] * jump[c * n + lane];
      energy.cell_work -= normal + tangential;
      sums[0] += 2 * normal;
      sums[1] += 2 * tangential;
      b.scale[lane] += 2 * (normal + tangential);
      sums[2] += std::max(0.0, b.scale[lane]);
      sums[3] += std::abs(b.scale[lane]);
    }
  }
}

// Impulse and moment of a contact on A in space axes; m is of 3 components, in 2D its last.
void Interactions::State::space_impulse(const cairn_batch& b, int lane, double p[3], double m[3]) const {
  const int d = dim();
  double axes[3][3];
  axes_of(b, d, lane, axes);
  std::fill(p, p + 3, 0.0);
  std::fill(m, m + 3, 0.0);
  for (int c = 0; c < d; ++c) {
    const double r = at(b, b.r, lane, c);
    for (int k = 0; k < d; ++k) p[k] += axes[c][k] * r;
  }
  for (int c = d; c < b.components; ++c) {
    const double r = at(b, b.r, lane, c);
    if (d == 2)
      m[2] = r;
    else
      for (int k = 0; k < 3; ++k) m[k] += axes[c - 3][k] * r;
  }
}

// The far part of a rope, to bodies that are driven.
void Interactions::State::pull_driven(Bodies& bodies, const cairn_batch& b, int lane) const {
  for (int end = 0; end < 2; ++end) {
    const std::int32_t who = b.rope_body[2 * lane + end];
    if (bodies.driven.active && !*bodies.driven[who]) continue;
    const double* row = b.rope + rope_numbers * lane + 2 + 12 * end;
    for (int k = 0; k < system.velocities(); ++k) bodies.reaction[who][k] += b.r[lane] * row[k];
  }
}

void Interactions::State::add_reactions(Bodies& bodies) const {
  const int d = dim();
  const auto driven = [&](std::int32_t who) { return !bodies.driven.active || *bodies.driven[who]; };
  const auto add = [&](const cairn_batch& b, int lane, std::int32_t who, int side, double* lever, double sign,
                       const double p[3], const double m[3]) {
    double l[3] = {0, 0, 0};
    const bool radial = is_radial(side);
    for (int k = 0; k < d; ++k) l[k] = radial ? at(b, lever, lane, 0) * at(b, b.frame, lane, k) : at(b, lever, lane, k);
    double* to = bodies.reaction[who];
    for (int k = 0; k < d; ++k) to[k] += sign * p[k];
    if (d == 2)
      to[2] += sign * (l[0] * p[1] - l[1] * p[0] + m[2]);
    else
      for (int k = 0; k < 3; ++k)
        to[3 + k] += sign * (l[(k + 1) % 3] * p[(k + 2) % 3] - l[(k + 2) % 3] * p[(k + 1) % 3] + m[k]);
  };
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane) {
      // meshes account for their own supports
      const bool a = !b.mapped_a && driven(b.body_a[lane]), other = !b.mapped_b && driven(b.body_b[lane]);
      if (b.rope && !b.pack) pull_driven(bodies, b, lane);
      if (!a && !other) continue; // most are not
      double p[3], m[3];
      space_impulse(b, lane, p, m);
      if (a) add(b, lane, b.body_a[lane], b.side_a, b.lever_a, 1, p, m);
      if (other) add(b, lane, b.body_b[lane], b.side_b, b.lever_b, -1, p, m);
    }
}

ContactEnergy Interactions::commit(bool converged) {
  s_->commit_laws();
  s_->mark_steps_of_bonds(converged);
  s_->remember();
  return s_->energy;
}

std::int64_t Interactions::count() const { return s_->candidates ? s_->candidates->count : 0; }

template <class F>
void Interactions::State::each(F&& f) const {
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane) f(b, lane, std::int64_t(system.candidate[b.first + lane]));
}

void Interactions::impulse_local(double* out) const {
  const int d = s_->dim();
  std::fill(out, out + d * count(), 0.0);
  s_->each([&](const cairn_batch& b, int lane, std::int64_t i) {
    for (int k = 0; k < d; ++k) out[d * i + k] = at(b, b.r, lane, k);
  });
}

void Interactions::impulse_space(double* out) const {
  const int d = s_->dim();
  std::fill(out, out + d * count(), 0.0);
  s_->each([&](const cairn_batch& b, int lane, std::int64_t i) {
    double p[3], m[3];
    s_->space_impulse(b, lane, p, m);
    std::copy_n(p, d, out + d * i);
  });
}

void Interactions::moment_space(double* out) const {
  const int d = s_->dim() == 2 ? 1 : 3;
  std::fill(out, out + d * count(), 0.0);
  s_->each([&](const cairn_batch& b, int lane, std::int64_t i) {
    double p[3], m[3];
    s_->space_impulse(b, lane, p, m);
    std::copy_n(m + 3 - d, d, out + d * i);
  });
}

void Interactions::relative_velocity(double* out) const {
  const int d = s_->dim();
  std::fill(out, out + d * count(), 0.0);
  const cairn_schedule schedule = s_->system.schedule(1);
  for (std::size_t k = 0; k < s_->system.batches.size(); ++k) {
    const cairn_batch& b = s_->system.batches[k];
    double u[6 * 128];
    cairn_relative_velocities(&schedule, std::int32_t(k), 0, u);
    for (int lane = 0; lane < b.contacts; ++lane) {
      if (s_->sheared) s_->add_image_jump(b, lane, 1, u);
      for (int c = 0; c < d; ++c)
        out[std::int64_t(d) * s_->system.candidate[b.first + lane] + c] = u[c * b.count + lane];
    }
  }
}

void Interactions::status(std::int32_t* out) const {
  std::fill(out, out + count(), std::int32_t(cairn_open));
  s_->each([&](const cairn_batch& b, int lane, std::int64_t i) { out[i] = b.status[lane]; });
}

void Interactions::keys(std::int64_t* out) const {
  for (std::int64_t i = 0; i < count(); ++i) {
    const ContactKey k = s_->key(i);
    for (const std::int64_t word : {k.contactor_a, k.contactor_b, std::int64_t(k.feature), std::int64_t(k.image)})
      *out++ = word;
  }
}

void Interactions::dissipated(double* out) const {
  std::fill(out, out + count(), 0.0);
  s_->each([&](const cairn_batch& b, int lane, std::int64_t i) { out[i] = -0.5 * b.scale[lane]; });
}

ContactRows Interactions::rows() const {
  const int d = s_->dim();
  const auto n = std::size_t(count());
  ContactRows rows{.axes = std::vector<double>(d * d * n),
                   .lever = std::vector<double>(2 * d * n),
                   .bias = std::vector<double>(d * n),
                   .mu = std::vector<double>(n),
                   .compliance = std::vector<double>(d * n),
                   .bodies = std::vector<std::int32_t>(2 * n),
                   .kind = std::vector<std::int32_t>(n),
                   .mesh = {},
                   .node = {},
                   .weight = {}};
  if (s_->meshes) {
    rows.mesh.assign(2 * n, -1);
    rows.node.assign(8 * n, 0);
    rows.weight.assign(8 * n, 0);
  }
  s_->each([&](const cairn_batch& b, int lane, std::int64_t i) {
    double axes[3][3];
    axes_of(b, d, lane, axes);
    const auto lever = [&](double* from, std::int32_t side, int k) {
      if (sides()[side].scatter == nullptr) return 0.0; // of a mesh: weights of nodes
      return is_radial(side) ? at(b, from, lane, 0) * axes[0][k] : at(b, from, lane, k);
    };
    for (int k = 0; k < d; ++k) {
      for (int c = 0; c < d; ++c) rows.axes[d * d * i + d * c + k] = axes[c][k];
      rows.lever[2 * d * i + k] = lever(b.lever_a, b.side_a, k);
      rows.lever[2 * d * i + d + k] = lever(b.lever_b, b.side_b, k);
      rows.bias[d * i + k] = b.pack ? (k == 0 ? at(b, b.bias, lane, 0) : 0) : b.bias[k * b.count + lane];
    }
    for (int k = 0; b.compliance && k < d; ++k) rows.compliance[d * i + k] = b.compliance[k * b.count + lane];
    const bool cone = !law_infos()[b.law].has_solve;
    rows.mu[i] = cone ? at(b, b.params, lane, 0) : 0;
    rows.bodies[2 * i] = b.mapped_a ? -1 : b.body_a[lane];
    rows.bodies[2 * i + 1] = b.mapped_b ? -1 : b.body_b[lane];
    rows.kind[i] = !cone ? 2 : at(b, b.bias, lane, 0) < never() ? 1 : 0;
    const auto map = [&](std::int64_t side, std::int32_t which, const std::int32_t* node, const double* weight) {
      rows.mesh[side] = which;
      const CondensedBody& body = s_->system.condensed[which];
      const std::int32_t first = s_->meshes->meshes[which].node(0);
      for (int j = 0; j < 4; ++j) {
        const auto row = std::size_t(node[j * b.count + lane]);
        if (row >= body.node.size())
          throw Error(
              "a contact of the mesh '" + s_->meshes->meshes[which].model.name +
              "' is a mortar over more than four nodes, of which there are no rows: leave mortar out, or ask a scene "
              "without");
        rows.node[4 * side + j] = body.node[row] - first;
        rows.weight[4 * side + j] = weight[j * b.count + lane];
      }
    };
    if (b.mapped_a) map(2 * i, b.body_a[lane], b.node_a, b.lever_a);
    if (b.mapped_b) map(2 * i + 1, b.body_b[lane], b.node_b, b.lever_b);
  });
  return rows;
}

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
  s_->temperature = temperature;
  s_->potential = potential;
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
  s_->in_order = false;
}

std::int64_t Interactions::bytes() const {
  const State& s = *s_;
  const auto of = [](const auto& v) { return std::int64_t(v.capacity() * sizeof(v[0])); };
  const ContactSystem& c = s.system;
  return of(c.batches) + of(c.first_task) + of(c.first_batch) + of(c.work) + of(c.candidate) + of(c.sums) +
         of(c.change) + of(c.before) + of(c.r_before) + of(c.along) + of(c.chosen) + of(c.kept_r) + of(c.kept_u) +
         of(c.best) + of(s.memory.keys) + of(s.memory.impulses) + of(s.memory.states) + of(s.memory.anchors) +
         of(s.names) + of(s.names_of_last) + of(s.kept_at) + of(s.found_at) + of(s.left_over) + of(s.ids_in_order) +
         of(s.held) + of(s.anchor_of) + of(s.anchored_places) + of(s.measured.point) + of(s.measured.normal) +
         of(s.measured.gap) + of(s.work_sums) + of(s.order_start) + of(s.tile_stage) + of(s.hub_contacts) +
         of(s.late_contacts) + of(s.of_hub) + of(s.by_hub) + of(s.key_of_order) + of(s.order_count) + of(s.sorted) +
         s.scratch.bytes();
}

std::int64_t Interactions::body_bytes() const {
  const ContactSystem& c = s_->system;
  return std::int64_t((c.record.capacity() + c.general.capacity()) * sizeof(cairn_record));
}

} // namespace cairn
