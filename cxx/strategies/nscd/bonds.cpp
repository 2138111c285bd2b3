// Pairs that laws keep begin where bodies stand when they come in, before anything moves.
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "../../contacts/body_axes.hpp"
#include "../../contacts/interaction_state.hpp"
#include "nscd.hpp"

namespace cairn {
namespace {

constexpr double none = std::numeric_limits<double>::max(); // state of contacts that have none

// (has, keys) becomes (wants, keys).
void widen(std::vector<double>& values, int& has, int wants, std::size_t keys, double fill) {
  if (has >= wants) return;
  std::vector<double> wider(keys * std::size_t(wants), fill);
  for (std::size_t k = 0; k < keys; ++k)
    std::copy_n(values.data() + k * std::size_t(has), has, wider.data() + k * std::size_t(wants));
  values = std::move(wider);
  has = wants;
}

// Distance [m] that points of half of a four-node face may have from the face itself: a tenth of the offset of the
// fourth node from the plane of the others at Gauss points, at most a quarter. place: positions of nodes (3, n).
double warp(const MeshModel& m, std::int64_t part, const double* place) {
  const auto side = std::lower_bound(m.side_ids.begin(), m.side_ids.end(), part);
  if (m.dim == 2 || side == m.side_ids.end() || *side != part) return 0;
  const std::int32_t* node = &m.face_nodes[4 * std::size_t(side - m.side_ids.begin())];
  if (node[3] < 0) return 0;
  const double* x[4];
  for (int j = 0; j < 4; ++j) x[j] = &place[3 * std::size_t(node[j])];
  double out[3], across[3], square = 0, off = 0;
  for (int k = 0; k < 3; ++k) out[k] = x[0][k] - x[1][k] + x[2][k] - x[3][k];
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    across[k] = (x[2][i] - x[0][i]) * (x[3][j] - x[1][j]) - (x[2][j] - x[0][j]) * (x[3][i] - x[1][i]);
    square += across[k] * across[k];
    off += out[k] * across[k];
  }
  return square > 0 ? std::abs(off) / (4 * std::sqrt(square)) : 0;
}

} // namespace

// Bonds of bodies that came in since the last step and touch where they stand, for laws that keep pairs: the result of
// the law's prepare is their first memory. Returns a warning about bonds without an area.
std::string Interactions::bond(const Bodies& bodies, const Contactors& contactors, const Candidates& candidates,
                               const LawTable& laws, const Cell& cell, double h, double theta, MeshSet* meshes,
                               Nodes* nodes) {
  State& s = *s_;
  s.bodies = &bodies;
  s.contactors = &contactors;
  s.candidates = &candidates;
  s.laws = &laws;
  s.cell = &cell;
  s.meshes = meshes && !meshes->empty() ? meshes : nullptr;
  s.nodes = nodes;
  s.kind = s.scratch.take<std::uint8_t>(contactors.count);
  for (std::int64_t c = 0; c < contactors.count; ++c) s.kind[c] = s.body(std::int32_t(c)) < 0 ? State::mapped : 0;
  s.find_mesh_areas();
  s.find_ropes(contactors, laws);
  s.entry = s.scratch.take<std::int32_t>(candidates.count);
  ContactMemory& m = s.memory;
  for (const Law law : laws.laws()) {
    const LawInfo& info = law_infos()[std::size_t(law)];
    if (!info.keeps) continue;
    widen(m.impulses, m.impulse_components, info.components(s.dim()), m.keys.size(), 0);
    widen(m.states, m.state_components, info.state_kept(s.dim()), m.keys.size(), none);
  }
  const std::size_t first = m.keys.size();
  std::vector<std::int32_t> beginning;
  for (std::int64_t i = 0; i < candidates.count; ++i) {
    s.entry[i] =
        laws.find(*contactors.material[candidates.contactor_a[i]], *contactors.material[candidates.contactor_b[i]]);
    if (s.entry[i] < 0 || !law_infos()[std::size_t(laws.entry(s.entry[i]).law)].keeps || !s.came_in_touching(i))
      continue;
    beginning.push_back(std::int32_t(i));
  }
  std::vector<std::int32_t> joined, bare, spare;
  s.leave_out_corners(beginning);
  s.leave_out_twins(beginning, spare);
  std::vector<State::BondArea> shared = s.share_mesh_faces(beginning, spare);
  s.share_mesh_pairs(beginning, spare, shared);
  auto next = shared.begin(); // both rise
  for (const std::int32_t i : beginning) {
    const bool here = next != shared.end() && next->first == i;
    const State::Begun begun = s.begin_kept(i, h, theta, here ? (next++)->second : s.area_of(i));
    if (begun == State::Begun::joined) joined.push_back(i);
    if (begun == State::Begun::without_area) bare.push_back(i);
  }
  s.space_anchors(first);
  return s.tell_unjoined(joined, bare);
}

// One contact, as eight that are the same.
Interactions::State::Begun Interactions::State::begin_kept(std::int64_t i, double with_h, double with_theta,
                                                           double area) {
  constexpr int n = 8;
  const LawTable::Entry& e = laws->entry(entry[i]);
  const LawInfo& law = law_infos()[std::size_t(e.law)];
  const int c = law.components(dim());
  const bool by_area = law.anchored || std::ranges::find(law.state, "area") != law.state.end();
  for (const std::int32_t contactor : {candidates->contactor_a[i], candidates->contactor_b[i]})
    if ((kind[contactor] & mapped) && by_area && !law.joins && info(Shape(*contactors->shape[contactor])).ball() &&
        !(meshes->area(contactor) > 0))
      throw std::invalid_argument("law " + law.python_name + " joins a node or point of the mesh '" +
                                  meshes->meshes[meshes->mesh_of(contactor)].model.name +
                                  "', whose part of the surface is not known: give the sides that it lies on too, "
                                  "edges= in 2D, faces= in 3D");
  double gap[n], geometry[3 * n], u[6 * n] = {}, params[(LawTable::max_parameters + 4) * n] = {};
  double state[LawTable::max_states * n] = {}, bias[6 * n], compliance[6 * n], mu[n];
  const auto fill = [](double* column, double value) { std::fill_n(column, n, value); };
  fill(gap, candidates->gap[i]);
  fill(geometry, area);
  fill(geometry + n, effective_radius(i));
  fill(geometry + 2 * n, 0);
  for (std::size_t p = 0; p < law.parameters.size(); ++p) fill(params + p * n, e.params[p]);
  double fields[4 * n] = {};
  for (int lane = 0; lane < n; ++lane) {
    if (temperature) vary(i, n, params + lane);
    if (has_fields()) fields_of(i, n, fields + lane);
  }
  int column = 0;
  for (std::size_t k = 0; k < law.state.size(); ++k)
    for (int v = law.state[k].back() == '*' ? dim() - 1 : 1; v > 0; --v) fill(state + n * column++, law.state_begin[k]);
  fill(state, 1);
  const cairn_law_context context{with_h, with_theta, geometry, has_fields() ? fields : nullptr};
  law.prepare(n, c, &context, gap, u, params, state, bias, compliance, mu);
  if (law.spans && !(state[0] > 0)) {
    const auto name = [&](std::int32_t contactor) {
      return body(contactor) < 0 ? std::string("a mesh") : "body " + std::to_string(*bodies->id[body(contactor)]);
    };
    throw std::invalid_argument("law " + law.python_name + " joins " + name(candidates->contactor_a[i]) + " and " +
                                name(candidates->contactor_b[i]) + " at a gap of " + std::to_string(gap[0]) +
                                " m, and has no length to strain: leave a gap between them, or give Bonded or a law "
                                "of a cohesive zone to what touches");
  }
  memory.keys.push_back(key(i));
  if (law.anchored) anchor(i, law);
  memory.impulses.insert(memory.impulses.end(), std::size_t(memory.impulse_components), 0.0);
  const std::size_t end = memory.states.size() + std::size_t(memory.state_components);
  column = 0;
  for (const std::string& name : law.state) {
    if (name.back() == '*' && dim() == 3)
      memory.states.insert(memory.states.end(), 3, 0.0);
    else
      memory.states.push_back(state[n * column]);
    column += name.back() == '*' ? dim() - 1 : 1;
  }
  memory.states.resize(end, none);
  if (state[0] > 0) return Begun::joined;
  return law.anchored && !(geometry[0] > 0) ? Begun::without_area : Begun::loose; // bonds by sintering join later
}

// Converts memory read from old files, in which the state of a bond was its gap, huge where there was none.
void read_gaps_of_bonds(const Simulation& s, ContactMemory& m) {
  m.gaps_of_bonds = false;
  if (m.state_components == 0) return;
  widen(m.states, m.state_components, 2, m.keys.size(), none);
  const Contactors& c = s.scene.contactors;
  for (std::size_t k = 0; k < m.keys.size(); ++k) {
    const std::int32_t a = s.contactor(m.keys[k].contactor_a), b = s.contactor(m.keys[k].contactor_b);
    const int entry = a < 0 || b < 0 ? -1 : s.laws.find(*c.material[a], *c.material[b]);
    if (entry < 0 || !law_infos()[std::size_t(s.laws.entry(entry).law)].holds) continue;
    double* state = &m.states[k * std::size_t(m.state_components)];
    const double gap = state[0];
    state[0] = gap < none ? 2 : 0;
    state[1] = gap < none ? gap : 0;
  }
}

void Nscd::measure_anchored(Simulation& s) {
  const ContactMemory& m = s.interactions.memory();
  fit(anchored_, 2 * m.anchors.size());
  for (std::size_t k = 0; k < m.anchors.size(); ++k) {
    anchored_[2 * k] = s.contactor(m.keys[k].contactor_a);
    anchored_[2 * k + 1] = s.contactor(m.keys[k].contactor_b);
  }
  s.interactions.measure_anchored(s.scene.bodies, s.scene.contactors, s.laws, s.scene.cell, anchored_, s.candidates,
                                  &s.meshes, &s.scene.nodes);
}

// The two ends of each joint that came in have a material of their own.
void Nscd::declare_joints(Simulation& s) {
  const Contactors& c = s.scene.contactors;
  std::vector<DeclaredPair>& declared = s.handler.declared();
  declared.clear();
  const ContactMemory& memory = s.interactions.memory();
  const auto is_new = [&](std::int64_t one, std::int64_t two) {
    return !memory.has_seen(one) || !memory.has_seen(two);
  };
  std::vector<std::int64_t> other(std::size_t(s.laws.materials()), -1);
  for (std::int64_t k = 0; k < c.count; ++k) {
    const int m = *c.material[k], entry = s.laws.find(m, m);
    if (entry < 0 || !law_infos()[std::size_t(s.laws.entry(entry).law)].joins) continue;
    if (s.laws.entry(entry).params[joint_pulley] > 0) {
      if (other[std::size_t(m)] >= 0) continue; // all three ends at once
      other[std::size_t(m)] = *c.id[k];
      const RopeEnds ends = rope_ends(c, s.laws, m).value_or(RopeEnds{});
      if (ends.far < 0) continue;
      const std::int64_t one = *c.id[ends.near], two = *c.id[ends.pulley];
      if (is_new(one, two)) declared.push_back({std::min(one, two), std::max(one, two)});
      continue;
    }
    if (other[std::size_t(m)] < 0)
      other[std::size_t(m)] = *c.id[k];
    else if (is_new(*c.id[k], other[std::size_t(m)]))
      declared.push_back({other[std::size_t(m)], *c.id[k]});
  }
}

void Nscd::make_bonds(Simulation& s) {
  find_bonds(s);
  s.report.unjoined = unjoined_step_ == s.steps ? unjoined_ : std::string();
}

void Nscd::find_bonds(Simulation& s) {
  constexpr double may_warp = 1.0 / 64; // over the size of cells
  if (s.interactions.memory().contactors_seen >= s.scene.next_contactor_id) return;
  s.interactions.measure_from(s.scene.origin);
  double within = 0;
  bool keeping = false;
  for (int e = 0; e < s.laws.entries(); ++e) {
    const LawInfo& law = law_infos()[std::size_t(s.laws.entry(e).law)];
    keeping |= law.keeps;
    if (law.keeps && law.within >= 0) within = std::max(within, s.laws.entry(e).params[law.within]);
  }
  if (keeping) {
    const Contactors& c = s.scene.contactors;
    margins_.assign(c.count, 0);
    const auto digits = [&](const double* place) {
      double furthest = 0;
      for (int i = 0; i < s.scene.bodies.dim; ++i)
        furthest = std::max(furthest, std::abs(place[i]) + std::abs(s.scene.origin[std::size_t(i)]));
      return rounding_of_gaps(furthest);
    };
    for (std::int64_t k = 0; k < c.count; ++k) {
      if (*c.body[k] < 0) {
        const MeshBody& mesh = s.meshes.meshes[s.meshes.mesh_of(std::int32_t(k))];
        const double* place = s.scene.nodes.position[mesh.first_node];
        const double warped = warp(mesh.model, *c.part[k], place);
        const bool warps = s.meshes.warps(std::int32_t(k)); // in the step, too; see parted_warped
        const double size = (warps ? may_warp : 2 * touch) * std::max(*c.radius[k], mesh.size());
        margins_[k] = std::max({size, warped, within}) + digits(place);
      } else {
        margins_[k] = std::max(2 * touch * *c.radius[k], within) + digits(s.scene.bodies.position[*c.body[k]]);
      }
    }
    Margin margin{};
    margin.per_contactor = margins_.data();
    s.contacts_known = shows_kept_ = false;
    compute_free_velocity(s); // detection leaves out pairs that nothing moves
    s.scene.bodies.velocity.values = s.scene.bodies.velocity_begin.values;
    declare_joints(s);
    s.handler.detect(s.scene.bodies, c, s.scene.cell, margin, s.candidates,
                     {.mapped = &s.meshes.mapped(), .for_bonds = true}, &s.interactions.scratch(), &s.laws.rules());
    unjoined_ = s.interactions.bond(s.scene.bodies, c, s.candidates, s.laws, s.scene.cell, h_, law_share(), &s.meshes,
                                    &s.scene.nodes);
    unjoined_step_ = s.steps;
    s.candidates.count = 0;
  }
  s.interactions.see_contactors(s.scene.next_contactor_id);
}

// Turns a state vector from the tangent plane of the last detection into that of the present one, at constant length.
// Anchored states are given in axes of B; without anchors, or in a sliding contact, the vector also turns about the
// normal with the mean spin of both bodies. x: the vector, in space axes afterwards; where: index of the contact in the
// memory.
void Interactions::State::lay_into_plane(const cairn_batch& b, int lane, std::int32_t where, double x[3],
                                         double t[2]) const {
  double axes[3][3], whole = 0;
  axes_of(b, 3, lane, axes);
  t[0] = t[1] = 0;
  const bool anchored = !b.mapped_b && !memory.anchors.empty() && memory.anchors[std::size_t(where)].reach >= 0;
  if (anchored) to_space_axes(*bodies, 3, b.body_b[lane], x, x);
  for (int k = 0; k < 3; ++k) {
    whole += x[k] * x[k];
    t[0] += axes[1][k] * x[k];
    t[1] += axes[2][k] * x[k];
  }
  const double left = t[0] * t[0] + t[1] * t[1], scale = left > 0 ? std::sqrt(whole / left) : 1;
  t[0] *= scale;
  t[1] *= scale;
  if (anchored || b.mapped_a || b.mapped_b || (law_infos()[b.law].keeps && !is_sound_bond(b, lane))) return;
  const double twist = twist_since_last(b, lane, axes[0]), c = std::cos(twist), s = std::sin(twist), along = t[0];
  t[0] = c * along - s * t[1];
  t[1] = s * along + c * t[1];
}

// Mean rotation of two bodies about the normal, by their velocities between the two detections [rad].
double Interactions::State::twist_since_last(const cairn_batch& b, int lane, const double* normal) const {
  const double time = left_of_step * memory.h + (1 - left_of_step) * h;
  double spin = 0;
  for (int k = 0; k < 3; ++k)
    spin += normal[k] * (system.record[b.body_a[lane]].x[3 + k] + system.record[b.body_b[lane]].x[3 + k]) / 2;
  return spin * time;
}

} // namespace cairn
