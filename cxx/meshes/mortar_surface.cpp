#include "mortar_surface.hpp"

#include <algorithm>
#include <array>
#include <map>

#include "../base/call.hpp"
#include "cairn/core.h"
#include "cairn/rows/element.h"
#include "mesh_body.hpp"

namespace cairn {
namespace {

constexpr double edge_at[3][2] = {{-1, 0}, {1, 0}, {0, 0}};
constexpr double triangle_at[6][2] = {{0, 0}, {1, 0}, {0, 1}, {0.5, 0}, {0.5, 0.5}, {0, 0.5}};
constexpr double quadrilateral_at[9][2] = {{-1, -1}, {1, -1}, {1, 1},  {-1, 1}, {0, -1},
                                           {1, 0},   {0, 1},  {-1, 0}, {0, 0}};

bool is_triangle(int nodes) { return nodes == 3 || nodes == 6; }

int corners_of(int dim, int nodes) { return dim == 2 ? 2 : is_triangle(nodes) ? 3 : 4; }

using Nodes9 = std::array<std::int32_t, most_side_nodes>;

// Lists of things at each node (compressed rows), from the nodes of each thing.
template <class Things, class Count>
void at_nodes(std::int64_t nodes, const Things& things, Count&& count, std::vector<std::int32_t>& start,
              std::vector<std::int32_t>& at) {
  start.assign(std::size_t(nodes) + 1, 0);
  for (const auto& t : things)
    for (int j = 0; j < count(t); ++j) ++start[std::size_t(t.node[j]) + 1];
  for (std::size_t k = 0; k < std::size_t(nodes); ++k) start[k + 1] += start[k];
  at.resize(std::size_t(start.back()));
  std::vector<std::int32_t> next(start.begin(), start.end() - 1);
  for (std::size_t i = 0; i < things.size(); ++i)
    for (int j = 0; j < count(things[i]); ++j)
      at[std::size_t(next[std::size_t(things[i].node[j])]++)] = std::int32_t(i);
}

} // namespace

const double* place_on_side(int dim, int nodes, int k) {
  if (dim == 2) return edge_at[k];
  return is_triangle(nodes) ? triangle_at[k] : quadrilateral_at[k];
}

MortarSurface::MortarSurface(const MeshModel& model) {
  const int dim = model.dim;
  const std::size_t sides = model.side_nodes.size() / 4;
  const std::vector<std::int32_t>& of_pieces = dim == 2 ? model.side_nodes : model.face_nodes;
  std::map<Nodes9, std::int32_t> number; // of whole sides
  std::vector<std::int32_t> whole_of(sides);
  for (std::size_t s = 0; s < sides; ++s) {
    Nodes9 nodes;
    nodes.fill(-1);
    if (model.whole_nodes.empty())
      std::copy_n(&of_pieces[4 * s], 4, nodes.begin());
    else
      std::copy_n(&model.whole_nodes[most_side_nodes * s], most_side_nodes, nodes.begin());
    const auto [at, fresh] = number.try_emplace(nodes, std::int32_t(whole.size()));
    whole_of[s] = at->second;
    if (!fresh) continue;
    MortarWhole w;
    std::copy(nodes.begin(), nodes.end(), w.node);
    w.nodes = int(std::find(nodes.begin(), nodes.end(), -1) - nodes.begin());
    whole.push_back(w);
  }
  std::map<std::array<std::int32_t, 4>, std::int32_t> known; // pieces of the whole at hand
  std::vector<std::int32_t> order(sides);
  for (std::size_t s = 0; s < sides; ++s) order[s] = std::int32_t(s);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::int32_t a, std::int32_t b) { return whole_of[std::size_t(a)] < whole_of[std::size_t(b)]; });
  piece_of_side.resize(sides);
  for (const std::int32_t s : order) {
    std::array<std::int32_t, 4> nodes;
    std::copy_n(&of_pieces[4 * std::size_t(s)], 4, nodes.begin());
    const auto [at, fresh] = known.try_emplace(nodes, std::int32_t(piece.size()));
    piece_of_side[std::size_t(s)] = at->second;
    if (!fresh) continue;
    MortarPiece p;
    p.whole = whole_of[std::size_t(s)];
    MortarWhole& w = whole[std::size_t(p.whole)];
    for (; p.corners < 4 && nodes[std::size_t(p.corners)] >= 0; ++p.corners) {
      const std::int32_t node = p.node[p.corners] = nodes[std::size_t(p.corners)];
      const std::int32_t* in = std::find(w.node, w.node + w.nodes, node);
      if (in == w.node + w.nodes)
        throw Error("the mesh '" + model.name + "': node " + std::to_string(node) +
                    " of a side is not of its whole side");
      std::copy_n(place_on_side(dim, w.nodes, int(in - w.node)), 2, p.at[p.corners]);
    }
    if (w.end_piece == 0) w.first_piece = std::int32_t(piece.size());
    piece.push_back(p);
    w.end_piece = std::int32_t(piece.size());
  }
  at_nodes(
      model.nodes(), piece, [](const MortarPiece& p) { return p.corners; }, pieces_start, pieces_at);
  at_nodes(
      model.nodes(), whole, [](const MortarWhole& w) { return w.nodes; }, wholes_start, wholes_at);
}

static cairn_element_shape* shape_of_face(int nodes) {
  return nodes == 3   ? cairn_element_t3_shape
         : nodes == 4 ? cairn_element_q4_shape
         : nodes == 6 ? cairn_element_t6_shape
         : nodes == 8 ? cairn_element_q8_shape
                      : cairn_element_q9_shape;
}

void side_shape(int dim, int nodes, const double* at, double* value) {
  double unused[2 * most_side_nodes];
  if (dim == 2) {
    const double s = at[0];
    value[0] = nodes == 2 ? (1 - s) / 2 : s * (s - 1) / 2;
    value[1] = nodes == 2 ? (1 + s) / 2 : s * (s + 1) / 2;
    if (nodes == 3) value[2] = (1 - s) * (1 + s);
    return;
  }
  shape_of_face(nodes)(at, value, unused);
}

void side_slopes(int dim, int nodes, const double* at, double* slope) {
  double unused[most_side_nodes];
  if (dim == 3) return shape_of_face(nodes)(at, unused, slope);
  slope[0] = nodes == 2 ? -0.5 : at[0] - 0.5;
  slope[1] = nodes == 2 ? 0.5 : at[0] + 0.5;
  if (nodes == 3) slope[2] = -2 * at[0];
}

void side_basis(int dim, int nodes, const double* at, double* value) {
  side_shape(dim, nodes, at, value);
  const int corners = corners_of(dim, nodes);
  if (nodes == corners) return;
  const int edges = dim == 2 ? 1 : corners;
  for (int e = 0; e < edges; ++e) {
    double& middle = value[corners + e];
    value[e] += middle / 4;
    value[(e + 1) % corners] += middle / 4;
    middle /= 2;
  }
  if (nodes != most_side_nodes) return;
  for (int k = 0; k < 4; ++k) {
    value[k] += value[8] / 16;
    value[4 + k] += value[8] / 8;
  }
  value[8] /= 4;
}

int basis_value(int dim, int nodes, int k, int* place, double* weight) {
  const int corners = corners_of(dim, nodes);
  place[0] = k;
  weight[0] = 1;
  if (k < corners) return 1;
  if (k < 8 || dim == 2) {
    const int e = k - corners;
    weight[0] = 2;
    place[1] = e;
    place[2] = (e + 1) % corners;
    weight[1] = weight[2] = -0.5;
    return 3;
  }
  weight[0] = 4;
  for (int c = 0; c < 4; ++c) {
    place[1 + c] = c;
    weight[1 + c] = 0.25;
    place[5 + c] = 4 + c;
    weight[5 + c] = -1;
  }
  return 9;
}

} // namespace cairn
