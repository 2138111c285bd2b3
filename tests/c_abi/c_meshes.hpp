// Blocks of cells in a scene of the C API, with their contact sides, brought to rest.
#pragma once
#include <algorithm>
#include <cmath>

#include "c_scene.hpp"

struct CMeshes : CScene {
  cairn_mesh* mesh = nullptr;
  std::vector<double> node;
  std::vector<int32_t> cell;
  ~CMeshes() override { cairn_mesh_destroy(mesh); }

  // n by n quadrilaterals of a square of side 1, or n by n by n hexahedra of a cube, its lower corner there.
  void block(int dim, int n, std::vector<double> corner) {
    cairn_mesh_destroy(mesh);
    mesh = nullptr;
    node.clear();
    cell.clear();
    const int m = n + 1, layers = dim == 2 ? 1 : m;
    for (int k = 0; k < layers; ++k)
      for (int j = 0; j < m; ++j)
        for (int i = 0; i < m; ++i) {
          const double x[] = {double(i) / n, double(j) / n, double(k) / n};
          for (int c = 0; c < dim; ++c) node.push_back(corner[std::size_t(c)] + x[c]);
        }
    for (int k = 0; k < (dim == 2 ? 1 : n); ++k)
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const int32_t a = (k * m + j) * m + i;
          cell.insert(cell.end(), {a, a + 1, a + m + 1, a + m});
          if (dim == 3) cell.insert(cell.end(), {a + m * m, a + m * m + 1, a + m * m + m + 1, a + m * m + m});
        }
    ASSERT_EQ(cairn_mesh_create(dim, int64_t(node.size()) / dim, node.data(), &mesh, &error), 0) << error.message;
  }
  int64_t cells(int dim) const { return int64_t(cell.size()) / (dim == 2 ? 4 : 8); }
  void elastic(int dim, double young = 1e7) {
    ASSERT_EQ(cairn_mesh_add_elastic_cells(mesh, dim == 2 ? "q4" : "hex8", cells(dim), cell.data(), young, 0.3, 1000, 0,
                                           1, &error),
              0)
        << error.message;
    ASSERT_EQ(cairn_mesh_set_damping(mesh, 0, 5e-3, 0, &error), 0) << error.message;
  }
  // Nodes whose coordinate along the last axis is that.
  std::vector<int32_t> level(int dim, double height) const {
    std::vector<int32_t> found;
    for (std::size_t i = 0; i < node.size() / dim; ++i)
      if (std::abs(node[dim * i + dim - 1] - height) < 1e-9) found.push_back(int32_t(i));
    return found;
  }
  void touch(const std::vector<int32_t>& nodes) {
    ASSERT_EQ(cairn_mesh_touch_nodes(mesh, int64_t(nodes.size()), nodes.data(), &error), 0) << error.message;
  }
  // Sides of the boundary whose nodes are all of these.
  void touch_sides(int dim, const std::vector<int32_t>& nodes) {
    int64_t count = 0;
    ASSERT_EQ(cairn_mesh_boundary(mesh, 0, nullptr, &count, &error), 0) << error.message;
    std::vector<int32_t> sides(count), kept;
    ASSERT_EQ(cairn_mesh_boundary(mesh, count, sides.data(), &count, &error), 0);
    const std::size_t width = dim == 2 ? 2 : 4;
    for (std::size_t s = 0; s < sides.size(); s += width) {
      bool all = true;
      for (std::size_t k = 0; k < width; ++k)
        all = all && (sides[s + k] < 0 || std::find(nodes.begin(), nodes.end(), sides[s + k]) != nodes.end());
      if (all) kept.insert(kept.end(), &sides[s], &sides[s] + width);
    }
    ASSERT_GT(kept.size(), 0u);
    ASSERT_EQ(cairn_mesh_touch_sides(mesh, int64_t(kept.size() / width), kept.data(), &error), 0) << error.message;
  }
  int32_t add(const char* name) {
    int32_t number = -1;
    EXPECT_EQ(cairn_scene_add_mesh(scene, mesh, name, rock, -1, nullptr, &number, &error), 0) << error.message;
    return number;
  }
  std::vector<double> mesh_field(int32_t number, const char* name) {
    int64_t count = 0;
    EXPECT_EQ(cairn_simulation_mesh_field(simulation, number, name, 0, nullptr, &count, &error), 0) << error.message;
    std::vector<double> values(count);
    EXPECT_EQ(cairn_simulation_mesh_field(simulation, number, name, count, values.data(), &count, &error), 0);
    return values;
  }
  void settle(int n) {
    ASSERT_EQ(cairn_simulation_set_number(simulation, "theta", 1, &error), 0) << error.message;
    ASSERT_EQ(cairn_simulation_set_number(simulation, "tol", 1e-8, &error), 0);
    ASSERT_EQ(cairn_simulation_set_option(simulation, "solver", "auto", &error), 0);
    steps(n, 2e-3);
    EXPECT_EQ(text("status"), "converged");
  }
  double upwards(int dim) {
    double up = 0;
    const auto impulse = contact("impulse");
    for (std::size_t i = std::size_t(dim) - 1; i < impulse.size(); i += std::size_t(dim)) up += impulse[i];
    return up / 2e-3;
  }
};
