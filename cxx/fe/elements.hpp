// Finite elements: rows of elements.def with their kernels.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "cairn/core.h"

namespace cairn {

struct ElementInfo {
  const char *name, *cell; // file of the kernel; cell type of a mesh
  int dim, nodes, points, bulk_points, order;
  cairn_element_rule *rule, *bulk_rule;
  cairn_element_shape* shape;
};
std::span<const ElementInfo> element_infos();

// Shape functions of an element at the points of its rule, and their gradients in its middle.
struct ElementShape {
  std::vector<double> value, gradient, weight, middle;
  explicit ElementShape(const ElementInfo& e)
      : value(std::size_t(e.nodes * e.points)), gradient(value.size() * e.dim), weight(e.points),
        middle(std::size_t(e.dim * e.nodes)) {
    std::vector<double> xi(std::size_t(e.dim * e.points)), mean(e.dim, 0.0), unused(e.nodes);
    e.rule(xi.data(), weight.data());
    for (int p = 0; p < e.points; ++p) {
      e.shape(&xi[p * e.dim], &value[p * e.nodes], &gradient[p * e.dim * e.nodes]);
      for (int k = 0; k < e.dim; ++k) mean[k] += xi[p * e.dim + k] / e.points;
    }
    e.shape(mean.data(), unused.data(), middle.data());
  }
};

// Edges (2D) or faces (3D) of a cell, anticlockwise from outside, the body left of an edge: -1 in the last place of a
// triangle, in the last two of an edge. Those of second order are cut along their middle nodes into flat ones.
using CellSide = std::array<std::int32_t, 4>;
const std::vector<CellSide>& sides_of(const ElementInfo& e);
// A whole side, its nodes in the order of its shape functions (corners, midside nodes, centre), and the pieces it is
// cut into.
struct WholeSide {
  std::vector<std::int32_t> node;
  std::vector<CellSide> pieces;
};
std::vector<WholeSide> whole_sides_of(const ElementInfo& e);

// Masses of the nodes of a cell of second order: the diagonal of its consistent mass, scaled to the mass of the cell
// (Hinton, Rock & Zienkiewicz 1976). mass (dim nodes, dim nodes), node_mass (nodes).
void lump_by_diagonal(const ElementInfo& e, const double* mass, double* node_mass);

// Consistent mass (2 nodes, 2 nodes) of a flat cell that goes round the axis y, x (2, nodes) [m].
void ring_mass(const ElementInfo& e, const double* x, double density, double* mass);

} // namespace cairn
