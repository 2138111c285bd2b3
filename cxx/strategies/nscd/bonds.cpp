// Pairs that laws keep begin where bodies stand when they come in, before anything moves.
#include "bonds.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "../../solvers/sweeps/batch.hpp"

namespace cairn {
namespace {

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

// The two ends of each joint that came in have a material of their own.
void declare_joints(Simulation& s) {
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

} // namespace

// Converts memory read from old files, in which the state of a bond was its gap, huge where there was none.
void read_gaps_of_bonds(const Simulation& s, ContactMemory& m) {
  m.gaps_of_bonds = false;
  if (m.state_components == 0) return;
  widen(m.states, m.state_components, 2, m.keys.size(), no_state);
  const Contactors& c = s.scene.contactors;
  for (std::size_t k = 0; k < m.keys.size(); ++k) {
    const std::int32_t a = s.contactor(m.keys[k].contactor_a), b = s.contactor(m.keys[k].contactor_b);
    const int entry = a < 0 || b < 0 ? -1 : s.laws.find(*c.material[a], *c.material[b]);
    if (entry < 0 || !law_infos()[std::size_t(s.laws.entry(entry).law)].holds) continue;
    double* state = &m.states[k * std::size_t(m.state_components)];
    const double gap = state[0];
    state[0] = gap < no_state ? 2 : 0;
    state[1] = gap < no_state ? gap : 0;
  }
}

namespace {

bool any_holds_broken(const LawTable& laws) {
  for (int entry = 0; entry < laws.entries(); ++entry)
    if (law_infos()[std::size_t(laws.entry(entry).law)].holds_broken) return true;
  return false;
}

} // namespace

// Contactors of each key, where bonds are anchored, or may hold meshes to each other.
void BondGaps::measure(Simulation& s) {
  const ContactMemory& m = s.interactions.memory();
  const bool meshes = m.anchors.empty() && !s.meshes.empty() && any_holds_broken(s.laws);
  const std::size_t keys = meshes ? m.keys.size() : m.anchors.size();
  fit(contactors_, 2 * keys);
  for (std::size_t k = 0; k < keys; ++k) {
    contactors_[2 * k] = s.contactor(m.keys[k].contactor_a);
    contactors_[2 * k + 1] = s.contactor(m.keys[k].contactor_b);
  }
  s.interactions.measure_anchored(s.scene.bodies, s.scene.contactors, s.laws, s.scene.cell, contactors_, s.candidates,
                                  &s.meshes, &s.scene.nodes);
}

void BondSearch::make(Simulation& s, const StepScheme& step, const std::function<void()>& free_velocity) {
  find(s, step, free_velocity);
  s.report.unjoined = unjoined_step_ == s.steps ? unjoined_ : std::string();
}

void BondSearch::find(Simulation& s, const StepScheme& step, const std::function<void()>& free_velocity) {
  constexpr double may_warp = 1.0 / 64; // over the size of cells
  if (s.interactions.memory().contactors_seen >= s.scene.next_contactor_id) return;
  s.interactions.options().origin = s.scene.origin;
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
        const double* place = s.scene.nodes.position[mesh.first_node()];
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
    free_velocity();
    s.scene.bodies.velocity.values = s.scene.bodies.velocity_begin.values;
    declare_joints(s);
    s.handler.detect(s.scene.bodies, c, s.scene.cell, margin, s.candidates,
                     {.mapped = &s.meshes.mapped(), .for_bonds = true}, &s.interactions.scratch(), &s.laws.rules());
    unjoined_ = s.interactions.bond(s.scene.bodies, c, s.candidates, s.laws, s.scene.cell, step.h, step.law_share(),
                                    &s.meshes, &s.scene.nodes);
    unjoined_step_ = s.steps;
    s.candidates.count = 0;
  }
  s.interactions.see_contactors(s.scene.next_contactor_id);
}

} // namespace cairn
