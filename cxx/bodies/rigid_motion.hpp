// Rigid motions of the nodes of a mesh, by its mass: the momentum that they have, the velocities that have a momentum,
// and the rotation that is nearest to how they stand.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "../soe/soe.hpp"

namespace cairn {

using Rotation = std::array<double, 9>; // by rows, body to space; in 2D of the plane x y

inline constexpr Rotation upright = {1, 0, 0, 0, 1, 0, 0, 0, 1};
Rotation rotation_of(int dim, const double* stored); // of an angle, or a quaternion
void stored_rotation(int dim, const Rotation& r, double* stored);
Rotation times(const Rotation& a, const Rotation& b);
Rotation transposed(const Rotation& a);
void turn(int dim, const Rotation& r, std::span<const double> from, double* to); // (dim, n)

// Mass of each node in the momentum along the first axis (nodes) [kg]. mass: lower triangle (dim nodes).
std::vector<double> node_weights(int dim, const SparseMatrix& mass);
// mean (dim) by weights of places (dim, n).
std::array<double, 3> centre_of(int dim, std::span<const double> weight, std::span<const double> x);

// Motion of nodes at x with velocities v: mass [kg], kinetic energy [J], centre of mass [m], momentum, then angular
// momentum about the centre of mass [N s, N m s].
struct NodesMotion {
  double mass = 0, kinetic = 0;
  std::array<double, 3> centre{};
  std::array<double, 6> momentum{};
};
NodesMotion motion_of_nodes(int dim, const SparseMatrix& mass, std::span<const double> x, std::span<const double> v);

// Velocities (dim, n) of a rigid motion of nodes at `arm` (dim, n) from a point, that has a momentum (3 | 6), the
// angular one about that point. Throws Error where no rigid motion has it.
std::vector<double> velocities_with_momentum(int dim, const SparseMatrix& mass, std::span<const double> arm,
                                             std::span<const double> momentum);
// Forces (dim, n) of nodes at x with which a rigid motion sets in, whose sum and moment about the centre of mass are
// these (3 | 6) [N, N m].
std::vector<double> forces_of_wrench(int dim, const SparseMatrix& mass, std::span<const double> x,
                                     std::span<const double> wrench);

// The rotation that brings `own` (dim, n) nearest to x, by weights (Wahba 1965, Davenport's solution).
Rotation nearest_turn(int dim, std::span<const double> own, std::span<const double> x, std::span<const double> weight);

} // namespace cairn
