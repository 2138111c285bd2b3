// Contact sides and lumped masses of elements.
#include "elements.hpp"

#include <algorithm>
#include <numbers>
#include <string>

#include "../base/call.hpp"
#include "cairn/rows/element.h"

namespace cairn {
namespace {

using Sides = std::vector<CellSide>;

Sides edges_of_polygon(std::int32_t corners, bool middles) {
  Sides out;
  for (std::int32_t k = 0; k < corners; ++k) {
    const std::int32_t next = (k + 1) % corners, middle = corners + k;
    if (!middles) {
      out.push_back({k, next, -1, -1});
    } else {
      out.push_back({k, middle, -1, -1});
      out.push_back({middle, next, -1, -1});
    }
  }
  return out;
}

const Sides tetrahedron = {{0, 2, 1, -1}, {0, 1, 3, -1}, {1, 2, 3, -1}, {0, 3, 2, -1}};
const Sides hexahedron = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};

// Between two corners the node in the middle of their edge.
std::int32_t middle_of(std::int32_t corners, std::int32_t a, std::int32_t b) {
  static const std::int32_t tet[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  static const std::int32_t hex[12][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                          {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
  const auto* edge = corners == 4 ? tet : hex;
  for (std::int32_t k = 0; k < (corners == 4 ? 6 : 12); ++k)
    if ((edge[k][0] == a && edge[k][1] == b) || (edge[k][0] == b && edge[k][1] == a)) return corners + k;
  return -1;
}

// Cuts each face into a piece at each corner, with the midside nodes beside it, and a remainder between the midside
// nodes; into pieces about the middle of the face if it has a node.
Sides cut(const Sides& faces, std::int32_t corners, const std::vector<std::int32_t>& face_middle) {
  Sides out;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const std::int32_t n = faces[f][3] < 0 ? 3 : 4;
    CellSide middle{-1, -1, -1, -1};
    for (std::int32_t k = 0; k < n; ++k) middle[k] = middle_of(corners, faces[f][k], faces[f][(k + 1) % n]);
    for (std::int32_t k = 0; k < n; ++k) {
      const std::int32_t before = middle[(k + n - 1) % n];
      if (face_middle.empty())
        out.push_back({faces[f][k], middle[k], before, -1});
      else
        out.push_back({faces[f][k], middle[k], face_middle[f], before});
    }
    if (face_middle.empty()) out.push_back(middle);
  }
  return out;
}

} // namespace

std::span<const ElementInfo> element_infos() {
  static constexpr ElementInfo rows[] = {
#define CAIRN_ELEMENT(name, cell, dim, nodes, points, bulk_points, order)                                              \
  {#name,                                                                                                              \
   #cell,                                                                                                              \
   dim,                                                                                                                \
   nodes,                                                                                                              \
   points,                                                                                                             \
   bulk_points,                                                                                                        \
   order,                                                                                                              \
   cairn_element_##name##_rule,                                                                                        \
   cairn_element_##name##_bulk_rule,                                                                                   \
   cairn_element_##name##_shape},
#include "../../core_f90/elements/elements.def"
#undef CAIRN_ELEMENT
  };
  return rows;
}

const std::vector<CellSide>& sides_of(const ElementInfo& e) {
  static const Sides triangle = edges_of_polygon(3, false), quad = edges_of_polygon(4, false),
                     triangle6 = edges_of_polygon(3, true), quad8 = edges_of_polygon(4, true),
                     tetra10 = cut(tetrahedron, 4, {}), hexahedron20 = cut(hexahedron, 8, {}),
                     hexahedron27 = cut(hexahedron, 8, {24, 25, 22, 21, 23, 20});
  const std::string cell = e.cell;
  const std::pair<const char*, const Sides*> known[] = {{"triangle", &triangle},
                                                        {"quad", &quad},
                                                        {"triangle6", &triangle6},
                                                        {"quad8", &quad8},
                                                        {"quad9", &quad8},
                                                        {"tetra", &tetrahedron},
                                                        {"tetra10", &tetra10},
                                                        {"hexahedron", &hexahedron},
                                                        {"hexahedron20", &hexahedron20},
                                                        {"hexahedron27", &hexahedron27}};
  for (const auto& [name, sides] : known)
    if (cell == name) return *sides;
  throw Error("the sides of " + cell + " cells are not known: give those that touch yourself");
}

// The first pieces of a side of second order begin at its corners, each with the middle of the edge behind it next.
std::vector<WholeSide> whole_sides_of(const ElementInfo& e) {
  const Sides& pieces = sides_of(e);
  const bool parabolic = e.order > 1, about_middle = parabolic && pieces[0][3] >= 0; // quadrilaterals of nine nodes
  const bool quadrilaterals = about_middle || (parabolic && e.dim == 3 && pieces[4][3] >= 0);
  const std::size_t corners = e.dim == 2 ? 2 : (quadrilaterals ? 4 : 3);
  const std::size_t each = !parabolic ? 1 : (e.dim == 2 || about_middle ? corners : corners + 1);
  std::vector<WholeSide> out;
  for (auto first = pieces.begin(); first != pieces.end(); first += std::ptrdiff_t(each)) {
    WholeSide side{{}, {first, first + std::ptrdiff_t(each)}};
    const Sides& of = side.pieces;
    if (!parabolic) {
      side.node.assign(of[0].begin(), std::find(of[0].begin(), of[0].end(), -1));
    } else if (e.dim == 2) {
      side.node = {of[0][0], of[1][1], of[0][1]};
    } else {
      for (std::size_t k = 0; k < corners; ++k) side.node.push_back(of[k][0]);
      for (std::size_t k = 0; k < corners; ++k) side.node.push_back(of[k][1]);
      if (about_middle) side.node.push_back(of[0][2]);
    }
    out.push_back(std::move(side));
  }
  return out;
}

void lump_by_diagonal(const ElementInfo& e, const double* mass, double* node_mass) {
  const int dofs = e.dim * e.nodes;
  double total = 0, diagonal = 0;
  for (int j = 0; j < e.nodes; ++j) {
    for (int i = 0; i < e.nodes; ++i) total += mass[e.dim * j * dofs + e.dim * i];
    diagonal += mass[e.dim * j * (dofs + 1)];
  }
  for (int j = 0; j < e.nodes; ++j) node_mass[j] = mass[e.dim * j * (dofs + 1)] * (total / diagonal);
}

void ring_mass(const ElementInfo& e, const double* x, double density, double* mass) {
  const ElementShape shape(e);
  const int dofs = 2 * e.nodes;
  std::fill_n(mass, dofs * dofs, 0.0);
  for (int p = 0; p < e.points; ++p) {
    double j[4] = {0, 0, 0, 0}, radius = 0;
    for (int a = 0; a < e.nodes; ++a) {
      const double* d = &shape.gradient[std::size_t((p * e.nodes + a) * 2)];
      for (int k = 0; k < 2; ++k) j[k] += d[0] * x[2 * a + k], j[2 + k] += d[1] * x[2 * a + k];
      radius += shape.value[std::size_t(p * e.nodes + a)] * x[2 * a];
    }
    const double weight = shape.weight[std::size_t(p)] * (j[0] * j[3] - j[1] * j[2]) * 2 * std::numbers::pi * radius;
    for (int b = 0; b < e.nodes; ++b)
      for (int a = 0; a < e.nodes; ++a) {
        const double m =
            density * weight * shape.value[std::size_t(p * e.nodes + a)] * shape.value[std::size_t(p * e.nodes + b)];
        for (int k = 0; k < 2; ++k) mass[(2 * b + k) * dofs + 2 * a + k] += m;
      }
  }
}

} // namespace cairn
