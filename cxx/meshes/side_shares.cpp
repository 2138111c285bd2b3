// Shares of the corners of a side in its area. A uniform stress gives each node a force in proportion to the integral
// of its shape function over the whole side: 1/4 on each node of a quadrilateral, whichever way it is split into
// triangles, and 1/6, 2/3, 1/6 on a parabolic edge. Bonds of these areas all carry the same stress.
#include "side_shares.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "../base/vectors.hpp"
#include "mesh_body.hpp"
#include "mortar_surface.hpp"

namespace cairn {
namespace {

using WholeNodes = std::array<std::int32_t, most_side_nodes>;

// Smallest share of a corner in the area of its side: on six nodes corners have an integral of 0, on eight a negative
// one, but a contact there needs an area. So small that others, which give it, miss a uniform stress by little.
constexpr double least = 1.0 / 200;

int count_of(const WholeNodes& nodes) { return int(std::find(nodes.begin(), nodes.end(), -1) - nodes.begin()); }

// Area that belongs to a point of a whole side, over that in the space of its shape functions.
double stretch(const MeshModel& m, const WholeNodes& nodes, int count, const double* at) {
  double value[most_side_nodes], slope[2 * most_side_nodes], t[2][3] = {}, axial = 0;
  side_slopes(m.dim, count, at, slope);
  for (int k = 0; k < count; ++k)
    for (int i = 0; i < m.dim; ++i)
      for (int way = 0; way < m.dim - 1; ++way)
        t[way][i] += slope[(m.dim - 1) * k + way] * m.reference[std::size_t(m.dim * nodes[std::size_t(k)] + i)];
  if (m.dim == 3) {
    double n[3];
    cross(t[0], t[1], n);
    return std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  }
  const double length = std::hypot(t[0][0], t[0][1]);
  if (!m.ring) return length;
  side_shape(2, count, at, value);
  for (int k = 0; k < count; ++k) axial += value[k] * m.reference[std::size_t(2 * nodes[std::size_t(k)])];
  return 2 * std::numbers::pi * std::abs(axial - m.axis) * length;
}

// Integrals of the functions that share out a stress, none of them below a small part of the whole.
void integrals(const MeshModel& m, const WholeNodes& nodes, double* out) {
  constexpr double gauss[3][2] = {{-0.7745966692414834, 5.0 / 9}, {0, 8.0 / 9}, {0.7745966692414834, 5.0 / 9}};
  const int count = count_of(nodes);
  const bool triangle = count == 3 || count == 6;
  std::fill_n(out, count, 0.0);
  const auto add = [&](const double* at, double weight) {
    double value[most_side_nodes];
    // mortar sides are shared out by the functions of their basis
    (m.mortar ? side_basis : side_shape)(m.dim, count, at, value);
    const double area = weight * stretch(m, nodes, count, at);
    for (int k = 0; k < count; ++k) out[k] += area * value[k];
  };
  for (const auto& x : gauss) {
    if (m.dim == 2) {
      add(x, x[1]);
      continue;
    }
    for (const auto& y : gauss) {
      const double u = (1 + x[0]) / 2, v = (1 + y[0]) / 2;
      const double square[2] = {x[0], y[0]}, folded[2] = {u, v * (1 - u)}; // onto a triangle
      triangle ? add(folded, x[1] * y[1] * (1 - u) / 4) : add(square, x[1] * y[1]);
    }
  }
  const double small = least * std::accumulate(out, out + count, 0.0);
  for (int k = 0; k < count; ++k) out[k] = std::max(out[k], small);
}

double area_of(const MeshModel& m, const std::int32_t* node, int corners) {
  double e[2][3] = {}, n[3];
  for (int j = 1; j < corners; ++j)
    for (int i = 0; i < m.dim; ++i)
      e[j - 1][i] = m.reference[std::size_t(m.dim * node[j] + i)] - m.reference[std::size_t(m.dim * node[0] + i)];
  if (m.dim == 2) {
    const double middle = (m.reference[std::size_t(2 * node[0])] + m.reference[std::size_t(2 * node[1])]) / 2;
    return std::hypot(e[0][0], e[0][1]) * (m.ring ? 2 * std::numbers::pi * std::abs(middle - m.axis) : 1);
  }
  cross(e[0], e[1], n);
  return std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
}

// Shares the areas of the pieces of a whole side among their corners so that nodes have their wanted areas: iterative
// proportional fitting, in turn to nodes and to pieces. It converges fast where flat pieces can meet the wanted areas.
void share_out(const MeshModel& m, const WholeNodes& nodes, const std::vector<std::int32_t>& pieces, double* share) {
  constexpr int most = 64;
  constexpr double exact = 1e-14;
  const int count = count_of(nodes), corners = m.dim;
  double wanted[most_side_nodes], sum[most_side_nodes], all = 0, told = 0;
  integrals(m, nodes, wanted);
  const auto place = [&](std::int32_t piece, int j) {
    return std::find(nodes.begin(), nodes.begin() + count, m.side_nodes[std::size_t(4 * piece + j)]) - nodes.begin();
  };
  const auto sum_up = [&] {
    std::fill_n(sum, count, 0.0);
    for (const std::int32_t p : pieces)
      for (int j = 0; j < corners; ++j) sum[place(p, j)] += share[3 * p + j];
  };
  std::vector<double> area;
  for (const std::int32_t p : pieces) {
    area.push_back(area_of(m, &m.side_nodes[std::size_t(4 * p)], corners));
    all += area.back();
    for (int j = 0; j < corners; ++j) share[3 * p + j] = area.back() / corners;
  }
  sum_up();
  for (int k = 0; k < count; ++k) told += sum[k] > 0 ? wanted[k] : 0;
  for (int turn = 0; turn < most && all > 0; ++turn) {
    double off = 0;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      double* own = &share[3 * pieces[i]];
      if (!(area[i] > 0)) continue; // a piece that has collapsed
      for (int j = 0; j < corners; ++j) {
        const auto k = place(pieces[i], j);
        own[j] *= wanted[k] * all / (told * sum[k]);
      }
      const double scale = area[i] / std::accumulate(own, own + corners, 0.0);
      for (int j = 0; j < corners; ++j) own[j] *= scale;
    }
    sum_up();
    for (int k = 0; k < count; ++k)
      if (sum[k] > 0) off = std::max(off, std::abs(sum[k] - wanted[k] * all / told));
    if (off <= exact * all) break;
  }
}

} // namespace

std::vector<double> shares_of_sides(const MeshModel& m) {
  const std::size_t sides = m.side_nodes.size() / 4;
  const std::vector<std::int32_t>& own = m.dim == 2 ? m.side_nodes : m.face_nodes;
  std::map<WholeNodes, std::vector<std::int32_t>> wholes;
  for (std::size_t s = 0; s < sides; ++s) {
    WholeNodes nodes;
    nodes.fill(-1);
    if (m.whole_nodes.empty())
      std::copy_n(&own[4 * s], 4, nodes.begin());
    else
      std::copy_n(&m.whole_nodes[most_side_nodes * s], most_side_nodes, nodes.begin());
    wholes[nodes].push_back(std::int32_t(s));
  }
  std::vector<double> share(3 * sides, 0.0);
  for (const auto& [nodes, pieces] : wholes) share_out(m, nodes, pieces, share.data());
  return share;
}

} // namespace cairn
