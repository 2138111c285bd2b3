// The largest velocity that is taken.
#pragma once

namespace cairn {

// Energies take the squares of velocities, which are numbers up to here [m/s, rad/s].
inline constexpr double fastest = 0x1p500;
inline constexpr const char* too_fast =
    "energies take its square, which is too large for a number: give less than 3e150";

} // namespace cairn
