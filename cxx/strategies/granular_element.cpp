// The granular element method (Kishino 1988): the step of NSCD, where springs at the contacts are treated implicitly.
#include "cairn/rows/pose.h"
#include "nscd/nscd.hpp"

namespace cairn {

std::unique_ptr<Strategy> make_granular_element() {
  auto made = std::make_unique<Nscd>();
  made->accepted = {"theta"};
  made->settings.integrator.parameter("theta", 0) = 1;
  made->settings.pose.kernel = cairn_pose_granular_element;
  return made;
}

} // namespace cairn
