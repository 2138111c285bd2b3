// Frames of joints: how they are made, and how far those of their bodies are apart.
#include "anchor_frames.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/vectors.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "body_axes.hpp"

namespace cairn {
namespace {

// a b of quaternions (w, x, y, z); conjugate: of a.
void product(const double* a, bool conjugate, const double* b, double* out) {
  const double w = a[0], sign = conjugate ? -1 : 1, x = sign * a[1], y = sign * a[2], z = sign * a[3];
  const double made[4] = {w * b[0] - x * b[1] - y * b[2] - z * b[3], w * b[1] + x * b[0] + y * b[3] - z * b[2],
                          w * b[2] - x * b[3] + y * b[0] + z * b[1], w * b[3] + x * b[2] - y * b[1] + z * b[0]};
  std::copy_n(made, 4, out);
}

// A unit quaternion as a vector, by the shorter way.
void vector_of(const double* q, double out[3]) {
  const double sign = q[0] < 0 ? -1 : 1, size = std::sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double angle = size > 0 ? 2 * std::atan2(size, sign * q[0]) / size : 2;
  for (int k = 0; k < 3; ++k) out[k] = sign * angle * q[1 + k];
}

} // namespace

void AnchorFrames::find_joints() {
  joint_material_.clear();
  const auto joins = [](Law law) { return law_infos()[std::size_t(law)].joins; };
  if (std::none_of(in_.laws->laws().begin(), in_.laws->laws().end(), joins)) return;
  fit(joint_material_, std::size_t(in_.laws->materials()));
  for (int m = 0; m < in_.laws->materials(); ++m) {
    const int found = in_.laws->find(m, m);
    joint_material_[std::size_t(m)] = found >= 0 && joins(in_.laws->entry(found).law);
  }
}

// How A stands against B; points of meshes do not turn.
void AnchorFrames::keep_turn(std::int32_t contactor_a, std::int32_t contactor_b, Anchor& made) const {
  const std::int32_t A = in_.body(contactor_a), B = in_.body(contactor_b);
  if (!in_.bodies->rotation.active || A < 0 || B < 0)
    made.turn[0] = in_.dim() == 2 ? 0 : 1;
  else if (in_.dim() == 2)
    made.turn[0] = *in_.bodies->rotation[A] - *in_.bodies->rotation[B];
  else
    product(in_.bodies->rotation[B], true, in_.bodies->rotation[A], made.turn);
}

// How far A turned from where B has it: a quaternion, in 2D an angle.
void AnchorFrames::turned_from(std::int32_t A, std::int32_t B, const Anchor& anchor, double found[4]) const {
  const double standing[4] = {in_.dim() == 2 ? 0.0 : 1.0, 0, 0, 0};
  const bool turns = in_.bodies->rotation.active;
  turned_from(turns ? in_.bodies->rotation[A] : standing, turns ? in_.bodies->rotation[B] : standing, anchor, found);
}

void AnchorFrames::turned_from(const double* A, const double* B, const Anchor& anchor, double found[4]) const {
  if (in_.dim() == 2) {
    found[0] = (A[0] - B[0]) - anchor.turn[0];
    return;
  }
  double turned[4]; // where A would be
  product(B, false, anchor.turn, turned);
  const double back[4] = {turned[0], -turned[1], -turned[2], -turned[3]};
  product(A, false, back, found);
}

// Undoes slips and turns of bonds that hold fast within the step, like their gaps: rounding would else add up to
// positions that the bonds of a face, or of a ring of bodies, cannot all have, and their impulses would grow against
// each other.
void AnchorFrames::hold_places(const cairn_batch& b) const {
  const int d = in_.dim(), n = b.count;
  for (int lane = 0; lane < b.contacts; ++lane) {
    const std::int64_t i = system_.candidate[b.first + lane];
    if (!anchors_.is_anchored(i) || !(b.state[lane] > 0) || b.state[lane] > 2) continue; // see mark_steps_of_bonds
    const Anchor& anchor = anchors_.of(i);
    if (!(anchor.length > 0)) continue; // of a file that did not know how its bodies stood
    const std::int32_t ca = in_.candidates->contactor_a[i], cb = in_.candidates->contactor_b[i];
    double axes[3][3] = {}, between[3] = {}, found[4], turn[3];
    axes_of(b, d, lane, axes);
    in_.between_ends(ca, cb, in_.candidates->image[i], anchor, between);
    for (int k = 0; k < d; ++k)
      for (int c = 1; c < d; ++c) b.bias[c * n + lane] += between[k] * axes[c][k] / in_.h;
    if (b.mapped_a || b.mapped_b) { // nodes have no turn; their flight to where contacts are detected is straight
      double bent[3] = {};
      const double flown = in_.at_midpoint() ? (1 - in_.theta) * (1 - in_.theta) * in_.h : 0; // over half a flight
      motion_.change_beside_mesh(b, lane, bent);
      for (int c = 1; c < d; ++c) b.bias[c * n + lane] -= flown / in_.h * bent[c];
      continue;
    }
    turned_from(in_.body(ca), in_.body(cb), anchor, found);
    if (d == 2) {
      b.bias[2 * n + lane] += found[0] / in_.h;
      continue;
    }
    vector_of(found, turn);
    for (int c = 0; c < 3; ++c)
      for (int k = 0; k < 3; ++k) b.bias[(3 + c) * n + lane] += turn[k] * axes[c][k] / in_.h;
  }
}

// Where the ends of a joint are, as bodies stand.
void AnchorFrames::pose_of(const cairn_batch& b, int lane, JointPose& pose) const {
  const std::int64_t i = system_.candidate[b.first + lane];
  const Anchor& anchor = anchors_.of(i);
  const std::int32_t ca = in_.candidates->contactor_a[i], cb = in_.candidates->contactor_b[i], A = in_.body(ca),
                     B = in_.body(cb);
  in_.between_ends(ca, cb, in_.candidates->image[i], anchor, pose.between);
  pose.turned[0] = in_.dim() == 2 ? 0 : 1;
  if (A >= 0 && B >= 0) turned_from(A, B, anchor, pose.turned); // points of meshes do not turn
  pose.turns = A >= 0 && B >= 0;
}

// Errors of n, t, s and about them, and the coordinate.
double AnchorFrames::errors(const cairn_batch& b, int lane, const JointPose& pose, double error[6]) const {
  const std::int64_t i = system_.candidate[b.first + lane];
  const double* params = classes_.rule(i).params;
  const int d = in_.dim(), blocked = int(params[joint_blocked]), coordinate = int(params[joint_coordinate]);
  double axes[3][3] = {}, along = 0;
  axes_of(b, d, lane, axes);
  std::fill_n(error, 6, 0.0);
  for (int c = 0; c < d; ++c)
    for (int k = 0; k < d; ++k) error[c] += pose.between[k] * axes[c][k];
  if (params[joint_spans] > 0) { // its length alone, however it turned since
    double square = 0;
    for (int k = 0; k < d; ++k) square += pose.between[k] * pose.between[k];
    if (pose.ahead) error[0] = std::sqrt(square);
  }
  if (coordinate == 1) along = error[0];
  if (b.rope) along += pose.ahead ? pose.far : ropes_.far_part(i).length;
  if (params[joint_spans] > 0) error[0] -= anchors_.of(i).length;
  if (!pose.turns) return along;
  const double* found = pose.turned;
  if (d == 2) {
    error[3] = found[0];
    return coordinate == 3 ? error[3] : along;
  }
  double turn[3];
  vector_of(found, turn);
  const double sign = found[0] < 0 ? -1 : 1, *v = found + 1;
  if (coordinate == 4)
    along = 2 * std::atan2(sign * (v[0] * axes[0][0] + v[1] * axes[0][1] + v[2] * axes[0][2]), sign * found[0]);
  if (!(blocked & 8)) { // about its axis it is free: how far the axes of both are from each other
    double other[3];
    turn_about(found, 1, axes[0], other);
    cross(axes[0], other, turn);
  }
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < 3; ++k) error[3 + c] += turn[k] * axes[c][k];
  return along;
}

void AnchorFrames::measure(const cairn_batch& b) const {
  const int n = b.count;
  for (int lane = 0; lane < b.contacts; ++lane) {
    if (!anchors_.is_anchored(system_.candidate[b.first + lane])) continue; // broken
    JointPose pose;
    double error[6];
    pose_of(b, lane, pose);
    b.state[7 * n + lane] = errors(b, lane, pose, error);
    for (int c = 0; c < 6; ++c) b.state[(1 + c) * n + lane] = error[c];
  }
  repeat_last(b, b.state, 8);
}

} // namespace cairn
