// How the solution of the contacts of a step ended.
#pragma once
#include <cstdint>
#include <limits>
#include <string>

namespace cairn {

enum class SolveStatus { converged, iteration_limit, diverged, newton_limit };

struct SolveReport {
  SolveStatus status = SolveStatus::converged;
  std::int64_t contacts = 0; // candidates that were solved
  int iterations = 0;
  int checks = 0;                  // evaluations of the error
  double error = 0;                // natural map, energy norm, relative
  double worst_error = 0;          // of one contact, on its own scale, at least a millionth of the mean: 0 to 1
  std::int64_t worst_contact = -1; // its place in the candidates
  double light_error = 0; // where masses differ: speeds that break the law, on the scale of lighter bodies (LightError)
  std::int64_t light_contact = -1;                                  // where it is largest, its place in the candidates
  double velocity_error = std::numeric_limits<double>::quiet_NaN(); // estimated, see VelocityError; NaN: not asked for
  double penetration = 0;                                           // deepest overlap / size of the smaller body
  double drift = 0;          // the deepest beyond the limit above which it is taken back / size of the smaller body
  double cone_distance = 0;  // distance of impulses outside the cone / impulse
  double energy_created = 0; // energy from nothing by contacts / energy in play, see created_share; once committed
  double joint_error = 0;    // largest error of a joint at the next detection / its length; a turn [rad]: see JointMiss
  double joint_gap = 0;      // largest distance there of points that a joint holds together [m]
  bool has_joint_error = false;    // the error of joints was measured
  std::int64_t joint_contact = -1; // where joint_error is, its place in the candidates; -1: over ranks, unknown
  std::string joint_hint;          // what to do about it; empty: it is as small as was asked
  std::string hint;                // empty when converged
  const char* solver = "nlgs";     // that gave the answer
};

// Resistance of a body against turns by the loads of its joints [N m]: xx yy zz xy xz yz, in the plane one number.
struct JointLoad {
  std::int32_t body;
  double stiffness[6];
};
// Implicit share of a swinging stiffness in a step, from the square of step times rate: 0 for a small square; for a
// large one such that the explicit rest of the square is 2 (explicit steps are stable below 4).
inline double implicit_share(double square) { return square > 1 ? 0.5 * (1 - 1 / square) : 0; }

} // namespace cairn
