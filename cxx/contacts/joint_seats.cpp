// Seats of joints: a step holds joints where the next one detects contacts, in the middle of its flight. Where a joint
// comes in, or the step length changes, bodies that turn about it fly past that place by r (w h)^2/8 on straight paths.
// Impulses would undo that, an eighth too strong in one step and too weak in the next, so bodies are moved there.
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "../solvers/sweeps/jointed_problem.hpp"
#include "interaction_state.hpp"

namespace cairn {
namespace {

// 1 of a coordinate in metres; the length of the joint, of an angle.
double unit_of_coordinate(const cairn_batch& b, int lane, double length) {
  return b.params[joint_coordinate * b.count + lane] > 1 ? length : 1;
}

} // namespace

bool Interactions::seats_joints() const {
  const State& s = *s_;
  if (!s.flies || s.pose.kernel || s.joint_material.empty() || s.system.batches.empty()) return false;
  return s.memory.joints_came || s.memory.h < s.h || s.memory.h > s.h;
}

// How far a coordinate is above its highest place, below 0: below its lowest [m, rad].
double Interactions::State::beyond_limits(const cairn_batch& b, int lane, double along) const {
  const double* params = laws->entry(entry[std::size_t(system.candidate[b.first + lane])]).params;
  if (!(params[joint_coordinate] > 0)) return 0;
  return std::max(0.0, along - params[joint_highest]) + std::min(0.0, along - params[joint_lowest]);
}

// The same of a coordinate that bore on an end in the last step, on which it is held: it is off on either side.
double Interactions::State::off_limits(const cairn_batch& b, int lane, double along) const {
  const double* params = laws->entry(entry[std::size_t(system.candidate[b.first + lane])]).params;
  const int coordinate = int(params[joint_coordinate]);
  if (coordinate < 1) return 0;
  const bool bare = !(params[joint_effort] > 0 || params[joint_stiffness] > 0 || params[joint_damping] > 0);
  const double bore = bare ? at(b, b.r, lane, coordinate - 1) : 0;
  if (bore < 0) return along - params[joint_highest];
  return bore > 0 ? along - params[joint_lowest] : beyond_limits(b, lane, along);
}

// On a bent way a joint is as far off a flight before the start of the step as it is a flight after it. A velocity of
// its ends against each other, as of bodies that it catches in flight, is for impulses to end: displacements of bodies
// that fly past each other would change their angular momentum.
bool Interactions::State::swings_alike(const cairn_batch& b, int lane) const {
  constexpr double small = 0.5; // as much comes of turns by a radian in a step
  const std::int64_t i = system.candidate[b.first + lane];
  const Anchor& anchor = held[std::size_t(anchor_of[std::size_t(i)])];
  const int blocked = int(laws->entry(entry[i]).params[joint_blocked]);
  const double length = length_of_joint(b, lane, anchor);
  JointPose pose;
  double before[6], straight = 0, bent = 0;
  pose_ahead(b, lane, -2 * (1 - left_of_step) * h, pose);
  const double was = off_limits(b, lane, joint_errors(b, lane, pose, before)),
               is = off_limits(b, lane, b.state[7 * b.count + lane]);
  for (int c = 0; c < b.components; ++c) {
    if (!(blocked >> c & 1)) continue;
    const int error = dim() == 2 && c == 2 ? 3 : c;
    const double after = b.state[(1 + error) * b.count + lane], unit = c < dim() ? 1 : length;
    straight = std::hypot(straight, unit * (after - before[error]));
    bent = std::hypot(bent, unit * (after + before[error]));
  }
  if (std::abs(is) > 0) {
    const double unit = unit_of_coordinate(b, lane, length);
    straight = std::hypot(straight, unit * (is - was));
    bent = std::hypot(bent, unit * (is + was));
  }
  return straight <= small * bent;
}

void Interactions::choose_joints_to_seat(const Bodies& bodies) {
  State& s = *s_;
  s.system.load({bodies.velocity, s.nodes ? &s.nodes->velocity : nullptr});
  s.joint_seats.assign(s.held.size(), 0);
  for (const cairn_batch& b : s.system.batches) {
    if (!law_infos()[b.law].joins || b.mapped_a || b.mapped_b) continue;
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::int64_t i = s.system.candidate[b.first + lane];
      if (s.is_anchored(i) && b.state[lane] > 0)
        s.joint_seats[std::size_t(s.anchor_of[std::size_t(i)])] = s.swings_alike(b, lane);
    }
  }
}

// True for an anchored joint that was selected for correction.
bool Interactions::State::is_seated(const cairn_batch& b, int lane) const {
  const std::int64_t i = system.candidate[b.first + lane];
  return is_anchored(i) && joint_seats[std::size_t(anchor_of[std::size_t(i)])] != 0;
}

void Interactions::joints_seated() { s_->memory.joints_came = false; }

double Interactions::joints_off() const {
  constexpr double digits = 64 * std::numeric_limits<double>::epsilon();
  const State& s = *s_;
  double off = 0, rounding = 0;
  for (const cairn_batch& b : s.system.batches) {
    if (!law_infos()[b.law].joins || b.mapped_a || b.mapped_b) continue;
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::int64_t i = s.system.candidate[b.first + lane];
      if (!(b.state[lane] > 0) || !s.is_seated(b, lane)) continue;
      const Anchor& anchor = s.held[std::size_t(s.anchor_of[std::size_t(i)])];
      const int blocked = int(s.laws->entry(s.entry[i]).params[joint_blocked]);
      const double length = s.length_of_joint(b, lane, anchor);
      for (int c = 0; c < b.components; ++c) {
        if (!(blocked >> c & 1)) continue;
        const int error = s.dim() == 2 && c == 2 ? 4 : 1 + c;
        off = std::max(off, std::abs(b.state[error * b.count + lane]) * (c < s.dim() ? 1 : length));
      }
      const double of_limit = s.off_limits(b, lane, b.state[7 * b.count + lane]);
      off = std::max(off, std::abs(of_limit) * unit_of_coordinate(b, lane, length));
      for (const std::int32_t body : {b.body_a[lane], b.body_b[lane]}) {
        for (int k = 0; k < s.dim(); ++k)
          rounding =
              std::max({rounding, std::abs(s.bodies->position[body][k]), s.h * std::abs(s.bodies->velocity[body][k])});
      }
      rounding = std::max(rounding, length);
    }
  }
  rounding *= digits;
  return off > rounding ? off / rounding : 0;
}

bool Interactions::seat_joints(const Bodies& bodies, Array<double>& velocity) {
  State& s = *s_;
  const int n = s.system.velocities(), d = s.dim();
  const cairn_schedule schedule = s.system.schedule(1);
  JointedProblem step(s.system, schedule, s.free(bodies));
  const auto seated = [&](const cairn_batch& b, int lane) { return s.is_seated(b, lane); };
  const auto off = [&](const cairn_batch& b, int lane) { return s.off_limits(b, lane, b.state[7 * b.count + lane]); };
  if (!step.undo_errors(seated, off)) return false;
  s.system.clear_velocities();
  cairn_add_impulses(&schedule);
  velocity.resize(std::size_t(n) * std::size_t(s.system.bodies));
  double moves = 0, moved = 0;
  for (std::int64_t body = 0; body < s.system.bodies; ++body) {
    const double *x = s.system.record[body].x, *v = bodies.velocity[body], mass = *bodies.mass[body];
    std::copy_n(x, n, &velocity[std::size_t(n) * std::size_t(body)]);
    const double* inertia = bodies.inertia[body];
    double heaviest = 0;
    for (int k = 0; k < 2 * d - 3; ++k) heaviest = std::max(heaviest, inertia[k]);
    for (int k = 0; k < n; ++k) {
      const double resists = k < d ? mass : heaviest;
      if (!(resists < std::numeric_limits<double>::infinity())) continue;
      moves += resists * v[k] * v[k];
      moved += resists * x[k] * x[k];
    }
  }
  return std::isfinite(moved) && moved <= moves;
}

} // namespace cairn
