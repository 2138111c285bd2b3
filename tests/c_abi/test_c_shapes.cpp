// Shapes that are hulls, through the C API: each comes to rest on its support, which carries its weight.
#include "c_scene.hpp"

namespace {

struct CShapes : CScene {
  // The impulse of all contacts upwards over a step's weight of a body of 1 kg.
  double carried(int dim, double h) {
    double up = 0;
    const auto impulse = contact("impulse");
    for (std::size_t i = std::size_t(dim) - 1; i < impulse.size(); i += std::size_t(dim)) up += impulse[i];
    return std::abs(up) / (9.81 * h);
  }
};

TEST_F(CShapes, polygons_rest) {
  make(2);
  floor(2);
  const double corner[] = {-0.5, -0.5, 0.5, -0.5, 0.5, 0.5, -0.5, 0.5};
  const int64_t first_vertex[] = {0, 4};
  int32_t number = -1;
  ASSERT_EQ(cairn_scene_add_polygons(scene, 1, first_vertex, corner, &number, &error), 0) << error.message;
  EXPECT_EQ(number, 0);
  const int64_t block = body({0, 0.5});
  const int32_t none = 7;
  EXPECT_REFUSED(cairn_scene_add_hull_contactors(scene, "polygon", 1, &block, &rock, &none, nullptr, nullptr, &error),
                 "hull[0]");
  EXPECT_REFUSED(cairn_scene_add_round_hulls(scene, "capsule", 1, corner, &number, &error), "3D");
  hull("polygon", block, 0);
  start();
  steps(20);
  EXPECT_EQ(cairn_simulation_contacts(simulation), 2);
  EXPECT_NEAR(carried(2, 1e-3), 1, 1e-6);
}

TEST_F(CShapes, polyhedra_and_round_hulls_rest) {
  make(3);
  floor(3);
  std::vector<double> corner;
  for (int z = -1; z < 2; z += 2)
    for (int y = -1; y < 2; y += 2)
      for (int x = -1; x < 2; x += 2) corner.insert(corner.end(), {0.5 * x, 0.5 * y, 0.5 * z});
  const int64_t vertices[] = {0, 8}, faces[] = {0, 6}, corners[] = {0, 4, 8, 12, 16, 20, 24};
  const int64_t loops[] = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
  int32_t box = -1, round[3] = {-1, -1, -1};
  ASSERT_EQ(cairn_scene_add_polyhedra(scene, 1, vertices, corner.data(), faces, corners, loops, &box, &error), 0)
      << error.message;
  const double axial[] = {0.5, 1}, thin[] = {0, 1}, super[] = {0.5, 0.5, 0.5, 1, 1};
  ASSERT_EQ(cairn_scene_add_round_hulls(scene, "capsule", 1, axial, &round[0], &error), 0) << error.message;
  ASSERT_EQ(cairn_scene_add_round_hulls(scene, "cylinder", 1, axial, &round[1], &error), 0) << error.message;
  ASSERT_EQ(cairn_scene_add_round_hulls(scene, "superquadric", 1, super, &round[2], &error), 0) << error.message;
  EXPECT_REFUSED(cairn_scene_add_round_hulls(scene, "cylinder", 1, thin, &round[0], &error), "number 0");
  EXPECT_REFUSED(cairn_scene_add_round_hulls(scene, "cone", 1, axial, &round[0], &error), "cone");
  hull("polyhedron", body({0, 0, 0.5}), box);
  hull("capsule", body({5, 0, 1}), round[0]);
  hull("cylinder", body({10, 0, 0.5}), round[1]);
  hull("superquadric", body({15, 0, 0.5}), round[2]);
  start();
  steps(20);
  EXPECT_NEAR(carried(3, 1e-3), 4, 1e-3);
  const auto velocity = field("velocity");
  for (int i = 1; i < 5; ++i) EXPECT_NEAR(velocity[6 * std::size_t(i) + 2], 0, 1e-5) << i;
}

TEST_F(CShapes, a_surface_carries_a_ball_over_an_edge) {
  make(3);
  const int64_t ground = body({0, 0, -1}, infinite, infinite), grain = body({0, 0, 0.25});
  // two triangles, with the vertices of the second given again: equal vertices are merged
  const double vertex[] = {-1, -1, 1, 1, -1, 1, 1, 1, 1, -1, -1, 1, 1, 1, 1, -1, 1, 1};
  const int32_t triangle[] = {0, 1, 2, 3, 4, 5}, wrong[] = {0, 1, 9};
  EXPECT_REFUSED(cairn_scene_add_surface(scene, ground, rock, 6, vertex, 1, wrong, &error), "vertex 9");
  ASSERT_EQ(cairn_scene_add_surface(scene, ground, rock, 6, vertex, 2, triangle, &error), 0) << error.message;
  ball(3, grain, 0.25, rock);
  start();
  steps(20);
  EXPECT_EQ(cairn_simulation_contacts(simulation), 1); // of the two triangles one counts
  EXPECT_NEAR(carried(3, 1e-3), 1, 1e-6);
}

} // namespace
