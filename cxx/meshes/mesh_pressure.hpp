// Pressure on sides of a body that deforms, which follows their normals: forces of its nodes, and how they change.
#pragma once
#include <cstdint>
#include <vector>

namespace cairn {

struct SparseMatrix;

// Sides of equal shape under equal pressure; 2D: two nodes, or three with the middle last; 3D: three, four, six, eight
// or nine, in the order of triangle6, quad8 and quad9.
struct PressedSides {
  int nodes = 2;
  std::vector<std::int32_t> node;  // (nodes, sides)
  bool ring = false;               // the body goes round the axis x = 0 of `axis`
  double thickness = 1, axis = 0;  // across the plane [m]; of the axis, relative to the origin of the scene
  double begin = 0, end = 0;       // pressure at both ends of the step [Pa]
  std::vector<std::int64_t> place; // of each pair of dofs of a side in a lower triangle; found once

  // Forces of a pressure of 1 Pa at places (dim, nodes) [m], times a factor, to `force` (dofs) [N]; to `values` of the
  // lower triangle, where they are asked for, `slope` times the symmetric part of their derivative.
  void press(int dim, const double* x, double factor, double* force, const SparseMatrix& pattern, double slope,
             double* values);
};

} // namespace cairn
