// The spin of an edge or face of a mesh by the velocities of its nodes. Of a translation it is nothing, of a rotation
// that rotation: so its transpose makes of a moment a couple on the nodes, of no force and of that moment.
#include <algorithm>
#include <cmath>

#include "../base/vectors.hpp"
#include "mesh_seats.hpp"

namespace cairn {

namespace {

// Derivatives of the shape functions of a face by its two coordinates, where their values are `share`.
void slopes(bool triangle, const double share[4], double by_a[4], double by_b[4]) {
  if (triangle) {
    const double a[4] = {-1, 1, 0, 0}, b[4] = {-1, 0, 1, 0};
    std::copy_n(a, 4, by_a);
    std::copy_n(b, 4, by_b);
    return;
  }
  const double sa[4] = {-1, 1, 1, -1}, sb[4] = {-1, -1, 1, 1};
  double a = 0, b = 0;
  for (int j = 0; j < 4; ++j) {
    a += sa[j] * share[j];
    b += sb[j] * share[j];
  }
  for (int j = 0; j < 4; ++j) {
    by_a[j] = 0.25 * sa[j] * (1 + sb[j] * b);
    by_b[j] = 0.25 * sb[j] * (1 + sa[j] * a);
  }
}

} // namespace

// In the plane the edge turns with its ends. In space, with g_j the gradients of the shape functions along the face, n
// its normal and h_j = n x g_j, the normal turns by n x dn/dt = -sum h_j (n . v_j), and the face in its plane by n sum
// (h_j . v_j)/2, half of the curl.
void spin_of_side(const MeshBody& mesh, const Nodes& nodes, const Mapping& m, double rows[4][3][3]) {
  std::fill_n(&rows[0][0][0], 36, 0.0);
  const double* x[4] = {};
  for (int j = 0; j < 4 && m.node[j] >= 0; ++j) x[j] = nodes.position[mesh.node(m.node[j])];
  if (mesh.model.dim == 2) {
    const double along[2] = {x[1][0] - x[0][0], x[1][1] - x[0][1]};
    const double square = along[0] * along[0] + along[1] * along[1];
    for (int j = 0; j < 2; ++j) {
      const double sign = j == 0 ? -1 : 1;
      rows[j][0][0] = -sign * along[1] / square;
      rows[j][0][1] = sign * along[0] / square;
    }
    return;
  }
  const int corners = m.node[3] < 0 ? 3 : 4;
  double by_a[4], by_b[4], a[3] = {0, 0, 0}, b[3] = {0, 0, 0}, n[3], across_a[3], across_b[3];
  slopes(corners == 3, m.weight, by_a, by_b);
  for (int j = 0; j < corners; ++j)
    for (int k = 0; k < 3; ++k) {
      a[k] += by_a[j] * x[j][k];
      b[k] += by_b[j] * x[j][k];
    }
  cross(a, b, n);
  const double area = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  for (double& k : n) k /= area;
  cross(b, n, across_a); // area times the vectors that have a product of one with a, of zero with b, and the reverse
  cross(n, a, across_b);
  for (int j = 0; j < corners; ++j) {
    double g[3], h[3];
    for (int k = 0; k < 3; ++k) g[k] = (by_a[j] * across_a[k] + by_b[j] * across_b[k]) / area;
    cross(n, g, h);
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 3; ++l) rows[j][k][l] = 0.5 * n[k] * h[l] - h[k] * n[l];
  }
}

} // namespace cairn
