// Swing of joints under tension: a light body between heavy ones turns about its joints like a string, at a rate that
// steps need not resolve. The geometric stiffness of constraints (Tournier, Nesme, Gilles & Faure 2015), the resistance
// of joint loads against turns, lets a step take it implicitly.
#include "joint_swing.hpp"

#include <algorithm>
#include <cmath>

#include "../solvers/sweeps/batch.hpp"
#include "../solvers/sweeps/contact_rows.hpp"

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
void JointSwing::loads(std::vector<JointLoad>& loads) const {
  loads.clear();
  if (!frames_.joints_at_midpoint()) return;
  const auto add = [&](std::int32_t body, const double* impulse, double sign, const double* lever) {
    JointLoad load{body, {}};
    double force[3] = {};
    for (int k = 0; k < in_.dim(); ++k) force[k] = sign * impulse[k] / in_.h;
    add_stiffness(in_.dim(), force, lever, load.stiffness);
    loads.push_back(load);
  };
  for (const cairn_batch& b : system_.batches) {
    if (!law_infos()[b.law].joins) continue;
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::int64_t i = system_.candidate[b.first + lane];
      if (!anchors_.is_anchored(i) || !(b.state[lane] > 0)) continue;
      const double* params = classes_.rule(i).params;
      if (params[joint_coordinate] == 1 && !(params[joint_spans] > 0)) continue;
      const Anchor& anchor = anchors_.of(i);
      double p[3], m[3], lever[3] = {};
      space_impulse(in_.dim(), b, lane, p, m);
      if (!b.mapped_a && b.moves_a) {
        in_.carried(in_.candidates->contactor_a[i], anchor.a, lever);
        add(b.body_a[lane], p, 1, lever);
      }
      if (!b.mapped_b && b.moves_b) {
        in_.carried(in_.candidates->contactor_b[i], anchor.b, lever);
        add(b.body_b[lane], p, -1, lever);
      }
      if (!b.rope) continue;
      const Ropes::FarPart far = ropes_.far_part(i);
      double pull[3] = {};
      for (int k = 0; k < in_.dim(); ++k) pull[k] = at(b, b.r, lane, 0) * far.normal[k];
      for (int end = 0; end < 2; ++end)
        if (far.body[end] >= 0 && far.body[end] < system_.bodies)
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
double JointSwing::gives_across(const cairn_batch& b, int lane) const {
  const int d = system_.dim, n = system_.velocities();
  double most = 0, of[3] = {};
  for (int side = 0; side < 2; ++side) {
    if (is_mapped(b, side)) {
      const std::int32_t node = (side ? b.node_b : b.node_a)[lane], body = (side ? b.body_b : b.body_a)[lane];
      double block[9];
      cairn_condensed_block(d, &system_.condensed_dofs[std::size_t(body)], node, node, block);
      for (int c = 1; c < d; ++c)
        for (int k = 0; k < d; ++k) of[c] += block[(d + 1) * k];
      continue;
    }
    if (!moves_rigid(b, side)) continue;
    double mass[36], inverse[36], rows[36];
    body_mass(system_, (side ? b.body_b : b.body_a)[lane], mass, inverse);
    rigid_rows(system_, b, lane, side, d, inverse, rows);
    for (int c = 1; c < d; ++c)
      for (int k = 0; k < n; ++k)
        for (int l = 0; l < n; ++l) of[c] += rows[d * k + c] * inverse[n * l + k] * rows[d * l + c];
  }
  for (int c = 1; c < d; ++c) most = std::max(most, of[c]);
  return most;
}

// The distance of its ends.
double JointSwing::length_across(const cairn_batch& b, int lane) const {
  JointPose ends;
  frames_.pose_of(b, lane, ends);
  double length = 0;
  for (int k = 0; k < in_.dim(); ++k) length = std::hypot(length, ends.between[k]);
  return length;
}

// A bar without mass swings as the string that it stands for: across it its tension F resists as a spring of F/length,
// of which the change of velocity in a step is given a share. What acts across acts at its ends, and not in the middle.
void JointSwing::fill(const cairn_batch& b) const {
  for (int lane = 0; lane < b.count; ++lane) {
    double& drag = b.state[11 * b.count + lane] = 0;
    if (lane >= b.contacts || !in_.at_midpoint() || in_.options.pose.kernel) continue;
    const std::int64_t i = system_.candidate[b.first + lane];
    const double tension = -at(b, b.r, lane, 0);
    if (!(classes_.rule(i).params[joint_spans] > 0) || !(tension > 0)) continue;
    if (!anchors_.is_anchored(i) || !(b.state[lane] > 0)) continue;
    const double length = length_across(b, lane);
    if (!(length > 0)) continue;
    const Anchor& anchor = anchors_.of(i);
    double middle[2][3] = {}, end[2][3] = {};
    in_.carried(in_.candidates->contactor_a[i], anchor.a, end[0]);
    in_.carried(in_.candidates->contactor_b[i], anchor.b, end[1]);
    const auto each = [&](const auto& give) {
      for (int k = 0; k < in_.dim(); ++k) {
        if (!b.mapped_a) give(at(b, b.lever_a, lane, k), 0, k);
        if (!b.mapped_b) give(at(b, b.lever_b, lane, k), 1, k);
      }
    };
    each([&](double& lever, int side, int k) { middle[side][k] = lever, lever = end[side][k]; });
    drag = implicit_share(in_.h * tension * gives_across(b, lane) / length) * in_.h * tension / length;
    if (!(drag > 0)) each([&](double& lever, int side, int k) { lever = middle[side][k]; });
  }
}

double JointSwing::swing_across() const {
  double most = 0;
  for (const cairn_batch& b : system_.batches) {
    if (!frames_.any_joints() || !law_infos()[b.law].joins) continue;
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::int64_t i = system_.candidate[b.first + lane];
      if (!anchors_.is_anchored(i) || !(b.state[lane] > 0) || !(classes_.rule(i).params[joint_spans] > 0)) continue;
      const double tension = -at(b, b.r, lane, 0), length = length_across(b, lane);
      if (!(length > 0) || !(tension > 0)) continue;
      const double gives = gives_across(b, lane), drag = b.state[11 * b.count + lane];
      most = std::max(most, in_.h * tension * gives / length / (1 + drag * gives));
    }
  }
  return most;
}

} // namespace cairn
