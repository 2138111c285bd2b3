// Mortar and self-contact of meshes through the C API.
#include <algorithm>
#include <cmath>
#include <map>

#include "c_meshes.hpp"

namespace {

struct CContactOfMeshes : CMeshes {
  void begin(int dim) {
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    simulation = nullptr;
    scene = nullptr;
    make(dim);
    const double none[] = {0, 0, 0}, mu = 0;
    ASSERT_EQ(cairn_scene_set_gravity(scene, none, &error), 0);
    ASSERT_EQ(cairn_scene_set_law(scene, -1, -1, "GapCoulomb", 1, &mu, &error), 0) << error.message;
  }
  // Nodes of symmetry planes and, of the lower block, its bottom.
  void hold(int dim, bool bottom) {
    for (int k = 0; k < dim - !bottom; ++k) {
      std::vector<int32_t> found;
      for (std::size_t i = 0; i < node.size() / std::size_t(dim); ++i)
        if (std::abs(node[std::size_t(dim) * i + std::size_t(k)]) < 1e-9) found.push_back(int32_t(i));
      ASSERT_EQ(cairn_mesh_hold(mesh, int64_t(found.size()), found.data(), uint8_t(1 << k), &error), 0);
    }
  }
  // Share of node i in a uniform pressure on a side of n by n cells.
  double share(int dim, int n, int32_t i) const {
    double out = 1;
    for (int k = 0; k + 1 < dim; ++k) {
      const double x = node[std::size_t(dim * i + k)];
      out *= (x < 1e-9 || x > 1 - 1e-9 ? 0.5 : 1.0) / n;
    }
    return out;
  }
  void precise(double tolerance) {
    for (const auto& [name, value] : {std::pair{"theta", 1.0}, {"tol", tolerance}, {"max_iter", 50000.0}})
      ASSERT_EQ(cairn_simulation_set_number(simulation, name, value, &error), 0) << error.message;
  }
};

// 2 cells on 3, in space 2 by 2 on 3 by 3: the nodes below bear what a uniform pressure gives them, strains are the
// same everywhere. Without the mortar they are not.
TEST_F(CContactOfMeshes, a_mortar_passes_the_patch_test) {
  for (const int dim : {2, 3})
    for (const bool mortar : {true, false}) {
      SCOPED_TRACE(testing::Message() << dim << (mortar ? " mortar" : " nodes on sides"));
      begin(dim);
      const double pressure = 1e3, young = 1e6, h = 1;
      block(dim, 2, {0, dim == 2 ? 1.0 : 0.0, 1});
      elastic(dim, young);
      hold(dim, false);
      touch(level(dim, 1));
      ASSERT_EQ(cairn_mesh_set_contact(mesh, 0, mortar, &error), 0);
      if (mortar) {
        EXPECT_REFUSED(cairn_scene_add_mesh(scene, mesh, "over", rock, -1, nullptr, nullptr, &error),
                       "the mortar of the mesh 'over' is of contact nodes and the ");
      }
      touch_sides(dim, level(dim, 1));
      std::vector<double> force(node.size(), 0.0), over = node;
      for (const int32_t i : level(dim, 2)) force[std::size_t(dim * i + dim - 1)] = -pressure * share(dim, 2, i);
      const int32_t upper = add("over");
      block(dim, 3, {0, 0, 0});
      elastic(dim, young);
      hold(dim, true);
      touch_sides(dim, level(dim, 1));
      const int32_t lower = add("under");
      start();
      precise(1e-13);
      ASSERT_EQ(cairn_simulation_load_mesh(simulation, upper, force.data(), nullptr, nullptr, &error), 0);
      steps(60, h);
      const auto impulse = mesh_field(lower, "impulse");
      double off = 0;
      for (const int32_t i : level(dim, 1))
        off = std::max(off, std::abs(impulse[std::size_t(dim * i + dim - 1)] / (h * pressure) + share(dim, 3, i)));
      const double strain = pressure / young * (dim == 2 ? 1 - 0.3 * 0.3 : 1);
      double bent = 0;
      for (const auto& [number, at] : {std::pair{upper, over}, std::pair{lower, node}}) {
        const auto u = mesh_field(number, "displacement");
        for (std::size_t i = std::size_t(dim) - 1; i < u.size(); i += std::size_t(dim))
          bent = std::max(bent, std::abs(u[i] / strain + at[i]));
      }
      if (mortar) {
        EXPECT_LT(off, 1e-10);
        EXPECT_LT(bent, 1e-9);
      } else {
        EXPECT_GT(off, 1e-2);
        EXPECT_GT(bent, 1e-3);
      }
    }
}

// Patch test for cells of second order, whose sides are integrated as wholes: 2 on 3 again, as a block and the nodes in
// the middles of its edges.
struct CParabolicBlocks : CContactOfMeshes {
  void promote(int dim) {
    const std::vector<std::pair<int, int>> edges =
        dim == 2 ? std::vector<std::pair<int, int>>{{0, 1}, {1, 2}, {2, 3}, {3, 0}}
                 : std::vector<std::pair<int, int>>{{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                                    {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
    const std::size_t corners = dim == 2 ? 4 : 8, count = cell.size() / corners;
    std::map<std::pair<int32_t, int32_t>, int32_t> middle;
    std::vector<int32_t> wide;
    for (std::size_t c = 0; c < count; ++c) {
      const int32_t* own = &cell[corners * c];
      wide.insert(wide.end(), own, own + corners);
      for (const auto& [one, other] : edges) {
        const std::pair both{std::min(own[one], own[other]), std::max(own[one], own[other])};
        const auto [at, fresh] = middle.try_emplace(both, int32_t(node.size() / std::size_t(dim)));
        wide.push_back(at->second);
        for (std::size_t k = 0; k < std::size_t(dim) && fresh; ++k)
          node.push_back(0.5 * (node[std::size_t(dim) * std::size_t(both.first) + k] +
                                node[std::size_t(dim) * std::size_t(both.second) + k]));
      }
    }
    cell = wide;
    cairn_mesh_destroy(mesh);
    mesh = nullptr;
    ASSERT_EQ(cairn_mesh_create(dim, int64_t(node.size()) / dim, node.data(), &mesh, &error), 0) << error.message;
    ASSERT_EQ(cairn_mesh_add_elastic_cells(mesh, dim == 2 ? "q8" : "hex20", int64_t(count), cell.data(), 1e6, 0.3, 1000,
                                           0, 1, &error),
              0)
        << error.message;
    ASSERT_EQ(cairn_mesh_set_damping(mesh, 0, 5e-3, 0, &error), 0) << error.message;
  }
  // Forces of the nodes of cells with a side there, of a unit pressure: by Simpson's rule, or by that of eight nodes.
  std::vector<double> pressed(int dim, int n, double height) const {
    std::vector<double> force(node.size(), 0.0);
    const std::size_t nodes = dim == 2 ? 8 : 20, corners = dim == 2 ? 4 : 8;
    const auto up = std::size_t(dim - 1);
    for (std::size_t c = 0; c < cell.size(); c += nodes) {
      std::vector<std::size_t> there;
      for (std::size_t j = 0; j < nodes; ++j)
        if (std::abs(node[std::size_t(dim) * std::size_t(cell[c + j]) + up] - height) < 1e-9) there.push_back(j);
      if (there.size() != (dim == 2 ? 3u : 8u)) continue;
      for (const std::size_t j : there) {
        const double share = dim == 2 ? (j < corners ? 1.0 / 6 : 4.0 / 6) : (j < corners ? -1.0 / 12 : 4.0 / 12);
        force[std::size_t(dim) * std::size_t(cell[c + j]) + up] -= share / (dim == 2 ? n : n * n);
      }
    }
    return force;
  }
};

TEST_F(CParabolicBlocks, a_mortar_of_parabolic_sides_passes_the_patch_test) {
  for (const int dim : {2, 3})
    for (const bool mortar : {true, false}) {
      SCOPED_TRACE(testing::Message() << dim << (mortar ? " mortar" : " nodes on sides"));
      begin(dim);
      const double pressure = 1e3, young = 1e6, h = 0.1;
      block(dim, 2, {0, dim == 2 ? 1.0 : 0.0, 1});
      promote(dim);
      hold(dim, false);
      touch(level(dim, 1));
      ASSERT_EQ(cairn_mesh_set_contact(mesh, 0, mortar, &error), 0);
      touch_sides(dim, level(dim, 1));
      std::vector<double> force = pressed(dim, 2, 2), over = node;
      for (double& f : force) f *= pressure;
      const int32_t upper = add("over");
      block(dim, 3, {0, 0, 0});
      promote(dim);
      hold(dim, true);
      touch_sides(dim, level(dim, 1));
      const int32_t lower = add("under");
      start();
      precise(1e-13);
      ASSERT_EQ(cairn_simulation_load_mesh(simulation, upper, force.data(), nullptr, nullptr, &error), 0);
      steps(60, h);
      const double strain = pressure / young * (dim == 2 ? 1 - 0.3 * 0.3 : 1);
      double bent = 0;
      for (const auto& [number, at] : {std::pair{upper, over}, std::pair{lower, node}}) {
        const auto u = mesh_field(number, "displacement");
        for (std::size_t i = std::size_t(dim) - 1; i < u.size(); i += std::size_t(dim))
          bent = std::max(bent, std::abs(u[i] / strain + at[i]));
      }
      const auto impulse = mesh_field(lower, "impulse"), share = pressed(dim, 3, 1);
      double off = 0;
      for (std::size_t i = 0; i < share.size(); ++i) {
        const bool up = i % std::size_t(dim) == std::size_t(dim) - 1;
        if (up) off = std::max(off, std::abs(impulse[i] / (h * pressure) - share[i]));
      }
      if (mortar) {
        EXPECT_LT(bent, 1e-9);
        EXPECT_LT(off, 1e-9);
      } else {
        EXPECT_GT(bent, 1e-3);
        EXPECT_GT(off, 1e-2);
      }
    }
}

TEST_F(CContactOfMeshes, a_mesh_within_another_is_told_of_once) {
  for (const int dim : {2, 3}) {
    begin(dim);
    block(dim, 3, {0, 0, 0});
    elastic(dim);
    touch_sides(dim, level(dim, 1));
    add("outer");
    block(dim, 1, {0.3, 0.4, 0.2});
    for (std::size_t i = 0; i < node.size(); ++i) node[i] = 0.3 + 0.2 * node[i];
    cairn_mesh_destroy(mesh);
    mesh = nullptr;
    ASSERT_EQ(cairn_mesh_create(dim, int64_t(node.size()) / dim, node.data(), &mesh, &error), 0) << error.message;
    elastic(dim);
    touch({0});
    add("inner");
    start();
    steps(1, 1e-6);
    EXPECT_EQ(text("status"), "converged");
    EXPECT_EQ(text("hint").rfind("node 0 of the mesh 'inner', which lies wholly within the mesh 'outer'", 0), 0u)
        << text("hint");
    steps(1, 1e-6);
    EXPECT_EQ(text("hint"), "");
  }
}

// Two arms on a back with a narrow slot between them, one of which is pushed on to the other.
TEST_F(CContactOfMeshes, a_mesh_meets_its_own_sides) {
  const double gap = 0.02;
  for (const int dim : {2, 3})
    for (const bool meets : {true, false}) {
      SCOPED_TRACE(testing::Message() << dim << (meets ? " meets itself" : " does not"));
      begin(dim);
      node.clear();
      cell.clear();
      std::vector<int32_t> slot, back;
      const int layers = dim == 2 ? 1 : 3, middle = 20 * (layers / 2);
      for (int k = 0; k < layers; ++k)
        for (int i = 0; i < 5; ++i)
          for (int j = 0; j < 4; ++j) {
            const int32_t a = 20 * k + 4 * i + j;
            if (j == 1 || j == 2) slot.push_back(a);
            if (i == 0) back.push_back(a);
            node.insert(node.end(), {0.25 * i, 0.2 * (j / 2 + j % 2) + gap * (j / 2)});
            if (dim == 3) node.push_back(0.25 * k);
            if ((k > 0 && k == layers - 1) || i == 4 || j == 3 || (j == 1 && i > 0)) continue;
            cell.insert(cell.end(), {a, a + 4, a + 5, a + 1});
            if (dim == 3) cell.insert(cell.end(), {a + 20, a + 24, a + 25, a + 21});
          }
      cairn_mesh_destroy(mesh);
      mesh = nullptr;
      ASSERT_EQ(cairn_mesh_create(dim, int64_t(node.size()) / dim, node.data(), &mesh, &error), 0) << error.message;
      ASSERT_EQ(cairn_mesh_add_elastic_cells(mesh, dim == 2 ? "q4" : "hex8", cells(dim), cell.data(), 1e5, 0.2, 1000, 0,
                                             1, &error),
                0)
          << error.message;
      ASSERT_EQ(cairn_mesh_set_damping(mesh, 0, 2e-3, 0, &error), 0) << error.message;
      ASSERT_EQ(cairn_mesh_hold(mesh, int64_t(back.size()), back.data(), uint8_t((1 << dim) - 1), &error), 0);
      ASSERT_EQ(cairn_mesh_set_contact(mesh, meets, 0, &error), 0);
      touch(slot);
      if (meets) {
        EXPECT_REFUSED(cairn_scene_add_mesh(scene, mesh, "fork", rock, -1, nullptr, nullptr, &error),
                       "self-contact of the mesh 'fork' is of its points and its ");
      }
      touch_sides(dim, slot);
      const int32_t number = add("fork");
      start();
      precise(1e-12);
      std::vector<double> force(node.size(), 0.0);
      for (int k = 0; k < layers; ++k) force[std::size_t(dim * (20 * k + 19) + 1)] = dim == 2 ? -800 : -400.0 / layers;
      ASSERT_EQ(cairn_simulation_load_mesh(simulation, number, force.data(), nullptr, nullptr, &error), 0);
      double least = gap, deepest = 0, borne = 0;
      for (int step = 0; step < 150; ++step) {
        steps(1, 1e-3);
        EXPECT_EQ(text("status"), "converged");
        const auto u = mesh_field(number, "displacement"), impulse = mesh_field(number, "impulse");
        for (const double g : contact("gap")) deepest = std::max(deepest, -g);
        double sum[3] = {}, size = 0;
        for (std::size_t i = 0; i < impulse.size(); ++i) {
          sum[i % std::size_t(dim)] += impulse[i];
          size += std::abs(impulse[i]);
        }
        for (int k = 0; k < dim; ++k) EXPECT_LE(std::abs(sum[k]), 1e-13 * size);
        borne = std::max(borne, size);
        least =
            std::min(least, gap + u[std::size_t(dim * (middle + 18) + 1)] - u[std::size_t(dim * (middle + 17) + 1)]);
      }
      EXPECT_EQ(borne > 0, meets);
      EXPECT_LT(deepest, 5e-3 * gap);
      if (meets) { EXPECT_GT(least, -0.05 * gap); } // across, of nodes that stand on a side that leans
      EXPECT_LT(least, meets ? 0.05 * gap : -0.5 * gap);
      EXPECT_LT(std::abs(energy("closure")), 1e-12 * energy("in_play"));
    }
}

} // namespace
