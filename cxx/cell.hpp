// Periodic cell, possibly sheared (Lees & Edwards 1972).
#pragma once

namespace cairn {

struct Cell {
  bool periodic[3] = {false, false, false};
  // columns are the cell vectors, upper triangular: x, then y (may lean along x), then z
  double vectors[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0};
  double corner[3] = {0, 0, 0};
  double velocity_gradient[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0}; // rate of the cell vectors per cell vector; an image moves with it
  bool any() const { return periodic[0] || periodic[1] || periodic[2]; }
};

} // namespace cairn
