// Forward increments with Lagrange multipliers (Carpenter, Taylor & Katona 1991): the step of NSCD, explicit in the
// bulk, where contact is imposed on the gap at the end of the step.
#include "cairn/rows/pose.h"
#include "nscd/nscd.hpp"

namespace cairn {

std::unique_ptr<Strategy> make_carpenter() {
  auto made = std::make_unique<Nscd>();
  made->settings.pose.kernel = cairn_pose_carpenter;
  made->accepted = {"central_difference", "beta_scheme"};
  made->settings.integrator.name = made->accepted[0];
  return made;
}

} // namespace cairn
