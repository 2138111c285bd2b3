#include "mesh_pressure.hpp"

#include <algorithm>
#include <cmath>

#include "../base/vectors.hpp"
#include "../fe/elements.hpp"
#include "../soe/soe.hpp"

namespace cairn {
namespace {

constexpr int widest = 9; // nodes of a side
constexpr double pi = 3.14159265358979323846;

struct Point { // of a Gauss rule on a side: shape functions, and their derivatives along it
  double n[widest], by[2][widest], weight;
};

int edge_points(int nodes, Point* out) {
  constexpr double at[3] = {-0.7745966692414834, 0, 0.7745966692414834}, weight[3] = {5.0 / 9, 8.0 / 9, 5.0 / 9};
  for (int g = 0; g < 3; ++g) {
    const double s = at[g];
    Point& p = out[g];
    p.weight = weight[g];
    if (nodes == 2) {
      p.n[0] = (1 - s) / 2, p.n[1] = (1 + s) / 2;
      p.by[0][0] = -0.5, p.by[0][1] = 0.5;
    } else {
      p.n[0] = s * (s - 1) / 2, p.n[1] = s * (s + 1) / 2, p.n[2] = 1 - s * s;
      p.by[0][0] = s - 0.5, p.by[0][1] = s + 0.5, p.by[0][2] = -2 * s;
    }
  }
  return 3;
}

// A face of second order is a flat element that is bent in space; its rule of integration is exact where it is flat.
int bent_face_points(int nodes, Point* out) {
  const auto all = element_infos();
  const auto e =
      std::find_if(all.begin(), all.end(), [&](const ElementInfo& i) { return i.dim == 2 && i.nodes == nodes; });
  double at[2 * widest], weight[widest], slope[2 * widest];
  e->rule(at, weight);
  for (int g = 0; g < e->points; ++g) {
    Point& p = out[g];
    p.weight = weight[g];
    e->shape(&at[2 * g], p.n, slope);
    for (int a = 0; a < nodes; ++a) p.by[0][a] = slope[2 * a], p.by[1][a] = slope[2 * a + 1];
  }
  return e->points;
}

int face_points(int nodes, Point* out) {
  if (nodes > 4) return bent_face_points(nodes, out);
  if (nodes == 3) { // the normal is one, and forces are a third each
    Point& p = out[0];
    p.weight = 0.5;
    for (int a = 0; a < 3; ++a) p.n[a] = 1.0 / 3;
    p.by[0][0] = p.by[1][0] = -1;
    p.by[0][1] = p.by[1][2] = 1;
    p.by[0][2] = p.by[1][1] = 0;
    return 1;
  }
  const double corner[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}, at = 1 / std::sqrt(3.0);
  for (int g = 0; g < 4; ++g) {
    const double r = at * corner[g][0], s = at * corner[g][1];
    out[g].weight = 1;
    for (int a = 0; a < 4; ++a) {
      out[g].n[a] = (1 + r * corner[a][0]) * (1 + s * corner[a][1]) / 4;
      out[g].by[0][a] = corner[a][0] * (1 + s * corner[a][1]) / 4;
      out[g].by[1][a] = corner[a][1] * (1 + r * corner[a][0]) / 4;
    }
  }
  return 4;
}

// d[i][j] = derivative of (a x b)_i by the component j of a point that a and b have da and db of.
void cross_slope(const double* a, const double* b, double da, double db, double d[3][3]) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) d[i][j] = 0;
  for (int i = 0; i < 3; ++i) { // (a x b)_i = a_k b_l - a_l b_k
    const int k = (i + 1) % 3, l = (i + 2) % 3;
    d[i][k] += da * b[l] - db * a[l];
    d[i][l] += db * a[k] - da * b[k];
  }
}

} // namespace

void PressedSides::press(int dim, const double* x, double factor, double* force, const SparseMatrix& pattern,
                         double slope, double* values) {
  Point points[widest];
  const int count = dim == 2 ? edge_points(nodes, points) : face_points(nodes, points), dofs = dim * nodes;
  const std::size_t sides = node.size() / std::size_t(nodes), pairs = std::size_t(dofs) * dofs;
  if (values && place.empty())
    for (std::size_t s = 0; s < sides; ++s)
      for (int j = 0; j < dofs; ++j)
        for (int i = 0; i < dofs; ++i) {
          const std::int32_t row = dim * node[s * nodes + i / dim] + i % dim;
          const std::int32_t column = dim * node[s * nodes + j / dim] + j % dim;
          place.push_back(row >= column ? place_of(pattern, row, column) : -1);
        }
  for (std::size_t s = 0; s < sides; ++s) {
    const std::int32_t* of = &node[s * nodes];
    double k[3 * widest][3 * widest] = {};
    for (int g = 0; g < count; ++g) {
      const Point& p = points[g];
      double along[2][3] = {}, inward[3], wide = dim == 2 ? thickness : 1;
      for (int a = 0; a < nodes; ++a)
        for (int c = 0; c < dim; ++c)
          for (int r = 0; r < dim - 1; ++r) along[r][c] += p.by[r][a] * x[dim * of[a] + c];
      double radius = 0;
      for (int a = 0; a < nodes; ++a) radius += p.n[a] * (x[dim * of[a]] - axis);
      if (ring) wide = 2 * pi * radius;
      if (dim == 2) { // the body is on the left
        inward[0] = -along[0][1], inward[1] = along[0][0];
      } else {
        cross(along[1], along[0], inward);
      }
      for (int a = 0; a < nodes; ++a)
        for (int c = 0; c < dim; ++c) force[dim * of[a] + c] += factor * p.weight * p.n[a] * wide * inward[c];
      for (int b = 0; b < nodes && values; ++b) {
        double d[3][3] = {};
        if (dim == 2) {
          d[0][1] = -p.by[0][b] * wide, d[1][0] = p.by[0][b] * wide;
          for (int c = 0; c < 2 && ring; ++c) d[c][0] += 2 * pi * p.n[b] * inward[c];
        } else {
          cross_slope(along[1], along[0], p.by[1][b], p.by[0][b], d);
        }
        for (int a = 0; a < nodes; ++a)
          for (int i = 0; i < dim; ++i)
            for (int j = 0; j < dim; ++j) k[dim * a + i][dim * b + j] += p.weight * p.n[a] * d[i][j];
      }
    }
    for (int j = 0; j < dofs && values; ++j)
      for (int i = 0; i < dofs; ++i)
        if (const std::int64_t at = place[s * pairs + std::size_t(j) * dofs + i]; at >= 0)
          values[at] += slope * (k[i][j] + k[j][i]) / 2;
  }
}

} // namespace cairn
