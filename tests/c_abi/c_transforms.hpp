// Blocks as rigid bodies and as meshes in a scene of the C API, with their momentum.
#pragma once
#include <algorithm>
#include <cmath>

#include "c_scene.hpp"

struct CTransforms : CScene {
  cairn_mesh* mesh = nullptr;
  std::vector<double> node;
  std::vector<int32_t> cell;
  ~CTransforms() override { cairn_mesh_destroy(mesh); }

  // A grid of n by n cells (by n), of the sizes, its lower corner there; of a linear material, or of rubber.
  void grid(int n, std::vector<double> size, std::vector<double> corner, bool rubber, double young = 1e7) {
    const int dim = int(size.size()), m = n + 1;
    node.clear();
    cell.clear();
    for (int k = 0; k < (dim == 2 ? 1 : m); ++k)
      for (int j = 0; j < m; ++j)
        for (int i = 0; i < m; ++i) {
          const double x[] = {double(i) / n, double(j) / n, double(k) / n};
          for (std::size_t c = 0; c < size.size(); ++c) node.push_back(corner[c] + size[c] * x[c]);
        }
    for (int k = 0; k < (dim == 2 ? 1 : n); ++k)
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const int32_t a = (k * m + j) * m + i;
          cell.insert(cell.end(), {a, a + 1, a + m + 1, a + m});
          if (dim == 3) cell.insert(cell.end(), {a + m * m, a + m * m + 1, a + m * m + m + 1, a + m * m + m});
        }
    cairn_mesh_destroy(mesh);
    mesh = nullptr;
    ASSERT_EQ(cairn_mesh_create(dim, int64_t(node.size()) / dim, node.data(), &mesh, &error), 0) << error.message;
    const char *names[] = {"young", "poisson"}, *element = dim == 2 ? "q4" : "hex8";
    const double values[] = {young, 0.3};
    const int64_t cells = int64_t(cell.size()) / (dim == 2 ? 4 : 8);
    if (rubber)
      ASSERT_EQ(cairn_mesh_add_solid_cells(mesh, element, cells, cell.data(), "neo_hookean", 2, names, values, 900,
                                           "total_lagrangian", "strain", 0, 1, &error),
                0)
          << error.message;
    else
      ASSERT_EQ(cairn_mesh_add_elastic_cells(mesh, element, cells, cell.data(), young, 0.3, 900, 0, 1, &error), 0)
          << error.message;
  }
  // A square, or a box, as a rigid body of density 1000 round its place; its number.
  int64_t block(std::vector<double> size, std::vector<double> place, double angle = 0) {
    const int dim = int(size.size());
    int32_t number = -1;
    std::vector<double> vertex;
    for (int c = 0; c < (dim == 2 ? 4 : 8); ++c) {
      const int x = c % 4 == 1 || c % 4 == 2, y = c % 4 > 1, z = c > 3;
      const int upper[] = {x, y, z};
      for (std::size_t k = 0; k < size.size(); ++k) vertex.push_back(size[k] * (upper[k] - 0.5));
    }
    const int64_t first_vertex[] = {0, dim == 2 ? 4 : 8}, first_face[] = {0, 6};
    const int64_t first_corner[] = {0, 4, 8, 12, 16, 20, 24};
    const int64_t corner[] = {0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7};
    EXPECT_EQ(dim == 2 ? cairn_scene_add_polygons(scene, 1, first_vertex, vertex.data(), &number, &error)
                       : cairn_scene_add_polyhedra(scene, 1, first_vertex, vertex.data(), first_face, first_corner,
                                                   corner, &number, &error),
              0)
        << error.message;
    double mass = 1000, inertia[3] = {};
    for (const double s : size) mass *= s;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t a = dim == 2 ? 0 : (k + 1) % 3, b = dim == 2 ? 1 : (k + 2) % 3;
      inertia[k] = mass / 12 * (size[a] * size[a] + size[b] * size[b]);
    }
    int64_t id = -1;
    const double rotation[] = {dim == 2 ? angle : std::cos(angle / 2), 0, 0, std::sin(angle / 2)};
    EXPECT_EQ(cairn_scene_add_bodies(scene, 1, place.data(), rotation, nullptr, &mass, inertia, &id, &error), 0)
        << error.message;
    hull(dim == 2 ? "polygon" : "polyhedron", id, number);
    return id;
  }
  void weightless(int dim) {
    make(dim, 0.3);
    const double none[3] = {};
    ASSERT_EQ(cairn_scene_set_gravity(scene, none, &error), 0);
  }
  void speed(std::vector<double> v) {
    ASSERT_EQ(cairn_scene_set_body_field(scene, "velocity", 1, nullptr, v.data(), &error), 0) << error.message;
  }
  int32_t deform(int64_t id) {
    int32_t number = -1;
    EXPECT_EQ(cairn_simulation_deform(simulation, id, mesh, nullptr, -1, -1, &number, &error), 0) << error.message;
    return number;
  }
  int64_t rigidify(int32_t number) {
    int64_t id = -1;
    EXPECT_EQ(cairn_simulation_rigidify(simulation, number, &id, &error), 0) << error.message;
    return id;
  }
  std::vector<double> nodes(int32_t number, const char* name) {
    std::vector<double> out(node.size());
    int64_t n = 0;
    EXPECT_EQ(cairn_simulation_mesh_field(simulation, number, name, int64_t(out.size()), out.data(), &n, &error), 0)
        << error.message;
    EXPECT_EQ(n, int64_t(node.size()));
    return out;
  }
  // Momentum of the single body or mesh: consistent masses of its cells, by a quadrature of this file.
  std::vector<double> momentum(int axes, double density = 0) {
    const int dim = axes == 2 ? 2 : 3; // A compiler that does not know this finds arrays of three read past their end.
    std::vector<double> p(std::size_t(3 * dim - 3), 0.0);
    const auto moment = [&](const double* x, const double* v, double m) {
      for (int k = 0; k < dim; ++k) p[std::size_t(k)] += m * v[k];
      if (dim == 2) {
        p[2] += m * (x[0] * v[1] - x[1] * v[0]);
        return;
      }
      for (int k = 0; k < 3; ++k)
        p[std::size_t(3 + k)] += m * (x[(k + 1) % 3] * v[(k + 2) % 3] - x[(k + 2) % 3] * v[(k + 1) % 3]);
    };
    if (density > 0) {
      const auto x = nodes(0, "position"), v = nodes(0, "velocity");
      const std::size_t corners = dim == 2 ? 4 : 8;
      const double g = 1 / std::sqrt(3.0);
      for (std::size_t first = 0; first < cell.size(); first += corners)
        for (std::size_t q = 0; q < corners; ++q) { // at rest cells are boxes: their mass is spread evenly
          double at[3] = {}, speed[3] = {}, volume = 1;
          const double xi[] = {q % 2 ? g : -g, q / 2 % 2 ? g : -g, q / 4 ? g : -g};
          for (std::size_t c = 0; c < corners; ++c) {
            const double side[] = {c % 4 == 1 || c % 4 == 2 ? 1.0 : -1.0, c % 4 > 1 ? 1.0 : -1.0, c > 3 ? 1.0 : -1.0};
            double share = 1;
            for (int k = 0; k < dim; ++k) share *= (1 + side[k] * xi[k]) / 2;
            for (int k = 0; k < dim; ++k) {
              at[k] += share * x[std::size_t(dim * cell[first + c] + k)];
              speed[k] += share * v[std::size_t(dim * cell[first + c] + k)];
            }
          }
          const double* low = &node[std::size_t(dim * cell[first])];
          const double* high = &node[std::size_t(dim * cell[first + (dim == 2 ? 2 : 6)])];
          for (int k = 0; k < dim; ++k) volume *= high[k] - low[k];
          moment(at, speed, density * volume / double(corners));
        }
      return p;
    }
    const auto x = field("position"), v = field("velocity"), m = field("mass"), j = field("inertia");
    moment(x.data(), v.data(), m[0]);
    if (dim == 2) {
      p[2] += j[0] * v[2];
      return p;
    }
    const auto q = field("rotation"); // spin through the axes of the body
    const double w = q[0], a = q[1], b = q[2], c = q[3];
    const double r[3][3] = {{1 - 2 * (b * b + c * c), 2 * (a * b - w * c), 2 * (a * c + w * b)},
                            {2 * (a * b + w * c), 1 - 2 * (a * a + c * c), 2 * (b * c - w * a)},
                            {2 * (a * c - w * b), 2 * (b * c + w * a), 1 - 2 * (a * a + b * b)}};
    for (int axis = 0; axis < 3; ++axis) {
      double spin = 0;
      for (int k = 0; k < 3; ++k) spin += r[k][axis] * v[std::size_t(3 + k)];
      for (int k = 0; k < 3; ++k) p[std::size_t(3 + k)] += r[k][axis] * j[std::size_t(axis)] * spin;
    }
    return p;
  }
  static void expect_near(const std::vector<double>& is, const std::vector<double>& wanted, double share) {
    double most = 0;
    ASSERT_EQ(is.size(), wanted.size());
    for (const double w : wanted) most = std::max(most, std::abs(w));
    for (std::size_t i = 0; i < is.size(); ++i) EXPECT_NEAR(is[i] / most, wanted[i] / most, share) << i;
  }
};
