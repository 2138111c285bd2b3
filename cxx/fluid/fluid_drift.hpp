// The way by which particles drift to an even spread.
#pragma once
#include <algorithm>

namespace cairn {

// A way [m] of a drift within a step, at most a tenth of a spacing.
inline double drift_within(double way, double spacing) { return std::clamp(way, -0.1 * spacing, 0.1 * spacing); }

} // namespace cairn
