// Batches of contacts of one rule: sizes, and where the numbers of a contact stand in them.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "contact_system.hpp"

namespace cairn {

// Contacts of a batch share the first cache; its size is no power of two, so that its columns do not fall on the same
// lines of it.
inline constexpr int batch_size = 104;
// Spin of a mapped side about axis k of a contact, per velocity of its node j along direction l; for batches with
// contacts that turn [1/m].
inline double& spin_of(const cairn_batch& b, int dim, int side, int lane, int j, int l, int k) {
  return (side ? b.spin_b : b.spin_a)[((k * 4 + j) * dim + l) * b.count + lane];
}
// A gap over the effective radius that positions in doubles cannot tell from none.
inline constexpr double touch = 1.0 / (1 << 30);
// A gap between places so far from the origin is known to this.
inline double rounding_of_gaps(double distance) { return 8 * std::numeric_limits<double>::epsilon() * distance; }
// Contacts of a task: their bodies share the second cache, their batches are not short, and small scenes too have tasks
// for threads.
inline constexpr int smallest_tile = 600, largest_tile = 2000, tiles = 24;
// A body that moves with more contacts than this is a hub.
inline constexpr int hub_degree = 32;
// A mesh with more contacts than this is swept contact by contact: all of them see each other, and lanes of a colour
// would be empty.
inline constexpr int mesh_hub_degree = 8;

// Component k of a field of a batch, packed or not (see cairn/core.h).
inline double& at(const cairn_batch& b, double* field, int lane, int k) {
  return b.pack ? field[lane / 8 * 8 * b.pack + 8 * k + lane % 8] : field[k * b.count + lane];
}
// Where the lines of a batch's pack stand, from the frame on.
inline void place_pack(cairn_batch& b, int dim) {
  b.pack = 2 * dim + 4;
  b.lever_a = b.frame + 8 * dim;
  b.lever_b = b.frame + 8 * (dim + 1);
  b.bias = b.frame + 8 * (dim + 2);
  b.params = b.frame + 8 * (dim + 3);
  b.r = b.frame + 8 * (dim + 4);
}
// Two round bodies that move under a cone: a pack, if the law has a bias along the normal and nothing else.
inline bool packable(const cairn_batch& b) {
  return b.block == 0 && is_radial(b.side_a) && is_radial(b.side_b) && b.moves_a && b.moves_b && b.hub == 0;
}
// A tangent that depends on the normal alone, without a branch and with all digits (Duff et al. 2017).
inline void tangent_of(const double n[3], double t[3]) {
  const double sign = std::copysign(1.0, n[2]), a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
  t[0] = 1 + sign * n[0] * n[0] * a;
  t[1] = sign * b;
  t[2] = -sign * n[0];
}
// Gain of the gap of two round bodies in a step, over its length, beyond their velocity along the normal [m/s]: with
// centres at a distance and relative velocity v. A root instead of a square: bodies that pass in a step stay apart,
// and near bodies never lose more than the distance.
inline double flight_of_round(const double* v, const double* normal, int dim, double distance, double h) {
  const double reach = h / distance;
  double along = 0, square = 0;
  for (int k = 0; k < dim; ++k) along += v[k] * normal[k];
  for (int k = 0; k < dim; ++k) {
    const double across = (v[k] - along * normal[k]) * reach;
    square += across * across;
  }
  if (!(square > 0) || !(distance > 0)) return 0;
  square = std::min(square, 1.0);
  return square / (reach * (1 + std::sqrt(1 - square)));
}
// Rows n, t and, in 3D, s of a contact.
void axes_of(const cairn_batch& b, int dim, int lane, double axes[3][3]);
// Lanes that hold no contact are handed to laws as the last contact again: a law may divide by its parameters.
inline void repeat_last(const cairn_batch& b, double* column, int columns) {
  for (int k = 0; k < columns; ++k) {
    double* lane = column + std::ptrdiff_t(k) * b.count;
    std::fill(lane + b.contacts, lane + b.count, lane[b.contacts - 1]);
  }
}

// Parameters of joints that whoever measures their frames asks for: see joint.f90.
inline constexpr int joint_blocked = 0, joint_coordinate = 1, joint_axis = 2, joint_lowest = 5, joint_highest = 6,
                     joint_effort = 8, joint_spans = 10, joint_stiffness = 11, joint_damping = 12, joint_pulley = 14,
                     joint_far = 15;
inline constexpr int rope_numbers = 26; // see cairn_batch

} // namespace cairn
