// Periodic cell, possibly sheared (Lees & Edwards 1972).
#pragma once
#include <cstdint>

namespace cairn {

struct Cell {
  bool periodic[3] = {false, false, false};
  // columns are the cell vectors, upper triangular: x, then y (may lean along x), then z
  double vectors[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0};
  double corner[3] = {0, 0, 0};
  double velocity_gradient[9] = {0, 0, 0, 0, 0,
                                 0, 0, 0, 0}; // rate of the cell vectors per cell vector; an image moves with it
  bool any() const { return periodic[0] || periodic[1] || periodic[2]; }
  // Components of the velocity gradient that follow the stress (see solvers/sweeps/moving_cell.hpp), the pressure of
  // the surroundings on each [Pa], and the stress of the last step, compression positive.
  bool follows[9] = {};
  double pressure[9] = {}, stress[9] = {};
  double mass = 0;  // inertia of the cell [kg]
  double depth = 1; // thickness in 2D [m]
  bool moves() const {
    for (const bool one : follows)
      if (one) return true;
    return false;
  }
  double volume(int dim) const { return vectors[0] * vectors[4] * (dim == 2 ? depth : vectors[8]); }
};

// A periodic image as one number: which lattice point B is moved by, seen from A; each index in -511..511.
constexpr std::int32_t encode_image(int ix, int iy, int iz) {
  return (ix + 512) + 1024 * ((iy + 512) + 1024 * (iz + 512));
}
constexpr std::int32_t own_image = encode_image(0, 0, 0); // B where it is
constexpr void decode_image(std::int32_t image, int index[3]) {
  for (int k = 0; k < 3; ++k) index[k] = ((image >> (10 * k)) & 1023) - 512;
}
// The same contact seen from B.
constexpr std::int32_t opposite_image(std::int32_t image) { return 2 * own_image - image; }

// The same contact after A and B were moved by whole cell vectors (position += vectors * moved), as when bodies that
// left the cell are brought back.
constexpr std::int32_t image_after_move(std::int32_t image, const int moved_a[3], const int moved_b[3]) {
  int index[3] = {0, 0, 0};
  decode_image(image, index);
  return encode_image(index[0] + moved_a[0] - moved_b[0], index[1] + moved_a[1] - moved_b[1],
                      index[2] + moved_a[2] - moved_b[2]);
}
// The same contact after cell vector k lost `cells` times vector i, i < k: the same lattice, leaning less.
constexpr std::int32_t image_after_lean(std::int32_t image, int k, int i, int cells) {
  int index[3] = {0, 0, 0};
  decode_image(image, index);
  index[i] += cells * index[k];
  return encode_image(index[0], index[1], index[2]);
}

// Shift of the position of B [m]: the cell vectors times the indices of the image.
constexpr void image_shift(const Cell& cell, std::int32_t image, double shift[3]) {
  int index[3] = {0, 0, 0};
  decode_image(image, index);
  for (int i = 0; i < 3; ++i) {
    shift[i] = 0;
    for (int k = 0; k < 3; ++k)
      if (index[k] != 0) shift[i] += cell.vectors[i + 3 * k] * index[k];
  }
}

// Jump of the velocity of B [m/s]: its image moves with the cell.
constexpr void image_velocity(const Cell& cell, std::int32_t image, double jump[3]) {
  double shift[3] = {0, 0, 0};
  image_shift(cell, image, shift);
  for (int i = 0; i < 3; ++i) {
    jump[i] = 0;
    for (int k = 0; k < 3; ++k) jump[i] += cell.velocity_gradient[i + 3 * k] * shift[k];
  }
}

} // namespace cairn
