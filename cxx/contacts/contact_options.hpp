// How a strategy wants its contacts assembled.
#pragma once
#include <array>
#include <limits>
#include <optional>

#include "cairn/core.h"

namespace cairn {

// The condition that a strategy poses at contacts, a row of poses.def; null: Moreau's, as laws prepare it.
struct ContactPose {
  cairn_pose* kernel = nullptr;
  double params[2] = {0, 0};
};

// LawConfiguration in which laws hold: that of detection, as in LMGC90, or the midpoint of the motion from this
// detection to the next, which is of second order on curved surfaces (see midpoint_motion.hpp).
enum class LawConfiguration { detection, midpoint };

// Where impulses act: in the middle of the gap, or on each body's own surface, as in LMGC90.
enum class ImpulsePoint { middle_of_gap, own_surface };

struct ContactOptions {
  LawConfiguration configuration = LawConfiguration::midpoint;
  ImpulsePoint impulse_point = ImpulsePoint::middle_of_gap;
  std::optional<double> joint_theta; // share of the end of the step in forces of springs of joints; that of the step
  double time_left = 0;              // share of the step that is left when contacts are detected
  double mesh_correction = 1;        // share of the drift of joints and bonds on meshes that a step corrects
  double overlap_limit = std::numeric_limits<double>::infinity(); // over the size of the smaller body, see OverlapLimit
  std::array<double, 3> origin{}; // of the scene: places that were given had its size, and their rounding [m]
  ContactPose pose;
};

} // namespace cairn
