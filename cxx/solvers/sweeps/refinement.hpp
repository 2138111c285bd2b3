// Result of refining velocities, whose accuracy the error of contacts hardly tells.
#pragma once
#include <limits>

namespace cairn {

struct Refinement {
  double change = std::numeric_limits<double>::quiet_NaN(); // the last, over the speed of all; NaN: none was made
  bool known = false;                                       // it was small enough, and each smaller than the one before
};

} // namespace cairn
