// Seats of joints: a step holds joints where the next one detects contacts, in the middle of its flight. Where a joint
// comes in, or the step length changes, bodies that turn about it fly past that place by r (w h)^2/8 on straight paths.
// Impulses would undo that, an eighth too strong in one step and too weak in the next, so bodies are moved there.
#include "joint_projection.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "../solvers/sweeps/batch.hpp"
#include "../solvers/sweeps/jointed_problem.hpp"

namespace cairn {
namespace {

// 1 of a coordinate in metres; the length of the joint, of an angle.
double unit_of_coordinate(const cairn_batch& b, int lane, double length) {
  return b.params[joint_coordinate * b.count + lane] > 1 ? length : 1;
}

} // namespace

bool JointProjection::is_due() const {
  if (!frames_.joints_at_midpoint() || system_.batches.empty()) return false;
  return memory_.joints_came || memory_.h < in_.h || memory_.h > in_.h;
}

// Distance of a coordinate from its limits [m, rad]; if it bore on one in the last step, it is off on either side.
double JointProjection::off_limits(const cairn_batch& b, int lane, double along) const {
  const double* params = classes_.rule(system_.candidate[b.first + lane]).params;
  const int coordinate = int(params[joint_coordinate]);
  if (coordinate < 1) return 0;
  const bool bare = !(params[joint_effort] > 0 || params[joint_stiffness] > 0 || params[joint_damping] > 0);
  const double bore = bare ? at(b, b.r, lane, coordinate - 1) : 0;
  if (bore < 0) return along - params[joint_highest];
  return bore > 0 ? along - params[joint_lowest] : drift_.beyond_limits(b, lane, along);
}

// On a bent way a joint is as far off a flight before the start of the step as it is a flight after it. A velocity of
// its ends against each other, as of bodies that it catches in flight, is for impulses to end: displacements of bodies
// that fly past each other would change their angular momentum.
bool JointProjection::swings_alike(const cairn_batch& b, int lane) const {
  constexpr double small = 0.5; // as much comes of turns by a radian in a step
  const std::int64_t i = system_.candidate[b.first + lane];
  const Anchor& anchor = anchors_.of(i);
  const int blocked = int(classes_.rule(i).params[joint_blocked]);
  const double length = drift_.length_of_joint(b, lane, anchor);
  JointPose pose;
  double before[6], straight = 0, bent = 0;
  drift_.pose_ahead(b, lane, -2 * (1 - in_.options.time_left) * in_.h, pose);
  const double was = off_limits(b, lane, frames_.errors(b, lane, pose, before)),
               is = off_limits(b, lane, b.state[7 * b.count + lane]);
  for (int c = 0; c < b.components; ++c) {
    if (!(blocked >> c & 1)) continue;
    const int error = in_.dim() == 2 && c == 2 ? 3 : c;
    const double after = b.state[(1 + error) * b.count + lane], unit = c < in_.dim() ? 1 : length;
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

void JointProjection::choose(const Bodies& bodies) {
  system_.load({bodies.velocity, in_.nodes ? &in_.nodes->velocity : nullptr});
  chosen_.assign(anchors_.all_held().size(), 0);
  for (const cairn_batch& b : system_.batches) {
    if (!law_infos()[b.law].joins || b.mapped_a || b.mapped_b) continue;
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::int64_t i = system_.candidate[b.first + lane];
      if (anchors_.is_anchored(i) && b.state[lane] > 0)
        chosen_[std::size_t(anchors_.number_of(i))] = swings_alike(b, lane);
    }
  }
}

// True for an anchored joint that was selected for correction.
bool JointProjection::is_chosen(const cairn_batch& b, int lane) const {
  const std::int64_t i = system_.candidate[b.first + lane];
  return anchors_.is_anchored(i) && chosen_[std::size_t(anchors_.number_of(i))] != 0;
}

double JointProjection::violation() const {
  constexpr double digits = 64 * std::numeric_limits<double>::epsilon();
  double off = 0, rounding = 0;
  for (const cairn_batch& b : system_.batches) {
    if (!law_infos()[b.law].joins || b.mapped_a || b.mapped_b) continue;
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::int64_t i = system_.candidate[b.first + lane];
      if (!(b.state[lane] > 0) || !is_chosen(b, lane)) continue;
      const Anchor& anchor = anchors_.of(i);
      const int blocked = int(classes_.rule(i).params[joint_blocked]);
      const double length = drift_.length_of_joint(b, lane, anchor);
      for (int c = 0; c < b.components; ++c) {
        if (!(blocked >> c & 1)) continue;
        const int error = in_.dim() == 2 && c == 2 ? 4 : 1 + c;
        off = std::max(off, std::abs(b.state[error * b.count + lane]) * (c < in_.dim() ? 1 : length));
      }
      const double of_limit = off_limits(b, lane, b.state[7 * b.count + lane]);
      off = std::max(off, std::abs(of_limit) * unit_of_coordinate(b, lane, length));
      for (const std::int32_t body : {b.body_a[lane], b.body_b[lane]}) {
        for (int k = 0; k < in_.dim(); ++k)
          rounding = std::max(
              {rounding, std::abs(in_.bodies->position[body][k]), in_.h * std::abs(in_.bodies->velocity[body][k])});
      }
      rounding = std::max(rounding, length);
    }
  }
  rounding *= digits;
  return off > rounding ? off / rounding : 0;
}

bool JointProjection::find_velocities(const Bodies& bodies, Array<double>& velocity) {
  const int n = system_.velocities(), d = in_.dim();
  const cairn_schedule schedule = system_.schedule(1);
  JointedProblem step(system_, schedule, in_.free(bodies));
  const auto chosen = [&](const cairn_batch& b, int lane) { return is_chosen(b, lane); };
  const auto off = [&](const cairn_batch& b, int lane) { return off_limits(b, lane, b.state[7 * b.count + lane]); };
  if (!step.undo_errors(chosen, off)) return false;
  system_.clear_velocities();
  cairn_add_impulses(&schedule);
  velocity.resize(std::size_t(n) * std::size_t(system_.bodies));
  double moves = 0, moved = 0;
  for (std::int64_t body = 0; body < system_.bodies; ++body) {
    const double *x = system_.record[body].x, *v = bodies.velocity[body], mass = *bodies.mass[body];
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
