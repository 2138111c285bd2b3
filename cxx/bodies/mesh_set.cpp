#include "mesh_set.hpp"

#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "body.hpp"

namespace cairn {

void MeshSet::place(const Bodies& bodies, const std::vector<std::int32_t>& insertion_order) {
  of_body_.assign(std::size_t(bodies.count), {});
  area_.clear();
  wanted_.resize(meshes.size());
  const auto find = [&](std::int64_t id) {
    const auto at = std::lower_bound(insertion_order.begin(), insertion_order.end(), id,
                                     [&](std::int32_t b, std::int64_t wanted) { return *bodies.id[b] < wanted; });
    if (at == insertion_order.end() || *bodies.id[*at] != id)
      throw Error("body " + std::to_string(id) + " of a mesh is not in the scene");
    return *at;
  };
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    MeshBody& mesh = meshes[m];
    const auto all = [&](const std::vector<std::int64_t>& ids, std::vector<std::int32_t>& rows, Role role) {
      rows.resize(ids.size());
      for (std::size_t i = 0; i < ids.size(); ++i) {
        rows[i] = find(ids[i]);
        of_body_[rows[i]] = {std::int32_t(m), std::int32_t(i), role};
      }
    };
    all(mesh.model.node_ids, mesh.nodes, Role::node);
    all(mesh.model.point_ids, mesh.points, Role::point);
    all(mesh.model.side_ids, mesh.sides, mesh.model.dim == 2 ? Role::edge : Role::facet);
  }
}

namespace {

using Point = double[3];

void cross(const double* a, const double* b, double* out) {
  for (int k = 0; k < 3; ++k) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}
double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Barycentric coordinates of the foot of a point on the plane of a triangle.
void in_triangle(const Point corner[], const double* point, double weight[4], double normal[3]) {
  double e[3], f[3], r[3], area[3], part[3];
  for (int k = 0; k < 3; ++k) {
    e[k] = corner[1][k] - corner[0][k];
    f[k] = corner[2][k] - corner[0][k];
    r[k] = point[k] - corner[0][k];
  }
  cross(e, f, area);
  const double square = dot(area, area);
  cross(r, f, part);
  weight[1] = dot(part, area) / square;
  cross(e, r, part);
  weight[2] = dot(part, area) / square;
  weight[0] = 1 - weight[1] - weight[2];
  weight[3] = 0;
  for (int k = 0; k < 3; ++k) normal[k] = area[k] / std::sqrt(square);
}

void bilinear(double a, double b, double share[4], double by_a[4], double by_b[4]) {
  const double sa[4] = {-1, 1, 1, -1}, sb[4] = {-1, -1, 1, 1};
  for (int i = 0; i < 4; ++i) {
    share[i] = 0.25 * (1 + sa[i] * a) * (1 + sb[i] * b);
    by_a[i] = 0.25 * sa[i] * (1 + sb[i] * b);
    by_b[i] = 0.25 * sb[i] * (1 + sa[i] * a);
  }
}

// Shape functions of a quadrilateral where the line along `normal` through a point meets it, by Newton's method in the
// plane across the normal.
void in_quadrilateral(const Point corner[4], const double* point, const double* normal, double share[4]) {
  int least = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(normal[k]) < std::abs(normal[least])) least = k;
  double axis[3] = {0, 0, 0}, t[3], s[3];
  axis[least] = 1;
  cross(axis, normal, t);
  const double length = std::sqrt(dot(t, t));
  for (double& k : t) k /= length;
  cross(normal, t, s);
  double x[4][2], target[2], a = 0, b = 0, by_a[4], by_b[4];
  for (int i = 0; i < 4; ++i) x[i][0] = dot(t, corner[i]), x[i][1] = dot(s, corner[i]);
  target[0] = dot(t, point);
  target[1] = dot(s, point);
  constexpr int most = 20;
  for (int pass = 0; pass < most; ++pass) {
    bilinear(a, b, share, by_a, by_b);
    double wrong[2] = {target[0], target[1]}, j[2][2] = {{0, 0}, {0, 0}};
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 2; ++k) {
        wrong[k] -= share[i] * x[i][k];
        j[k][0] += by_a[i] * x[i][k];
        j[k][1] += by_b[i] * x[i][k];
      }
    const double determinant = j[0][0] * j[1][1] - j[0][1] * j[1][0];
    const double da = (j[1][1] * wrong[0] - j[0][1] * wrong[1]) / determinant;
    const double db = (j[0][0] * wrong[1] - j[1][0] * wrong[0]) / determinant;
    if (!std::isfinite(da) || !std::isfinite(db)) break;
    a += da;
    b += db;
    if (std::max(std::abs(da), std::abs(db)) < 1e-14) break; // of a coordinate that goes from -1 to 1
  }
  bilinear(a, b, share, by_a, by_b);
}

} // namespace

Mapping MeshSet::mapping(const Bodies& bodies, std::int32_t body, const double* point) const {
  const Place& place = of_body_[body];
  const MeshBody& mesh = meshes[place.mesh];
  Mapping m;
  m.mesh = place.mesh;
  if (place.role == Role::node) {
    m.node[0] = place.index;
    m.weight[0] = 1;
    return m;
  }
  if (place.role == Role::point) {
    for (int j = 0; j < 4; ++j) {
      m.node[j] = mesh.model.point_nodes[4 * place.index + j];
      m.weight[j] = mesh.model.point_weights[4 * place.index + j];
    }
    return m;
  }
  const std::int32_t* node = &mesh.model.side_nodes[4 * place.index];
  if (place.role == Role::edge) {
    const double *one = bodies.position[mesh.nodes[node[0]]], *two = bodies.position[mesh.nodes[node[1]]];
    const double x = two[0] - one[0], y = two[1] - one[1];
    // beyond an end it is the end that touches
    const double t = std::clamp(((point[0] - one[0]) * x + (point[1] - one[1]) * y) / (x * x + y * y), 0.0, 1.0);
    m.node[0] = node[0];
    m.node[1] = node[1];
    m.weight[0] = 1 - t;
    m.weight[1] = t;
    return m;
  }
  const std::int32_t* face = &mesh.model.face_nodes[4 * place.index];
  Point corner[4];
  const auto corners = [&](const std::int32_t* of, int n) {
    for (int i = 0; i < n; ++i) std::copy_n(bodies.position[mesh.nodes[of[i]]], 3, corner[i]);
  };
  double normal[3];
  corners(node, 3);
  in_triangle(corner, point, m.weight, normal);
  std::copy_n(node, 3, m.node);
  if (face[3] >= 0) {
    corners(face, 4);
    in_quadrilateral(corner, point, normal, m.weight);
    std::copy_n(face, 4, m.node);
  }
  return m;
}

void MeshSet::want(const Mapping& m) {
  for (int j = 0; j < 4 && m.node[j] >= 0; ++j)
    if (meshes[m.mesh].place(m.node[j]) < 0) wanted_[m.mesh].push_back(m.node[j]);
}

void MeshSet::condense(std::vector<CondensedBody>& out, Array<double>& velocity) {
  out.resize(meshes.size());
  std::size_t room = 0;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    MeshBody& mesh = meshes[i];
    std::vector<std::int32_t>& wanted = wanted_[i];
    if (!wanted.empty() && mesh.model.dofs() <= small_condensed) {
      wanted.resize(std::size_t(mesh.model.nodes()));
      for (std::size_t k = 0; k < wanted.size(); ++k) wanted[k] = std::int32_t(k);
    }
    mesh.touch(wanted);
    wanted.clear();
    const std::int64_t n = mesh.contact_nodes();
    CondensedBody& body = out[i];
    body.dofs = {mesh.model.dim * n, mesh.leading(), nullptr, mesh.compliance()};
    body.node.resize(std::size_t(n));
    for (std::int64_t k = 0; k < n; ++k) body.node[k] = mesh.nodes[mesh.contact_node(k)];
    room += condensed_rows(body.dofs.dofs);
  }
  fit(velocity, room);
  std::fill(velocity.begin(), velocity.end(), 0.0);
  room = 0;
  for (CondensedBody& body : out) {
    body.dofs.velocity = velocity.data() + room;
    room += condensed_rows(body.dofs.dofs);
  }
}

} // namespace cairn
