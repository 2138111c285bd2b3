// Deformable bodies in C beyond cells and contacts: rigid parts, ties, pressures, reactions, stresses of
// cells.
#include <cmath>

#include "c_scene.hpp"

namespace {

// Two cells side by side on (0, 0), (2, 1); nodes 0, 1, 2 below and 3, 4, 5 above.
struct CSolids : CScene {
  cairn_mesh* mesh = nullptr;
  int32_t number = -1;
  ~CSolids() override { cairn_mesh_destroy(mesh); }
  void two_cells(const char* material, int32_t count, const char* const* names, const double* values,
                 const char* kinematics) {
    const double place[] = {0, 0, 1, 0, 2, 0, 0, 1, 1, 1, 2, 1};
    const int32_t cell[] = {0, 1, 4, 3, 1, 2, 5, 4};
    make(2);
    const double weightless[] = {0, 0};
    ASSERT_EQ(cairn_scene_set_gravity(scene, weightless, &error), 0);
    ASSERT_EQ(cairn_mesh_create(2, 6, place, &mesh, &error), 0) << error.message;
    ASSERT_EQ(cairn_mesh_add_solid_cells(mesh, "q4", 2, cell, material, count, names, values, 1000, kinematics,
                                         "strain", 0, 1, &error),
              0)
        << error.message;
  }
  void rubber() {
    const char* names[] = {"young", "poisson"};
    const double values[] = {1e5, 0.3};
    two_cells("neo_hookean", 2, names, values, "total_lagrangian");
  }
  void hold(std::vector<int32_t> nodes, uint8_t mask) {
    ASSERT_EQ(cairn_mesh_hold(mesh, int64_t(nodes.size()), nodes.data(), mask, &error), 0) << error.message;
  }
  void begin() {
    ASSERT_EQ(cairn_scene_add_mesh(scene, mesh, "block", rock, -1, nullptr, &number, &error), 0) << error.message;
    start();
    ASSERT_EQ(cairn_simulation_set_number(simulation, "theta", 1, &error), 0) << error.message;
    ASSERT_EQ(cairn_simulation_set_number(simulation, "newton_tol", 1e-12, &error), 0) << error.message;
  }
  std::vector<double> nodes(const char* name) {
    std::vector<double> out(12);
    int64_t n = 0;
    EXPECT_EQ(cairn_simulation_mesh_field(simulation, number, name, 12, out.data(), &n, &error), 0) << error.message;
    return out;
  }
  std::vector<double> cells(const char* name) {
    int64_t n = 0;
    EXPECT_EQ(cairn_simulation_mesh_cells(simulation, number, name, 0, nullptr, &n, &error), 0) << error.message;
    std::vector<double> out(n);
    EXPECT_EQ(cairn_simulation_mesh_cells(simulation, number, name, n, out.data(), &n, &error), 0) << error.message;
    return out;
  }
};

TEST_F(CSolids, pressure_follows_and_reactions_hold_it) {
  rubber();
  hold({0, 3}, 1);
  hold({0}, 2);
  begin();
  const int32_t right[] = {2, 5};
  int32_t set = -1;
  ASSERT_EQ(cairn_simulation_press_mesh(simulation, number, 2, 1, right, &set, &error), 0) << error.message;
  ASSERT_EQ(set, 0);
  const double p = 3e3;
  ASSERT_EQ(cairn_simulation_set_pressure(simulation, number, set, p, p, &error), 0) << error.message;
  steps(300, 0.1);
  EXPECT_EQ(text("status"), "converged");
  const auto x = nodes("position"), reaction = nodes("reaction"), stress = cells("stress");
  EXPECT_LT(x[4], 2 - 0.02);
  EXPECT_NEAR((reaction[0] + reaction[6]) / (p * (x[11] - x[5])), 1, 1e-7); // it presses the height that there is now
  EXPECT_NEAR(reaction[4], 0, 0);                                           // nothing holds this one
  ASSERT_EQ(stress.size(), 12u);
  for (const std::size_t cell : {0, 1}) {
    EXPECT_NEAR(stress[6 * cell] / p, -1, 1e-7);
    EXPECT_NEAR(stress[6 * cell + 1] / p, 0, 1e-7);
    EXPECT_LT(stress[6 * cell + 2], -0.2 * p); // across the plane
  }
  EXPECT_EQ(cairn_simulation_set_pressure(simulation, number, 1, p, p, &error), cairn_wrong_input);
  EXPECT_EQ(cairn_simulation_press_mesh(simulation, number, 4, 1, right, &set, &error), cairn_wrong_input);
  int64_t n = 0;
  EXPECT_EQ(cairn_simulation_mesh_cells(simulation, number, "damage", 0, nullptr, &n, &error), cairn_wrong_input);
  EXPECT_NE(std::string(error.message).find("they have stress"), std::string::npos) << error.message;
}

TEST_F(CSolids, states_of_cells_are_told) {
  const char* names[] = {"young", "poisson", "yield_stress", "isotropic"};
  const double values[] = {2e5, 0.3, 100, 1e3};
  two_cells("j2_plasticity", 4, names, values, "small");
  hold({0, 3}, 3);
  hold({2, 5}, 1);
  begin();
  double held[12] = {0};
  held[4] = held[10] = 0.1;
  ASSERT_EQ(cairn_simulation_load_mesh(simulation, number, nullptr, nullptr, held, &error), 0) << error.message;
  steps(20, 1e-2);
  const auto plastic = cells("accumulated_plastic_strain");
  ASSERT_EQ(plastic.size(), 2u);
  EXPECT_GT(plastic[1], 1e-3);
  const auto pull = nodes("reaction");
  EXPECT_GT(pull[4] + pull[10], 0);
}

TEST_F(CSolids, rigid_parts_turn_and_tied_nodes_follow) {
  rubber();
  const int32_t right[] = {2, 5}, ends[] = {3, 5};
  const double half[] = {0.5, 0.5};
  double speed[12] = {0};
  for (int i = 0; i < 6; ++i) speed[2 * i] = i < 3 ? 1 : -1, speed[2 * i + 1] = i % 3 - 1;
  ASSERT_EQ(cairn_mesh_set_rigid(mesh, 2, right, &error), 0) << error.message;
  EXPECT_EQ(cairn_mesh_set_rigid(mesh, 1, right, &error), cairn_wrong_input);
  ASSERT_EQ(cairn_mesh_set_motion(mesh, nullptr, speed, &error), 0);
  begin();
  steps(200, 5e-3);
  const auto x = nodes("position");
  EXPECT_NEAR(std::hypot(x[4] - x[10], x[5] - x[11]), 1, 1e-9);
  EXPECT_GT(std::abs(x[4] - x[10]), 0.3); // it has turned

  cairn_simulation_destroy(simulation);
  simulation = nullptr;
  cairn_scene_destroy(scene);
  scene = nullptr;
  cairn_mesh_destroy(mesh);
  mesh = nullptr;
  rubber();
  EXPECT_EQ(cairn_mesh_tie_node(mesh, 9, 2, ends, half, &error), cairn_wrong_input);
  ASSERT_EQ(cairn_mesh_tie_node(mesh, 4, 2, ends, half, &error), 0) << error.message;
  ASSERT_EQ(cairn_mesh_set_motion(mesh, nullptr, speed, &error), 0);
  begin();
  steps(20, 5e-3);
  const auto u = nodes("displacement");
  for (int k = 0; k < 2; ++k) EXPECT_NEAR(u[8 + k], 0.5 * (u[6 + k] + u[10 + k]), 1e-12);
  EXPECT_GT(std::abs(u[8]), 1e-3);
}

} // namespace
