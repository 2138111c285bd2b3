// Wendland's C2 function (Wendland 1995), as kernels of the liquid have it.
#pragma once

namespace cairn {

// 1 at the centre, 0 from twice the length of the kernel on; q: distance over that length.
inline double wendland(double q) {
  if (q >= 2) return 0;
  const double left = 1 - 0.5 * q;
  return left * left * left * left * (2 * q + 1);
}

} // namespace cairn
