// Swing of joints under tension: a light body between heavy ones turns about its joints like a string, at a rate that
// steps need not resolve. The geometric stiffness of constraints (Tournier, Nesme, Gilles & Faure 2015), the resistance
// of joint loads against turns, lets a step take it implicitly.
#include <algorithm>
#include <cmath>

#include "../solvers/sweeps/contact_rows.hpp"
#include "interaction_state.hpp"

namespace cairn {
namespace {

// Adds (f.a) 1 - sym(a f'), what a load f at a lever a resists a turn by; in the plane f.a alone. [N m]
void add_stiffness(int dim, const double* load, const double* lever, double* to) {
  double along = 0;
  for (int k = 0; k < dim; ++k) along += load[k] * lever[k];
  if (dim == 2) {
    to[0] += along;
    return;
  }
  for (int k = 0; k < 3; ++k) to[k] += along - load[k] * lever[k];
  constexpr int pair[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  for (int k = 0; k < 3; ++k)
    to[3 + k] -= 0.5 * (load[pair[k][0]] * lever[pair[k][1]] + load[pair[k][1]] * lever[pair[k][0]]);
}

} // namespace

// A load that turns with its bodies, as across a slider, swings none.
void Interactions::loads_of_joints(std::vector<JointLoad>& loads) const {
  const State& s = *s_;
  loads.clear();
  if (!s.flies || s.pose.kernel || s.joint_material.empty()) return;
  const auto add = [&](std::int32_t body, const double* impulse, double sign, const double* lever) {
    JointLoad load{body, {}};
    double force[3] = {};
    for (int k = 0; k < s.dim(); ++k) force[k] = sign * impulse[k] / s.h;
    add_stiffness(s.dim(), force, lever, load.stiffness);
    loads.push_back(load);
  };
  for (const cairn_batch& b : s.system.batches) {
    if (!law_infos()[b.law].joins) continue;
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::int64_t i = s.system.candidate[b.first + lane];
      if (!s.is_anchored(i) || !(b.state[lane] > 0)) continue;
      const double* params = s.laws->entry(s.entry[i]).params;
      if (params[joint_coordinate] == 1 && !(params[joint_spans] > 0)) continue;
      const Anchor& anchor = s.held[std::size_t(s.anchor_of[std::size_t(i)])];
      double p[3], m[3], lever[3] = {};
      s.space_impulse(b, lane, p, m);
      if (!b.mapped_a && b.moves_a) {
        s.carried(s.candidates->contactor_a[i], anchor.a, lever);
        add(b.body_a[lane], p, 1, lever);
      }
      if (!b.mapped_b && b.moves_b) {
        s.carried(s.candidates->contactor_b[i], anchor.b, lever);
        add(b.body_b[lane], p, -1, lever);
      }
      if (!b.rope) continue;
      const State::FarPart far = s.far_part(i);
      double pull[3] = {};
      for (int k = 0; k < s.dim(); ++k) pull[k] = at(b, b.r, lane, 0) * far.normal[k];
      for (int end = 0; end < 2; ++end)
        if (far.body[end] >= 0 && far.body[end] < s.system.bodies)
          add(far.body[end], pull, end ? -1 : 1, far.lever[end]);
    }
  }
  std::sort(loads.begin(), loads.end(), [](const JointLoad& x, const JointLoad& y) { return x.body < y.body; });
  std::size_t to = 0;
  for (std::size_t k = 0; k < loads.size(); ++k) {
    if (to > 0 && loads[to - 1].body == loads[k].body)
      for (int c = 0; c < 6; ++c) loads[to - 1].stiffness[c] += loads[k].stiffness[c];
    else
      loads[to++] = loads[k];
  }
  loads.resize(to);
}

// How the ends of a bar give way across it, at most. [1/kg]
double Interactions::State::gives_across(const cairn_batch& b, int lane) const {
  const int d = system.dim, n = system.velocities();
  double most = 0, of[3] = {};
  for (int side = 0; side < 2; ++side) {
    if (is_mapped(b, side)) {
      const std::int32_t node = (side ? b.node_b : b.node_a)[lane], body = (side ? b.body_b : b.body_a)[lane];
      double block[9];
      cairn_condensed_block(d, &system.condensed_dofs[std::size_t(body)], node, node, block);
      for (int c = 1; c < d; ++c)
        for (int k = 0; k < d; ++k) of[c] += block[(d + 1) * k];
      continue;
    }
    if (!moves_rigid(b, side)) continue;
    double mass[36], inverse[36], rows[36];
    body_mass(system, (side ? b.body_b : b.body_a)[lane], mass, inverse);
    rigid_rows(system, b, lane, side, d, inverse, rows);
    for (int c = 1; c < d; ++c)
      for (int k = 0; k < n; ++k)
        for (int l = 0; l < n; ++l) of[c] += rows[d * k + c] * inverse[n * l + k] * rows[d * l + c];
  }
  for (int c = 1; c < d; ++c) most = std::max(most, of[c]);
  return most;
}

// The distance of its ends.
double Interactions::State::length_across(const cairn_batch& b, int lane) const {
  JointPose ends;
  joint_pose(b, lane, ends);
  double length = 0;
  for (int k = 0; k < dim(); ++k) length = std::hypot(length, ends.between[k]);
  return length;
}

// A bar without mass swings as the string that it stands for: across it its tension F resists as a spring of F/length,
// of which the change of velocity in a step is given a share. What acts across acts at its ends, and not in the middle.
void Interactions::State::fill_drags(const cairn_batch& b) const {
  for (int lane = 0; lane < b.count; ++lane) {
    double& drag = b.state[11 * b.count + lane] = 0;
    if (lane >= b.contacts || !flies || pose.kernel) continue;
    const std::int64_t i = system.candidate[b.first + lane];
    const double tension = -at(b, b.r, lane, 0);
    if (!(laws->entry(entry[i]).params[joint_spans] > 0) || !(tension > 0)) continue;
    if (!is_anchored(i) || !(b.state[lane] > 0)) continue;
    const double length = length_across(b, lane);
    if (!(length > 0)) continue;
    const Anchor& anchor = held[std::size_t(anchor_of[std::size_t(i)])];
    double middle[2][3] = {}, end[2][3] = {};
    carried(candidates->contactor_a[i], anchor.a, end[0]);
    carried(candidates->contactor_b[i], anchor.b, end[1]);
    const auto each = [&](const auto& give) {
      for (int k = 0; k < dim(); ++k) {
        if (!b.mapped_a) give(at(b, b.lever_a, lane, k), 0, k);
        if (!b.mapped_b) give(at(b, b.lever_b, lane, k), 1, k);
      }
    };
    each([&](double& lever, int side, int k) { middle[side][k] = lever, lever = end[side][k]; });
    drag = implicit_share(h * tension * gives_across(b, lane) / length) * h * tension / length;
    if (!(drag > 0)) each([&](double& lever, int side, int k) { lever = middle[side][k]; });
  }
}

double Interactions::swing_across() const {
  const State& s = *s_;
  double most = 0;
  for (const cairn_batch& b : s.system.batches) {
    if (s.joint_material.empty() || !law_infos()[b.law].joins) continue;
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::int64_t i = s.system.candidate[b.first + lane];
      if (!s.is_anchored(i) || !(b.state[lane] > 0) || !(s.laws->entry(s.entry[i]).params[joint_spans] > 0)) continue;
      const double tension = -at(b, b.r, lane, 0), length = s.length_across(b, lane);
      if (!(length > 0) || !(tension > 0)) continue;
      const double gives = s.gives_across(b, lane), drag = b.state[11 * b.count + lane];
      most = std::max(most, s.h * tension * gives / length / (1 + drag * gives));
    }
  }
  return most;
}

} // namespace cairn
