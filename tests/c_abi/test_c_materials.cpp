// Materials of the program's own, UMATs, through the C API: tests/python/umat.f90, Hooke's law or plasticity, linked
// here.
#include <cmath>

#include "c_scene.hpp"

extern "C" void umat_(void);

namespace {

struct CMaterials : CScene {
  cairn_mesh* mesh = nullptr;
  ~CMaterials() override { cairn_mesh_destroy(mesh); }
  // Two squares side by side, held on the left, drawn on the right at a speed.
  void bar(const char* material, std::vector<double> values, const char* const* names, double speed) {
    const double place[] = {0, 0, 1, 0, 2, 0, 0, 1, 1, 1, 2, 1};
    const int32_t cell[] = {0, 1, 4, 3, 1, 2, 5, 4}, left[] = {0, 3}, right[] = {2, 5};
    cairn_mesh_destroy(mesh);
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    mesh = nullptr;
    simulation = nullptr;
    scene = nullptr;
    make(2);
    const double none[2] = {};
    ASSERT_EQ(cairn_scene_set_gravity(scene, none, &error), 0);
    ASSERT_EQ(cairn_mesh_create(2, 6, place, &mesh, &error), 0);
    ASSERT_EQ(cairn_mesh_add_solid_cells(mesh, "q4", 2, cell, material, int32_t(values.size()), names, values.data(),
                                         1e-3, "small", "strain", 0, 1, &error),
              0)
        << error.message;
    ASSERT_EQ(cairn_mesh_hold(mesh, 2, left, 3, &error), 0);
    ASSERT_EQ(cairn_mesh_hold(mesh, 2, right, 1, &error), 0);
    ASSERT_EQ(cairn_scene_add_mesh(scene, mesh, "bar", rock, -1, nullptr, nullptr, &error), 0) << error.message;
    start();
    ASSERT_EQ(cairn_simulation_set_number(simulation, "newton_tol", 1e-12, &error), 0) << error.message;
    double held[12] = {};
    held[4] = held[10] = speed;
    ASSERT_EQ(cairn_simulation_load_mesh(simulation, 0, nullptr, nullptr, held, &error), 0) << error.message;
  }
  std::vector<double> displacement() {
    std::vector<double> u(12);
    int64_t n = 0;
    EXPECT_EQ(cairn_simulation_mesh_field(simulation, 0, "displacement", 12, u.data(), &n, &error), 0);
    return u;
  }
};

TEST_F(CMaterials, a_umat_of_the_program_is_the_material_of_the_list) {
  ASSERT_EQ(cairn_give_material("two_in_one", umat_, 1, &error), 0) << error.message;
  const char* const names[] = {"young", "poisson", "yield_stress"};
  for (const double yield : {0.0, 2.0}) {
    bar("two_in_one", {300, 0.3, yield}, nullptr, 0.5);
    steps(40, 1e-3);
    const auto u = displacement();
    const double spent = energy("dissipated_material");
    EXPECT_EQ(text("status"), "converged");
    if (yield > 0)
      bar("j2_plasticity", {300, 0.3, yield}, names, 0.5);
    else
      bar("isotropic_elastic", {300, 0.3}, names, 0.5);
    steps(40, 1e-3);
    const auto other = displacement();
    for (std::size_t i = 0; i < u.size(); ++i) EXPECT_NEAR(u[i] / u[4], other[i] / u[4], 1e-9);
    EXPECT_EQ(spent > 1e-2 * energy("in_play"), yield > 0);
    EXPECT_NEAR(spent, energy("dissipated_material"), 1e-9 * energy("in_play"));
  }
}

TEST_F(CMaterials, what_a_umat_refuses_is_told_and_undone) {
  ASSERT_EQ(cairn_give_material("two_in_one", umat_, 1, &error), 0) << error.message;
  bar("two_in_one", {300, 0.3, 0}, nullptr, 0.5);
  steps(5, 1e-3);
  const auto before = displacement();
  double held[12] = {}; // beyond half of strain it calls XIT
  held[4] = held[10] = 2000;
  ASSERT_EQ(cairn_simulation_load_mesh(simulation, 0, nullptr, nullptr, held, &error), 0);
  EXPECT_EQ(cairn_simulation_step(simulation, 1e-3, nullptr, &error), cairn_wrong_input);
  const std::string said = error.message;
  for (const char* word : {"bar", "quad cell", "two_in_one finds no finite stress"})
    EXPECT_NE(said.find(word), std::string::npos) << said;
  EXPECT_EQ(displacement(), before);
  held[4] = held[10] = 0.2;
  ASSERT_EQ(cairn_simulation_load_mesh(simulation, 0, nullptr, nullptr, held, &error), 0);
  steps(5, 1e-3);
  // a property that is no number
  const double nan = std::nan("");
  const double place[] = {0, 0, 1, 0, 1, 1, 0, 1}, props[] = {nan, 0.3, 0};
  const int32_t cell[] = {0, 1, 2, 3};
  cairn_mesh* wrong = nullptr;
  ASSERT_EQ(cairn_mesh_create(2, 4, place, &wrong, &error), 0);
  ASSERT_EQ(cairn_mesh_add_solid_cells(wrong, "q4", 1, cell, "two_in_one", 3, nullptr, props, 1, "small", "strain", 0,
                                       1, &error),
            0)
      << error.message;
  EXPECT_REFUSED(cairn_scene_add_mesh(scene, wrong, "wrong", rock, -1, nullptr, nullptr, &error),
                 "quad cell 0 with nodes");
  cairn_mesh_destroy(wrong);
}

TEST_F(CMaterials, what_is_missing_is_told) {
  EXPECT_REFUSED(cairn_give_material("none", nullptr, 0, &error), "routine is NULL");
  EXPECT_REFUSED(cairn_give_material("j2_plasticity", umat_, 0, &error), "is a material of the list");
  EXPECT_REFUSED(cairn_give_material("", umat_, 0, &error), "1 to 80 characters");
  EXPECT_REFUSED(cairn_give_material("two_in_one", umat_, -1, &error), "-1 states");
  EXPECT_REFUSED(cairn_plug_material("./no_such_library.so", "none", nullptr, 0, &error), "cannot be loaded");
  const double place[] = {0, 0, 1, 0, 1, 1, 0, 1}, values[] = {1, 0.3};
  const int32_t cell[] = {0, 1, 2, 3};
  ASSERT_EQ(cairn_mesh_create(2, 4, place, &mesh, &error), 0);
  EXPECT_REFUSED(cairn_mesh_add_solid_cells(mesh, "q4", 1, cell, "neo_hookean", 2, nullptr, values, 1, "small",
                                            "strain", 0, 1, &error),
                 "names is NULL");
}

} // namespace
