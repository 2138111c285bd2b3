// Drives, servo walls, cells and probes of the C API, by functions of time as text; the same calls in Fortran.
#include "c_scene.hpp"

extern "C" void cairn_fortran_controls(double* velocity, double* force, int32_t* refused);

namespace {

using CControls = CScene;

TEST_F(CControls, bodies_are_driven_and_read_by_text) {
  make(2);
  const int64_t one = body({0, 0}), two = body({5, 0}, 2);
  start();
  const double still[] = {0, 0, 0}, down[] = {0, -3};
  ASSERT_EQ(cairn_simulation_set_gravity(simulation, still, &error), 0);
  ASSERT_EQ(cairn_simulation_drive_by(simulation, 1, &one, "vx", "2*t", &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_set_servo(simulation, two, down, "table(t, 0, 10, 1, 20)", "0.5", 1, &error), 0)
      << error.message;
  int32_t velocity = -1, force = -1;
  ASSERT_EQ(cairn_simulation_add_probe(simulation, "velocity.x", 1, &one, nullptr, 1, &velocity, &error), 0)
      << error.message;
  ASSERT_EQ(cairn_simulation_add_probe(simulation, "force.y", 1, &two, "sum", 2, &force, &error), 0) << error.message;
  steps(5, 0.1);
  double times[5], values[5];
  int64_t count = 0;
  ASSERT_EQ(cairn_simulation_read_probe(simulation, velocity, 5, times, values, &count, &error), 0);
  ASSERT_EQ(count, 5);
  for (int k = 0; k < 5; ++k) EXPECT_NEAR(values[k], 2 * 0.1 * (k + 1), 1e-14);
  ASSERT_EQ(cairn_simulation_read_probe(simulation, force, 5, times, values, &count, &error), 0);
  ASSERT_EQ(count, 2);
  for (int k = 0; k < 2; ++k) {
    EXPECT_NEAR(times[k], 0.2 * (k + 1), 1e-14);
    EXPECT_NEAR(values[k], -0.5 * (10 + 10 * (times[k] - 0.05)), 1e-12); // in the middle of the step
  }
  const double stop[] = {0, 0, 0};
  ASSERT_EQ(cairn_simulation_drive(simulation, 1, &one, 1, stop, &error), 0);
  steps(1, 0.1);
  EXPECT_NEAR(field("velocity")[0], 0, 0);
  EXPECT_REFUSED(cairn_simulation_drive_by(simulation, 1, &one, "vz", "1", &error), "vx, vy or w");
  EXPECT_REFUSED(cairn_simulation_drive_by(simulation, 1, &one, "vx", "2*", &error), "its end");
  EXPECT_REFUSED(cairn_simulation_press_cell(simulation, "xx", "1", &error), "not periodic");
  EXPECT_REFUSED(cairn_simulation_read_probe(simulation, 7, 0, nullptr, nullptr, &count, &error), "no probe 7");
  ASSERT_EQ(cairn_simulation_drive_by(simulation, 1, &one, "vx", "sqrt(-1 - t)", &error), 0);
  EXPECT_REFUSED(cairn_simulation_step(simulation, 0.1, nullptr, &error), "give a function that is finite");
}

TEST_F(CControls, fortran_has_the_same_calls) {
  double velocity[5], force[5];
  int32_t refused = 0;
  cairn_fortran_controls(velocity, force, &refused);
  EXPECT_EQ(refused, 1);
  for (int k = 0; k < 5; ++k) {
    EXPECT_NEAR(velocity[k], 2 * 0.1 * (k + 1), 1e-14);
    EXPECT_NEAR(force[k], -0.5 * (10 + 10 * (0.1 * (k + 1) - 0.05)), 1e-12);
  }
}

TEST_F(CControls, a_cell_follows_a_stress_along_one_axis_and_a_rate_along_the_other) {
  make(2, 0.3);
  const double lengths[] = {0.3, 0.2}, still[] = {0, 0, 0}, radius = 0.05;
  ASSERT_EQ(cairn_scene_set_cell(scene, lengths, nullptr, 0, 0, &error), 0) << error.message;
  ASSERT_EQ(cairn_scene_set_gravity(scene, still, &error), 0);
  for (int k = 0; k < 3; ++k) ball(2, body({radius * (2 * k + 1), 0.1}), radius, rock);
  start();
  ASSERT_EQ(cairn_simulation_press_cell(simulation, "xx", "500", &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_drive_cell(simulation, "yy", "0.5", &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_weigh_cell(simulation, 1, 2, 0, &error), 0) << error.message;
  steps(50);
  double vectors[4], rate[4], stress[4];
  ASSERT_EQ(cairn_simulation_cell(simulation, vectors, rate, stress, &error), 0);
  EXPECT_NEAR(stress[0], 500, 1);
  EXPECT_NEAR(rate[3], 0.5, 0);
  EXPECT_NEAR(vectors[3], 0.2 * std::exp(0.5 * 0.05), 1e-5);
  EXPECT_NEAR(vectors[0], 0.3, 1e-5); // tol leaves as much
}

} // namespace
