// The sides of a mesh as mortars integrate over them: whole sides of its cells, with their shape functions, cut into
// flat pieces, on which detection sees points of other meshes.
#pragma once
#include <cstdint>
#include <vector>

namespace cairn {

struct MeshModel;

inline constexpr int most_side_nodes = 9;

struct MortarPiece {
  int corners = 0; // 2 in the plane, in space 3 or 4, anticlockwise from outside
  std::int32_t node[4] = {-1, -1, -1, -1};
  double at[4][2] = {}; // where each corner is on the whole side
  std::int32_t whole = -1;
};

struct MortarWhole {
  int nodes = 0; // corners, then middles of edges, then the middle: 2 or 3 in 2D; 3, 4, 6, 8 or 9 in 3D
  std::int32_t node[most_side_nodes];
  std::int32_t first_piece = 0, end_piece = 0;
};

struct MortarSurface {
  std::vector<MortarPiece> piece; // those of a whole side one after the other
  std::vector<MortarWhole> whole;
  std::vector<std::int32_t> piece_of_side;           // of each side that is a contactor
  std::vector<std::int32_t> pieces_start, pieces_at; // at each node of the mesh
  std::vector<std::int32_t> wholes_start, wholes_at; // at each node of the mesh

  MortarSurface() = default;
  explicit MortarSurface(const MeshModel& model);
};

// Where node k of a whole side is on it.
const double* place_on_side(int dim, int nodes, int k);

// Shape functions of a whole side at a place on it: edges from -1 to 1, triangles from 0 to 1, quadrilaterals from -1
// to 1 along each axis.
void side_shape(int dim, int nodes, const double* at, double* value);
// Their slopes along both directions of a face (2, nodes), or along an edge (nodes).
void side_slopes(int dim, int nodes, const double* at, double* slope);

// Basis of the same function space, nowhere far below zero and with positive integrals, as dual functions need: u = sum
// of value_k w_k. For a corner w is u, for the middle of an edge 2 u - (u_1 + u_2) / 2 of its ends: Bernstein
// polynomials, and similar ones for eight nodes. First-order sides have the functions of side_shape.
void side_basis(int dim, int nodes, const double* at, double* value);

// w of node k of a whole side from u of its nodes: places in the side and weights, whose sum is 1; how many.
int basis_value(int dim, int nodes, int k, int* place, double* weight);

} // namespace cairn
