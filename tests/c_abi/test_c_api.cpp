// The C API: every wrong call returns a code and a message that names the fault, and leaves its object unchanged.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "cairn/build.h"
#include "cairn/cairn.h"

extern "C" int cairn_headers_are_c(void);
extern "C" void cairn_fortran_defaults(cairn_nscd* options);

namespace {

const double infinite = std::numeric_limits<double>::infinity();
const double not_a_number = std::numeric_limits<double>::quiet_NaN();

// A floor (body 0) and disks in a row above it.
struct Pile : testing::Test {
  cairn_error error{};
  cairn_scene* scene = nullptr;
  cairn_simulation* simulation = nullptr;
  int32_t rock = -1;
  int64_t disks = 4;
  double origin[2] = {0, 0};

  ~Pile() override {
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
  }

  void build() {
    const double gravity[] = {0, -9.81}, mu[] = {0.3}, up[] = {0, 1, 0}, mass[] = {infinite};
    const double floor_at[] = {origin[0], origin[1]};
    ASSERT_EQ(cairn_scene_create(2, &scene, &error), 0);
    ASSERT_EQ(cairn_scene_set_origin(scene, origin, &error), 0);
    ASSERT_EQ(cairn_scene_set_gravity(scene, gravity, &error), 0);
    ASSERT_EQ(cairn_scene_add_material(scene, "rock", &rock, &error), 0);
    ASSERT_EQ(cairn_scene_set_law(scene, -1, -1, "signorini_coulomb", 1, mu, &error), 0) << error.message;
    int64_t first = -1;
    ASSERT_EQ(cairn_scene_add_bodies(scene, 1, floor_at, nullptr, nullptr, mass, mass, &first, &error), 0);
    ASSERT_EQ(cairn_scene_add_contactors(scene, "half_plane", 1, &first, &rock, nullptr, nullptr, up, nullptr, &error),
              0)
        << error.message;
    std::vector<double> position, masses(disks, 2.0), inertia(disks, 0.25), radius(disks, 0.5);
    std::vector<int64_t> ids(disks);
    for (int64_t i = 0; i < disks; ++i) position.insert(position.end(), {origin[0] + 2.0 * i, origin[1] + 0.5});
    ASSERT_EQ(cairn_scene_add_bodies(scene, disks, position.data(), nullptr, nullptr, masses.data(), inertia.data(),
                                     &first, &error),
              0);
    for (int64_t i = 0; i < disks; ++i) ids[i] = first + i;
    const std::vector<int32_t> material(disks, rock);
    ASSERT_EQ(cairn_scene_add_contactors(scene, "disk", disks, ids.data(), material.data(), radius.data(), nullptr,
                                         nullptr, nullptr, &error),
              0);
  }

  void start() { ASSERT_EQ(cairn_simulation_create(scene, nullptr, &simulation, &error), 0) << error.message; }

  std::vector<double> field(const char* name) {
    int64_t count = -1;
    EXPECT_EQ(cairn_simulation_body_field(simulation, name, 0, nullptr, &count, &error), 0) << error.message;
    std::vector<double> values(count);
    EXPECT_EQ(cairn_simulation_body_field(simulation, name, count, values.data(), &count, &error), 0) << error.message;
    return values;
  }
};

#define EXPECT_REFUSED(call, word)                                                                                     \
  EXPECT_EQ(call, cairn_wrong_input);                                                                                  \
  EXPECT_EQ(error.code, cairn_wrong_input);                                                                            \
  EXPECT_NE(std::string(error.message).find(word), std::string::npos) << error.message

TEST(CApi, headers_are_c_and_tell_their_version) {
  EXPECT_TRUE(cairn_headers_are_c());
  EXPECT_STREQ(cairn_version(), CAIRN_VERSION);
}

TEST(CApi, fortran_and_c_have_the_same_defaults) {
  cairn_nscd c, fortran;
  cairn_nscd_defaults(&c);
  cairn_fortran_defaults(&fortran);
  EXPECT_EQ(c.theta, fortran.theta);
  EXPECT_EQ(c.tolerance, fortran.tolerance);
  EXPECT_EQ(c.min_iterations, fortran.min_iterations);
  EXPECT_EQ(c.max_iterations, fortran.max_iterations);
  EXPECT_EQ(c.threads, fortran.threads);
  EXPECT_EQ(c.warm_start, fortran.warm_start);
  EXPECT_EQ(c.project_positions, fortran.project_positions);
  EXPECT_EQ(c.margin, fortran.margin);
}

TEST_F(Pile, carries_its_weight) {
  build();
  start();
  cairn_report report;
  for (int i = 0; i < 20; ++i) ASSERT_EQ(cairn_simulation_step(simulation, 1e-3, &report, &error), 0) << error.message;
  EXPECT_EQ(report.step, 20);
  EXPECT_EQ(report.status, cairn_converged);
  EXPECT_EQ(report.contacts, disks);
  EXPECT_NEAR(report.time, 0.02, 1e-15);
  std::vector<double> gap(disks), normal(2 * disks), point(2 * disks), impulse(2 * disks);
  std::vector<int64_t> bodies(2 * disks);
  ASSERT_EQ(cairn_simulation_contacts(simulation), disks);
  ASSERT_EQ(cairn_simulation_contact_arrays(simulation, bodies.data(), gap.data(), normal.data(), point.data(),
                                            impulse.data(), &error),
            0);
  for (int64_t i = 0; i < disks; ++i) {
    EXPECT_NEAR(impulse[2 * i + 1], 2 * 9.81 * 1e-3, 1e-14);
    EXPECT_EQ(bodies[2 * i + 1], 0);
    EXPECT_EQ(normal[2 * i + 1], 1.0);
    EXPECT_NEAR(point[2 * i], 2.0 * double(bodies[2 * i] - 1), 1e-12);
  }
}

TEST_F(Pile, positions_are_absolute_whatever_the_origin) {
  origin[0] = 1048576.0;
  origin[1] = -2048.0;
  build();
  start();
  const auto position = field("position");
  ASSERT_EQ(position.size(), std::size_t(2 * (disks + 1)));
  for (int64_t i = 0; i < disks; ++i) {
    EXPECT_EQ(position[2 * (i + 1)], origin[0] + 2.0 * double(i));
    EXPECT_EQ(position[2 * (i + 1) + 1], origin[1] + 0.5);
  }
}

TEST_F(Pile, driven_floor_lifts_all) {
  build();
  start();
  const int64_t floor_id = 0;
  const double velocity[] = {0, 0.25, 0};
  ASSERT_EQ(cairn_simulation_drive(simulation, 1, &floor_id, 7, velocity, &error), 0) << error.message;
  for (int i = 0; i < 10; ++i) ASSERT_EQ(cairn_simulation_step(simulation, 1e-3, nullptr, &error), 0) << error.message;
  const auto v = field("velocity");
  for (int64_t i = 0; i <= disks; ++i) EXPECT_NEAR(v[3 * i + 1], 0.25, 1e-12);
}

TEST_F(Pile, wrong_calls_are_refused_by_name) {
  cairn_scene* none = nullptr;
  EXPECT_REFUSED(cairn_scene_create(5, &none, &error), "dim is 5");
  EXPECT_EQ(none, nullptr);
  EXPECT_REFUSED(cairn_scene_create(2, nullptr, &error), "NULL");
  build();
  const double position[] = {0, 5}, mass[] = {1}, zero[] = {0}, mu[] = {0.5}, wrong_mu[] = {-0.5};
  const double lost[] = {not_a_number, 0};
  int32_t number = 0;
  const int64_t nobody = 99, floor_id = 0;
  EXPECT_REFUSED(cairn_scene_set_gravity(scene, lost, &error), "gravity[0]");
  EXPECT_REFUSED(cairn_scene_add_material(scene, "rock", &number, &error), "rock");
  EXPECT_REFUSED(cairn_scene_set_law(scene, 0, 7, "Coulomb", 1, mu, &error), "7");
  EXPECT_REFUSED(cairn_plug_contact_law("libnone.so", "mine", 0, &error), "libnone.so");
  EXPECT_REFUSED(cairn_scene_set_law(scene, 0, 0, "Glue", 1, mu, &error), "Glue");
  EXPECT_REFUSED(cairn_scene_set_law(scene, 0, 0, "Coulomb", 1, wrong_mu, &error), "mu");
  EXPECT_REFUSED(cairn_scene_add_bodies(scene, 1, position, nullptr, nullptr, zero, mass, nullptr, &error), "mass");
  EXPECT_REFUSED(cairn_scene_add_bodies(scene, 1, lost, nullptr, nullptr, mass, mass, nullptr, &error), "position");
  EXPECT_REFUSED(cairn_scene_add_bodies(scene, -1, position, nullptr, nullptr, mass, mass, nullptr, &error), "-1");
  EXPECT_REFUSED(
      cairn_scene_add_contactors(scene, "cube", 1, &floor_id, &rock, mass, nullptr, nullptr, nullptr, &error), "cube");
  EXPECT_REFUSED(cairn_scene_add_contactors(scene, "disk", 1, &nobody, &rock, mass, nullptr, nullptr, nullptr, &error),
                 "99");
  EXPECT_REFUSED(cairn_scene_drive(scene, 1, &nobody, 7, nullptr, &error), "99");
  // nothing of it stays
  start();
  EXPECT_EQ(cairn_simulation_bodies(simulation), disks + 1);
  EXPECT_REFUSED(cairn_simulation_step(simulation, 0, nullptr, &error), "0");
  EXPECT_REFUSED(cairn_simulation_step(simulation, not_a_number, nullptr, &error), "nan");
  EXPECT_EQ(cairn_simulation_step(simulation, -1, nullptr, nullptr), cairn_wrong_input); // error is optional
  int64_t count = 0;
  EXPECT_REFUSED(cairn_simulation_body_field(simulation, "colour", 0, nullptr, &count, &error), "colour");
  EXPECT_REFUSED(cairn_simulation_body_field(simulation, "velocty", 0, nullptr, &count, &error),
                 "they have id, position,");
  EXPECT_EQ(cairn_simulation_step(simulation, 1e-3, nullptr, &error), 0) << error.message;
  EXPECT_EQ(error.code, 0);
}

TEST_F(Pile, options_out_of_range_are_refused) {
  build();
  cairn_nscd options;
  cairn_nscd_defaults(&options);
  options.theta = 0.4;
  EXPECT_REFUSED(cairn_simulation_create(scene, &options, &simulation, &error), "theta");
  cairn_nscd_defaults(&options);
  options.tolerance = 0;
  EXPECT_REFUSED(cairn_simulation_create(scene, &options, &simulation, &error), "tol");
  EXPECT_EQ(simulation, nullptr);
}

TEST_F(Pile, a_field_that_does_not_fit_is_not_written) {
  build();
  start();
  double values[2] = {-7, -7};
  int64_t count = 0;
  EXPECT_EQ(cairn_simulation_body_field(simulation, "position", 2, values, &count, &error), 0);
  EXPECT_EQ(count, 2 * (disks + 1));
  EXPECT_EQ(values[0], -7);
  EXPECT_TRUE(field("damping").empty()); // nobody asked for damping
}

} // namespace
