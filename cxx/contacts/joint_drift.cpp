// Joints hold where the next step detects them: what the flight of their law misses there, of third order in the step,
// is found from the velocities of its solution and made good by its biases. This is SHAKE (Ryckaert, Ciccotti &
// Berendsen 1977) by Newton's method, so that neither errors nor the energy drift.
#include "joint_drift.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "../solvers/sweeps/batch.hpp"
#include "body_axes.hpp"

namespace cairn {
namespace {

// Where a body will be, as long as nothing acts on it, when the next step detects contacts.
struct Ahead {
  double moved[3] = {}, rotation[4] = {1, 0, 0, 0};

  // A point of a mesh flies straight on, with the axes of space.
  Ahead(const double* velocity, int dim, double h) {
    for (int k = 0; k < dim; ++k) moved[k] = h * velocity[k];
    if (dim == 2) rotation[0] = 0;
  }
  Ahead(const Bodies& b, const cairn_record& record, std::int32_t body, int dim, double h, double share) {
    for (int k = 0; k < dim; ++k) moved[k] = h * record.x[k];
    if (dim == 2) {
      rotation[0] = (b.rotation.active ? *b.rotation[body] : 0) + h * record.x[2];
      return;
    }
    if (!b.rotation.active) return;
    double momentum[3], velocity[6];
    std::copy_n(b.rotation[body], 4, rotation);
    std::copy_n(record.x, 6, velocity);
    const std::int8_t* driven = b.driven.active ? reinterpret_cast<const std::int8_t*>(b.driven[body]) : nullptr;
    if (b.angular_momentum.active) {
      std::copy_n(b.angular_momentum[body], 3, momentum);
      cairn_momentum_update(1, 1, b.inertia[body], rotation, b.velocity[body], velocity, momentum, driven);
    }
    for (const double part : {share, 1 - share}) { // to the end of the step, and on
      std::int64_t unsolved = 0;
      cairn_rotate(1, h * part, b.inertia[body], velocity, rotation, b.angular_momentum.active ? momentum : nullptr,
                   driven, &unsolved);
    }
  }
  // A vector of its axes in those of space.
  void carry(int dim, const double* own, double* out) const {
    if (dim == 3) return turn_about(rotation, 1, own, out);
    const double c = std::cos(rotation[0]), s = std::sin(rotation[0]);
    out[0] = c * own[0] - s * own[1];
    out[1] = s * own[0] + c * own[1];
  }
};

} // namespace

// Velocity of a side that rests on nodes of a mesh, with the impulses at hand [m/s].
void JointDrift::velocity_of_mapped(const cairn_batch& b, bool of_b, int lane, double out[3]) const {
  const int n = b.count, d = in_.dim();
  const std::int32_t *const node = of_b ? b.node_b : b.node_a, *const dof = of_b ? b.dof_b : b.dof_a;
  const double* weight = of_b ? b.lever_b : b.lever_a;
  const cairn_condensed& mesh = b.condensed[(of_b ? b.body_b : b.body_a)[lane]];
  std::fill_n(out, 3, 0.0);
  for (int j = 0; j < (of_b ? b.nodes_b : b.nodes_a); ++j) {
    const int at = j * n + lane;
    double reached[3] = {};
    if (mesh.reach && std::abs(weight[at]) > 0) cairn_reached_velocity(d, &mesh, node[at], reached);
    for (int k = 0; k < d; ++k) out[k] += weight[at] * (b.condensed_velocity[dof[at] + k] + reached[k]);
  }
}

// Velocity and spin of the carrier of an end; nodes have no spin.
void JointDrift::velocity_of_end(const cairn_batch& b, bool of_b, int lane, double out[6]) const {
  std::fill_n(out, 6, 0.0);
  if (of_b ? b.mapped_b : b.mapped_a) return velocity_of_mapped(b, of_b, lane, out);
  std::copy_n(system_.record[(of_b ? b.body_b : b.body_a)[lane]].x, system_.velocities(), out);
}

// Pose of a joint after a time of flight, in the present axes of B, so that motion with B is no error.
void JointDrift::pose_ahead(const cairn_batch& b, int lane, double time, JointPose& pose) const {
  const std::int64_t i = system_.candidate[b.first + lane];
  const Anchor& anchor = anchors_.of(i);
  const int d = std::min(in_.dim(), 3);
  const auto ahead = [&](bool of_b) {
    const std::int32_t body = (of_b ? b.body_b : b.body_a)[lane];
    if (!(of_b ? b.mapped_b : b.mapped_a))
      return Ahead(*in_.bodies, system_.record[body], body, d, time, in_.options.time_left);
    double velocity[3];
    velocity_of_mapped(b, of_b, lane, velocity);
    return Ahead(velocity, d, time);
  };
  const Ahead of_a = ahead(false), of_b = ahead(true);
  double a[3] = {}, to_b[3] = {}, at_a[3] = {}, at_b[3] = {}, shift[3] = {0, 0, 0}, flown[3] = {0, 0, 0},
         between[3] = {};
  if (in_.cell->any()) image_shift(*in_.cell, in_.candidates->image[i], shift);
  if (in_.sheared) image_velocity(*in_.cell, in_.candidates->image[i], flown);
  in_.carrier_at(in_.candidates->contactor_a[i], at_a);
  in_.carrier_at(in_.candidates->contactor_b[i], at_b);
  of_a.carry(d, anchor.a, a);
  of_b.carry(d, anchor.b, to_b);
  for (int k = 0; k < d; ++k)
    between[k] =
        (at_a[k] - (at_b[k] + shift[k])) + (of_a.moved[k] - (of_b.moved[k] + time * flown[k])) + (a[k] - to_b[k]);
  const double standing[4] = {d == 2 ? 0.0 : 1.0, 0, 0, 0};
  const double* now = in_.bodies->rotation.active && !b.mapped_b ? in_.bodies->rotation[b.body_b[lane]] : standing;
  pose.ahead = true;
  if (b.rope) pose.far = far_ahead(i, time);
  pose.turns = !b.mapped_a && !b.mapped_b;
  if (pose.turns) frames_.turned_from(of_a.rotation, of_b.rotation, anchor, pose.turned);
  if (d == 2) {
    const double back = now[0] - of_b.rotation[0], c = std::cos(back), s = std::sin(back);
    pose.between[0] = c * between[0] - s * between[1];
    pose.between[1] = s * between[0] + c * between[1];
    return;
  }
  double own[3];
  turn_about(of_b.rotation, -1, between, own);
  turn_about(now, 1, own, pose.between);
  if (!pose.turns) return;
  turn_about(of_b.rotation, -1, pose.turned + 1, own);
  turn_about(now, 1, own, pose.turned + 1);
}

// Length of the far part of a rope after a time of flight [m].
double JointDrift::far_ahead(std::int64_t i, double time) const {
  const RopeEnds ends = ropes_.ends_of(i);
  double between[3] = {}, square = 0;
  for (const auto& [sign, mark] : {std::pair{1, ends.far}, std::pair{-1, ends.pulley}}) {
    const std::int32_t of = in_.body(mark);
    const Ahead end(*in_.bodies, system_.record[of], of, in_.dim(), time, in_.options.time_left);
    double own[3] = {}, lever[3] = {}, at[3] = {};
    if (in_.contactors->offset.active) std::copy_n(in_.contactors->offset[mark], in_.dim(), own);
    end.carry(in_.dim(), own, lever);
    in_.carrier_at(mark, at);
    for (int k = 0; k < in_.dim(); ++k) between[k] += sign * (at[k] + end.moved[k] + lever[k]);
  }
  for (int k = 0; k < in_.dim(); ++k) square += between[k] * between[k];
  return std::sqrt(square);
}

double JointDrift::beyond_limits(const cairn_batch& b, int lane, double along) const {
  const double* params = classes_.rule(system_.candidate[b.first + lane]).params;
  if (!(params[joint_coordinate] > 0)) return 0;
  return std::max(0.0, along - params[joint_highest]) + std::min(0.0, along - params[joint_lowest]);
}

JointMiss JointDrift::miss(const Bodies& bodies, double least) {
  if (!frames_.joints_at_midpoint() || system_.batches.empty()) return {};
  system_.load(in_.free(bodies));
  const cairn_schedule schedule = system_.schedule(omp_get_max_threads());
  cairn_add_impulses(&schedule);
  return largest_miss(least);
}

// True if the ends of a joint pass each other on curved paths, however contacts are solved.
bool JointDrift::bends(const cairn_batch& b, int lane) const {
  if (b.params[joint_spans * b.count + lane] > 0) return true;
  const auto turns = [&](bool mapped, bool moves, std::int32_t body) {
    const double* x = mapped ? nullptr : in_.bodies->velocity[body];
    return !mapped && (moves || std::any_of(x + in_.dim(), x + 3 * in_.dim() - 3, [](double w) { return w != 0; }));
  };
  return turns(b.mapped_a != 0, b.moves_a != 0, b.body_a[lane]) ||
         turns(b.mapped_b != 0, b.moves_b != 0, b.body_b[lane]);
}

// Finds the errors of blocked components by the records, which hold the velocities of a solution: position errors of
// joints, small beside the relative speed of their bodies, in any frame of the scene; below the rounding of positions
// and velocities there is nothing to correct.
JointMiss JointDrift::largest_miss(double least) {
  JointMiss found;
  Speeds speeds;
  missed_.clear();
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    if (!law_infos()[b.law].joins) continue;
    const bool of_mesh = b.mapped_a || b.mapped_b;
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::int64_t i = system_.candidate[b.first + lane];
      const int blocked = int(classes_.rule(i).params[joint_blocked]);
      if (blocked == 0 || !anchors_.is_anchored(i) || !(b.state[lane] > 0) || (of_mesh && !bends(b, lane))) continue;
      JointPose pose;
      double error[6];
      pose_ahead(b, lane, in_.h, pose);
      frames_.errors(b, lane, pose, error);
      const std::size_t first = missed_.size();
      for (int c = 0; c < (of_mesh ? in_.dim() : b.components); ++c)
        if (blocked >> c & 1) missed_.push_back({k, lane, c, error[in_.dim() == 2 && c == 2 ? 3 : c], 0});
      if (missed_.size() == first) continue;
      add_speeds(b, lane, speeds);
      const double length = length_of_joint(b, lane, anchors_.of(i));
      for (std::size_t n = first; n < missed_.size(); ++n) {
        const bool moves = missed_[n].component < in_.dim();
        const double miss = std::abs(missed_[n].error), share = miss / (moves ? length : 1);
        if (moves) found.gap = std::max(found.gap, miss);
        if (found.contact < 0 || share > found.error) found.error = share, found.contact = i;
      }
      found.swing = std::max(found.swing, swing_of(b, lane, length));
    }
  }
  found.small = found.gap / in_.h <= std::max(least * speeds.fastest, speeds.rounding);
  return found;
}

// Adds a joint to the largest relative speed of ends and to the rounding of their places and velocities.
void JointDrift::add_speeds(const cairn_batch& b, int lane, Speeds& speeds) const {
  const std::int64_t i = system_.candidate[b.first + lane];
  const Anchor& anchor = anchors_.of(i);
  double one[6], two[6], at_a[3], at_b[3], apart = 0, whole = 0, place = 0;
  velocity_of_end(b, false, lane, one);
  velocity_of_end(b, true, lane, two);
  in_.carrier_at(in_.candidates->contactor_a[i], at_a);
  in_.carrier_at(in_.candidates->contactor_b[i], at_b);
  for (int k = 0; k < in_.dim(); ++k) {
    apart = std::hypot(apart, one[k] - two[k]);
    whole = std::max({whole, std::abs(one[k]), std::abs(two[k])});
    place = std::max({place, std::abs(at_a[k]), std::abs(at_b[k])});
  }
  speeds.rounding = std::max(speeds.rounding, std::numeric_limits<double>::epsilon() * (place / in_.h + whole));
  for (const auto& [x, arm] :
       {std::pair{&one[0], anchor.a}, std::pair{&two[0], anchor.b}}) { // how fast an end turns about its body
    double spin = 0, length = 0;
    for (int k = in_.dim(); k < 3 * in_.dim() - 3; ++k) spin = std::hypot(spin, x[k]);
    for (int k = 0; k < in_.dim(); ++k) length = std::hypot(length, arm[k]);
    apart = std::max(apart, spin * length);
  }
  speeds.fastest = std::max(speeds.fastest, apart);
}

// How far from the middles of its bodies a joint holds them, or apart; at the middle of both, how far these reach.
double JointDrift::length_of_joint(const cairn_batch& b, int lane, const Anchor& anchor) const {
  double length = anchor.length, of_a = 0, of_b = 0;
  for (int k = 0; k < in_.dim(); ++k) of_a = std::hypot(of_a, anchor.a[k]), of_b = std::hypot(of_b, anchor.b[k]);
  length = std::max({length, of_a, of_b});
  if (length > 0) return length;
  if (b.mapped_a || b.mapped_b) {
    const std::int64_t i = system_.candidate[b.first + lane];
    length = in_.meshes->cell_size(in_.candidates->contactor_a[i], in_.candidates->contactor_b[i]);
  } else {
    for (const std::int32_t body : {b.body_a[lane], b.body_b[lane]}) {
      const double mass = *in_.bodies->mass[body], inertia = in_.bodies->inertia[body][0];
      if (!(length > 0) && mass > 0 && std::isfinite(mass) && std::isfinite(inertia))
        length = std::sqrt(inertia / mass);
    }
  }
  return length > 0 && std::isfinite(length) ? length : 1;
}

// Square of step times rate at which the force F of a joint swings the lighter body like a weight on a string: rate^2 =
// F W/length, W the compliance of its end.
double JointDrift::swing_of(const cairn_batch& b, int lane, double length) const {
  double impulse = 0;
  for (int c = 0; c < std::min(in_.dim(), b.components); ++c) impulse = std::hypot(impulse, at(b, b.r, lane, c));
  return in_.h * impulse / (b.rho[lane] * length);
}

void JointDrift::keep() {
  kept_.swap(missed_);
  missed_.clear();
  for (Missed& one : kept_) one.bias = *bias_of(one);
}

void JointDrift::correct(double share) {
  for (const Missed& one : kept_) *bias_of(one) = one.bias + share * one.error / in_.h;
}

double* JointDrift::bias_of(const Missed& one) const {
  const cairn_batch& b = system_.batches[one.batch];
  return &b.bias[one.component * b.count + one.lane];
}

// Eases joints whose blocked direction is nearly orthogonal to all possible motions of their bodies, such as a weight
// between two straight bars: correcting their error asks for any speed, which makes it larger. They go without
// correction for a step, and hold their velocities alone. True if there are any.
bool JointDrift::ease(const Bodies& bodies, bool settled) {
  if (!frames_.joints_at_midpoint() || system_.batches.empty()) return false;
  if (settled && !any_spans()) return false;
  system_.load(in_.free(bodies));
  const cairn_schedule schedule = system_.schedule(omp_get_max_threads());
  cairn_add_impulses(&schedule);
  return ease();
}

// True if there are joints of a length: beside the speeds to which these can throw bodies their error is small.
bool JointDrift::any_spans() const {
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts && law_infos()[b.law].joins; ++lane)
      if (b.params[joint_spans * b.count + lane] > 0) return true;
  return false;
}

bool JointDrift::ease() {
  constexpr double much = 0.1, some = 1e-4; // limits of the new error, over the largest motion of a joint in the step
  bool of_spans = false, of_others = false;
  double fastest = 0;
  const auto each = [&](auto&& visit) {
    for (const cairn_batch& b : system_.batches)
      for (int lane = 0; lane < b.contacts && law_infos()[b.law].joins && !b.mapped_a && !b.mapped_b; ++lane)
        if (anchors_.is_anchored(system_.candidate[b.first + lane]) && b.state[lane] > 0) visit(b, lane);
  };
  each([&](const cairn_batch& b, int lane) { fastest = std::max(fastest, flown(b, lane)); });
  each([&](const cairn_batch& b, int lane) {
    const double more = missed_more(b, lane);
    of_spans |= b.params[joint_spans * b.count + lane] > 0 && more > some * fastest;
    of_others |= more > much * fastest;
  });
  if (!of_spans && !of_others) return false;
  each([&](const cairn_batch& b, int lane) {
    const bool spans = b.params[joint_spans * b.count + lane] > 0;
    if (!(missed_more(b, lane) > some * fastest)) return;
    const int blocked = int(b.params[joint_blocked * b.count + lane]);
    for (int c = 0; c < b.components; ++c)
      if (blocked >> c & 1) b.bias[c * b.count + lane] = 0;
    if (!(blocked & 1) && spans) { // a rope, or limits of a length
      double& along = b.state[7 * b.count + lane];
      b.bias[lane] = 0;
      along = std::clamp(along, b.params[joint_lowest * b.count + lane], b.params[joint_highest * b.count + lane]);
    }
    for (int c = 0; c < b.components; ++c) b.r[c * b.count + lane] = 0; // an old impulse would dwarf all errors
  });
  return true;
}

// Relative displacement of the centres of the bodies of a joint in a step, by the present velocities [m].
double JointDrift::flown(const cairn_batch& b, int lane) const {
  const double *one = system_.record[b.body_a[lane]].x, *two = system_.record[b.body_b[lane]].x;
  double apart = 0;
  for (int k = 0; k < in_.dim(); ++k) apart = std::hypot(apart, one[k] - two[k]);
  return in_.h * apart;
}

// Error of a joint by the velocities at hand, if far larger than its present error, else 0.
double JointDrift::missed_more(const cairn_batch& b, int lane) const {
  constexpr double worse = 4;
  const double* params = classes_.rule(system_.candidate[b.first + lane]).params;
  const int n = b.count, d = in_.dim(), blocked = int(params[joint_blocked]);
  JointPose pose;
  double error[6], was = 0, is = 0;
  pose_ahead(b, lane, in_.h, pose);
  const double reach = frames_.errors(b, lane, pose, error);
  for (int c = 0; c < d; ++c)
    if (blocked >> c & 1 && !(d == 2 && c == 2)) {
      was = std::max(was, std::abs(b.state[(1 + c) * n + lane]));
      is = std::max(is, std::abs(error[c]));
    }
  if (!(blocked & 1) && params[joint_spans] > 0) {
    was = std::max(was, std::abs(beyond_limits(b, lane, b.state[7 * n + lane])));
    is = std::max(is, std::abs(beyond_limits(b, lane, reach)));
  }
  return was > 0 && is > worse * was ? is : 0;
}

} // namespace cairn
