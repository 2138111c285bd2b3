// Surface velocities through the C API.
#include "c_scene.hpp"

namespace {

using CBelts = CScene;

TEST_F(CBelts, belts_drag_by_friction) {
  for (int dim = 2; dim <= 3; ++dim) {
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    simulation = nullptr;
    make(dim, 0.5);
    floor(dim);
    const std::size_t dofs = dim == 2 ? 3 : 6;
    std::vector<double> belt(2 * dofs, 0.0), place(std::size_t(dim), 0.0);
    place.back() = 0.5;
    ball(dim, body(place), 0.5, rock);
    belt[0] = 3;
    ASSERT_EQ(cairn_scene_set_body_field(scene, "surface_velocity", 2, nullptr, belt.data(), &error), 0)
        << error.message;
    start();
    steps(10);
    EXPECT_NEAR(field("velocity")[dofs], 0.5 * 9.81 * 0.01, 1e-9);
    EXPECT_NEAR(energy("work_driven"), 0.5 * 9.81 * 3 * 0.01, 1e-9);
    EXPECT_NEAR(field("surface_velocity")[0], 3, 0);
    belt[0] = 0; // it stops, and the ball is slowed as much
    const int64_t first = 0;
    ASSERT_EQ(cairn_simulation_set_body_field(simulation, "surface_velocity", 1, &first, belt.data(), &error), 0)
        << error.message;
    const double before = energy("work_driven");
    steps(2);
    EXPECT_LT(field("velocity")[dofs], 0.5 * 9.81 * 0.01);
    EXPECT_NEAR(energy("work_driven"), before, 1e-12);
    belt[0] = infinite;
    EXPECT_REFUSED(cairn_simulation_set_body_field(simulation, "surface_velocity", 1, &first, belt.data(), &error),
                   "surface_velocity");
  }
}

} // namespace
