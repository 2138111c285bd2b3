// Position errors of joints at the next detection, by the velocities of a solution.
#pragma once
#include <cstdint>

namespace cairn {

struct JointMiss {
  double gap = 0;            // largest error along blocked directions [m]
  double error = 0;          // the largest, over the length of its joint; a turn [rad]
  std::int64_t contact = -1; // where that is, its place in the candidates; -1: nothing was measured
  double swing = 0;          // largest square of step times rate at which tension swings a body about its joint
  bool small = true;         // against how fast the bodies of any joint move against each other, or rounding
};

} // namespace cairn
