// Forward increments with Lagrange multipliers (Carpenter, Taylor & Katona 1991): the step of NSCD, explicit in bodies
// that deform, where contact is imposed on the gap at the end of the step.
#include "nscd/nscd.hpp"

namespace cairn {

std::unique_ptr<Strategy> make_carpenter() {
  auto made = std::make_unique<Nscd>();
  made->settings.theta = 1;
  made->settings.pose.kernel = cairn_pose_carpenter;
  made->settings.explicit_bulk = true;
  return made;
}

} // namespace cairn
