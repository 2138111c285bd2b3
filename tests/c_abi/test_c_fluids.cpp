// A liquid by the C API: water at rest weighs what it weighs, drag lets a grain sink, wrong calls are refused by name.
#include <algorithm>
#include <filesystem>

#include "c_scene.hpp"
#include "cairn/fluids.h"

namespace {

struct CFluid : CScene {
  cairn_fluid_settings water{};
  void SetUp() override {
    cairn_fluid_defaults(&water);
    water.spacing = 0.05;
  }
  // A basin of 1 m with `high` rows of water.
  void basin(int high, std::vector<double>& place) {
    make(2);
    floor(2);
    const double sides[2][3] = {{1, 0, 0}, {-1, 0, 0}};
    for (int k = 0; k < 2; ++k) {
      const int64_t id = body({double(k), 0}, infinite, infinite);
      ASSERT_EQ(
          cairn_scene_add_contactors(scene, "half_plane", 1, &id, &rock, nullptr, nullptr, sides[k], nullptr, &error),
          0);
    }
    for (int i = 0; i < 20; ++i)
      for (int j = 0; j < high; ++j) {
        place.push_back((i + 0.5) * 0.05);
        place.push_back((j + 0.5) * 0.05);
      }
  }
  int64_t particles(const std::vector<double>& place) { return int64_t(place.size() / 2); }
  double number(const char* name) {
    double value = -1;
    EXPECT_EQ(cairn_simulation_fluid_number(simulation, name, &value, &error), 0) << error.message;
    return value;
  }
  std::vector<double> particle_field(const char* name) {
    int64_t count = -1;
    EXPECT_EQ(cairn_simulation_fluid_field(simulation, name, 0, nullptr, &count, &error), 0) << error.message;
    std::vector<double> values(static_cast<std::size_t>(count));
    EXPECT_EQ(cairn_simulation_fluid_field(simulation, name, count, values.data(), &count, &error), 0);
    return values;
  }
};

TEST_F(CFluid, water_at_rest_bears_on_the_floor_with_its_weight) {
  for (const int32_t form : {0, 1}) {
    std::vector<double> place;
    basin(10, place);
    water.incompressible = form;
    ASSERT_EQ(cairn_scene_set_fluid(scene, &water, particles(place), place.data(), nullptr, nullptr, &error), 0);
    ASSERT_EQ(cairn_scene_set_fluid_rule(scene, "*", "free_slip", &error), 0);
    start();
    EXPECT_EQ(cairn_simulation_particles(simulation), 200);
    double force[3], sum = 0;
    for (int k = 0; k < 200; ++k) {
      steps(1, 2e-3);
      ASSERT_EQ(cairn_simulation_fluid_force(simulation, 0, force, &error), 0);
      if (k >= 100) sum += force[1] / 100;
    }
    EXPECT_NEAR(sum / (-1000 * 9.81 * 0.5), 1, 3e-3) << form;
    EXPECT_NEAR(number("volume"), 1, 0.05);
    const double at[] = {0.5, 0.1, 0.5, 3.0};
    double pressure[2], level[2];
    ASSERT_EQ(cairn_simulation_fluid_pressure(simulation, 2, at, pressure, &error), 0);
    ASSERT_EQ(cairn_simulation_fluid_level(simulation, 2, at, level, &error), 0);
    EXPECT_NEAR(pressure[0], 9810 * 0.4, 0.03 * 9810 * 0.5);
    EXPECT_EQ(pressure[1], 0);
    EXPECT_NEAR(level[0], 0.5, 5e-3);
    EXPECT_NEAR(level[0], level[1], 1e-12);
    EXPECT_EQ(particle_field("position").size(), 400u);
    double mass = 0;
    for (const double m : particle_field("mass")) mass += m;
    EXPECT_NEAR(mass, 500, 1e-9);
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    simulation = nullptr;
    scene = nullptr;
  }
}

TEST_F(CFluid, a_grain_sinks_by_drag_and_a_checkpoint_goes_on_to_the_same_bits) {
  std::vector<double> place;
  basin(10, place);
  const double radius = 0.01, area = std::acos(-1.0) * radius * radius;
  const int64_t grain = body({0.5, 0.3}, 2600 * area, 0.5 * 2600 * area * radius * radius);
  int32_t sand = -1;
  ASSERT_EQ(cairn_scene_add_material(scene, "sand", &sand, &error), 0);
  ball(2, grain, radius, sand);
  ASSERT_EQ(cairn_scene_set_fluid(scene, &water, particles(place), place.data(), nullptr, nullptr, &error), 0);
  ASSERT_EQ(cairn_scene_set_fluid_rule(scene, "sand", "di_felice", &error), 0);
  start();
  steps(60, 2e-3);
  const std::string file = (std::filesystem::temp_directory_path() / "cairn_c_fluid.checkpoint").string();
  ASSERT_EQ(cairn_simulation_write_checkpoint(simulation, file.c_str(), &error), 0) << error.message;
  const std::vector<double> before = field("position");
  EXPECT_LT(before[2 * std::size_t(grain) + 1], 0.295);
  EXPECT_GT(before[2 * std::size_t(grain) + 1], 0.3 - 0.5 * 9.81 * 0.12 * 0.12); // it falls less than freely
  steps(20, 2e-3);
  const std::vector<double> once = particle_field("velocity");
  cairn_simulation_destroy(simulation);
  simulation = nullptr;
  start();
  ASSERT_EQ(cairn_simulation_restart(simulation, file.c_str(), &error), 0) << error.message;
  steps(20, 2e-3);
  EXPECT_EQ(particle_field("velocity"), once);
  cairn_simulation_destroy(simulation);
  simulation = nullptr;
  ASSERT_EQ(cairn_scene_set_fluid(scene, &water, 0, nullptr, nullptr, nullptr, &error), 0);
  start();
  EXPECT_NE(cairn_simulation_restart(simulation, file.c_str(), &error), 0);
  EXPECT_NE(std::string(error.message).find("has a fluid"), std::string::npos) << error.message;
  std::filesystem::remove(file);
}

TEST_F(CFluid, wrong_calls_name_what_is_wrong) {
  std::vector<double> place;
  basin(2, place);
  const auto set = [&] {
    return cairn_scene_set_fluid(scene, &water, particles(place), place.data(), nullptr, nullptr, &error);
  };
  for (double cairn_fluid_settings::*member : {&cairn_fluid_settings::spacing, &cairn_fluid_settings::density,
                                               &cairn_fluid_settings::smoothing, &cairn_fluid_settings::depth})
    for (const double wrong : {0.0, -1.0, infinite, std::nan("")}) {
      const double was = water.*member;
      water.*member = wrong;
      EXPECT_REFUSED(set(), "of the fluid is");
      water.*member = was;
    }
  water.incompressible = 1, water.surface_tension = 0.07;
  EXPECT_REFUSED(set(), "surface_tension");
  water.incompressible = 0, water.surface_tension = 0;
  EXPECT_REFUSED(cairn_scene_set_fluid_rule(scene, "clay", "no_slip", &error), "clay");
  EXPECT_REFUSED(cairn_scene_set_fluid_rule(scene, "rock", "slip", &error), "free_slip");
  const double zero[2] = {0, 0}, up[2] = {0, 1}, two[2] = {0, 2}, one = 1;
  EXPECT_REFUSED(cairn_scene_add_fluid_points(scene, 77, 1, zero, up, &one, &one, &error), "77");
  EXPECT_REFUSED(cairn_scene_add_fluid_points(scene, 0, 1, zero, two, &one, &one, &error), "unit vector");
  EXPECT_REFUSED(cairn_scene_add_fluid_points(scene, 0, 1, zero, up, zero, &one, &error), "depth or volume");
  place[5] = infinite;
  EXPECT_REFUSED(set(), "position");
  place[5] = -0.5;
  ASSERT_EQ(set(), 0) << error.message;
  EXPECT_REFUSED(cairn_simulation_create(scene, nullptr, &simulation, &error), "particle 2 of the fluid lies");
  place[5] = 0.025;
  ASSERT_EQ(set(), 0);
  const int64_t square = body({0.5, 0.5});
  int32_t number = -1;
  const double corner[8] = {-0.1, -0.1, 0.1, -0.1, 0.1, 0.1, -0.1, 0.1};
  const int64_t first[2] = {0, 4};
  ASSERT_EQ(cairn_scene_add_polygons(scene, 1, first, corner, &number, &error), 0);
  hull("polygon", square, number);
  EXPECT_REFUSED(cairn_simulation_create(scene, nullptr, &simulation, &error), "cairn_scene_add_fluid_points");
  ASSERT_EQ(cairn_scene_set_fluid_rule(scene, "rock", "none", &error), 0);
  start();
  double value = 0;
  EXPECT_REFUSED(cairn_simulation_fluid_number(simulation, "depth", &value, &error), "sub_steps");
  EXPECT_REFUSED(cairn_simulation_fluid_field(simulation, "colour", 0, nullptr, nullptr, &error), "porosity");
  const double far[2] = {infinite, 0};
  EXPECT_REFUSED(cairn_simulation_fluid_level(simulation, 1, far, &value, &error), "place[0]");
  cairn_simulation_destroy(simulation);
  simulation = nullptr;
  ASSERT_EQ(cairn_scene_set_fluid(scene, &water, 0, nullptr, nullptr, nullptr, &error), 0);
  start();
  EXPECT_EQ(cairn_simulation_particles(simulation), 0);
  EXPECT_REFUSED(cairn_simulation_fluid_number(simulation, "volume", &value, &error), "no liquid");
}

// A channel of 1 m x 0.2 m, far from the origin, in which all moves at one speed.
TEST_F(CFluid, what_comes_in_leaves_and_a_checkpoint_goes_on_to_the_same_bits) {
  make(2);
  const double weightless[3] = {0, 0, 0};
  ASSERT_EQ(cairn_scene_set_gravity(scene, weightless, &error), 0);
  const double origin[2] = {1e3, -2e3}, speed = 0.5;
  ASSERT_EQ(cairn_scene_set_origin(scene, origin, &error), 0);
  std::vector<double> place, velocity;
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 4; ++j) {
      place.insert(place.end(), {origin[0] + (i + 0.5) * 0.05, origin[1] + (j + 0.5) * 0.05});
      velocity.insert(velocity.end(), {speed, 0});
    }
  water.sound_speed = 10;
  ASSERT_EQ(cairn_scene_set_fluid(scene, &water, 80, place.data(), velocity.data(), nullptr, &error), 0);
  const double low[2] = {origin[0] - 0.2, origin[1]}, high[2] = {origin[0], origin[1] + 0.2};
  const double from[2] = {origin[0] + 1, origin[1]}, to[2] = {origin[0] + 1.2, origin[1] + 0.2};
  ASSERT_EQ(cairn_scene_add_inflow(scene, low, high, 0, 1, &speed, &error), 0) << error.message;
  ASSERT_EQ(cairn_scene_add_outflow(scene, from, to, 0, 1, 0.0, &error), 0) << error.message;
  start();
  EXPECT_EQ(cairn_simulation_particles(simulation), 80 + 16);
  steps(100, 0.01); // 0.5 m: ten particles of each row
  EXPECT_NEAR(number("came_in"), 1000 * 0.5 * 0.2, 1000 * 0.2 * 0.05 * 1.001);
  EXPECT_NEAR(number("left"), 1000 * 0.3 * 0.2, 1000 * 0.2 * 0.05 * 1.001); // 0.2 m fill the outflow
  const std::vector<double> end = particle_field("end");
  EXPECT_GT(*std::max_element(end.begin(), end.end()), 0);
  EXPECT_LT(*std::min_element(end.begin(), end.end()), 0);
  EXPECT_EQ(number("back_flow"), 0);
  const std::string file = (std::filesystem::temp_directory_path() / "cairn_c_ends.checkpoint").string();
  ASSERT_EQ(cairn_simulation_write_checkpoint(simulation, file.c_str(), &error), 0) << error.message;
  steps(10, 0.01);
  const std::vector<double> once = particle_field("position");
  cairn_simulation_destroy(simulation);
  simulation = nullptr;
  start();
  ASSERT_EQ(cairn_simulation_restart(simulation, file.c_str(), &error), 0) << error.message;
  steps(10, 0.01);
  EXPECT_EQ(particle_field("position"), once);
  std::filesystem::remove(file);
}

TEST_F(CFluid, wrong_ends_are_refused_by_name) {
  std::vector<double> place;
  make(2);
  water.sound_speed = 10;
  const double left[2] = {-0.2, 0}, zero[2] = {0, 0.2}, far[2] = {1, 0}, end[2] = {1.2, 0.2}, up = 1, down = -1,
               none = 0;
  const double close[2] = {-0.1, 0}, both[4] = {1, -1, 1, 1}, in[2] = {0.2, 0.2};
  EXPECT_REFUSED(cairn_scene_add_inflow(scene, zero, left, 0, 1, &up, &error), "is not above low");
  EXPECT_REFUSED(cairn_scene_add_inflow(scene, left, zero, 2, 1, &up, &error), "axis is 2");
  EXPECT_REFUSED(cairn_scene_add_outflow(scene, far, end, 0, 0, 0, &error), "sign is 0");
  EXPECT_REFUSED(cairn_scene_add_outflow(scene, far, end, 0, 1, infinite, &error), "pressure");
  const auto inflow = [&](const double* low, const double* high, int64_t rows, const double* speed, const char* what) {
    cairn_scene_destroy(scene);
    make(2);
    place.clear();
    for (int i = 0; i < 20; ++i)
      for (int j = 0; j < 4; ++j) place.insert(place.end(), {(i + 0.5) * 0.05, (j + 0.5) * 0.05});
    ASSERT_EQ(cairn_scene_set_fluid(scene, &water, 80, place.data(), nullptr, nullptr, &error), 0);
    ASSERT_EQ(cairn_scene_add_inflow(scene, low, high, 0, rows, speed, &error), 0) << error.message;
    EXPECT_REFUSED(cairn_simulation_create(scene, nullptr, &simulation, &error), what);
  };
  inflow(left, zero, 1, &down, "towards the liquid");
  inflow(far, end, 1, &up, "behind its box");
  inflow(left, in, 1, &up, "within its box");
  inflow(close, zero, 1, &up, "particles reach over");
  inflow(left, zero, 1, &none, "both ways or nowhere");
  inflow(left, zero, 4, both, "both ways or nowhere");
  const double three[3] = {1, 1, 1};
  inflow(left, zero, 3, three, "4 rows of particles and 3 speeds");
  const double odd[2] = {-0.17, 0}; // whole spacings, of which a row is made, are shorter
  water.smoothing = 1.6;
  inflow(odd, zero, 1, &up, "inflow is 0.15 m long, and particles reach over 0.16 m");
  water.smoothing = 1.5;
  cairn_scene_destroy(scene);
  make(2);
  ball(2, body({-0.1, 0.1}, 100, 1), 0.04, rock);
  ASSERT_EQ(cairn_scene_set_fluid(scene, &water, 80, place.data(), nullptr, nullptr, &error), 0);
  ASSERT_EQ(cairn_scene_add_inflow(scene, left, zero, 0, 1, &up, &error), 0) << error.message;
  EXPECT_REFUSED(cairn_simulation_create(scene, nullptr, &simulation, &error), "a row of an inflow lies 0.0");
  for (const int32_t sign : {-1, 1}) {
    cairn_scene_destroy(scene);
    make(2);
    ASSERT_EQ(cairn_scene_set_fluid(scene, &water, 80, place.data(), nullptr, nullptr, &error), 0);
    ASSERT_EQ(cairn_scene_add_outflow(scene, sign > 0 ? left : far, sign > 0 ? zero : end, 0, sign, 0, &error), 0);
    EXPECT_REFUSED(cairn_simulation_create(scene, nullptr, &simulation, &error), "finds the way out");
  }
  ASSERT_EQ(cairn_scene_set_fluid(scene, &water, 0, nullptr, nullptr, nullptr, &error), 0);
  EXPECT_REFUSED(cairn_simulation_create(scene, nullptr, &simulation, &error), "the scene has none");
}

TEST_F(CFluid, contactors_that_it_cannot_meet_leave_the_scene_as_it_was) {
  std::vector<double> place;
  basin(2, place);
  ASSERT_EQ(cairn_scene_set_fluid(scene, &water, particles(place), place.data(), nullptr, nullptr, &error), 0);
  const int64_t id = body({0.5, 3}, 100, 1);
  start();
  const double small = 0.01, large = 0.2;
  int64_t number = -1, before = -1;
  ASSERT_EQ(cairn_simulation_add_contactors(simulation, "disk", 1, &id, &rock, &large, nullptr, nullptr, nullptr,
                                            &before, &error),
            0)
      << error.message;
  EXPECT_REFUSED(cairn_simulation_add_contactors(simulation, "disk", 1, &id, &rock, &small, nullptr, nullptr, nullptr,
                                                 &number, &error),
                 "smaller spacing");
  ASSERT_EQ(cairn_simulation_add_contactors(simulation, "disk", 1, &id, &rock, &large, nullptr, nullptr, nullptr,
                                            &number, &error),
            0);
  EXPECT_EQ(number, before + 1);
}

TEST_F(CFluid, water_that_slides_along_a_disk_does_not_spin_it) {
  std::vector<double> place;
  basin(8, place);
  const double middle[2] = {0.47, 0.2}, radius = 0.12;
  std::vector<double> outside;
  for (std::size_t i = 0; i < place.size(); i += 2)
    if (std::hypot(place[i] - middle[0], place[i + 1] - middle[1]) > radius + 0.02)
      outside.insert(outside.end(), {place[i], place[i + 1]});
  ASSERT_EQ(cairn_scene_set_fluid(scene, &water, particles(outside), outside.data(), nullptr, nullptr, &error), 0);
  ASSERT_EQ(cairn_scene_set_fluid_rule(scene, "*", "free_slip", &error), 0);
  const double mass = 0.5 * 1000 * 3.14 * radius * radius;
  const int64_t id = body({middle[0], middle[1]}, mass, 0.5 * mass * radius * radius);
  ASSERT_EQ(cairn_scene_add_contactors(scene, "disk", 1, &id, &rock, &radius, nullptr, nullptr, nullptr, &error), 0);
  start();
  steps(50, 2e-3);
  double force[3];
  ASSERT_EQ(cairn_simulation_fluid_force(simulation, id, force, &error), 0);
  EXPECT_GT(force[1], 0.1 * 9.81 * mass);
  EXPECT_NEAR(force[2], 0, 1e-12 * force[1] * radius);
}

TEST_F(CFluid, the_incompressible_form_asks_for_the_theta_method) {
  std::vector<double> place;
  basin(2, place);
  water.incompressible = 1;
  ASSERT_EQ(cairn_scene_set_fluid(scene, &water, particles(place), place.data(), nullptr, nullptr, &error), 0);
  start();
  ASSERT_EQ(cairn_simulation_set_option(simulation, "integrator", "hht", &error), 0) << error.message;
  EXPECT_REFUSED(cairn_simulation_step(simulation, 1e-3, nullptr, &error), "integrator");
  ASSERT_EQ(cairn_simulation_set_option(simulation, "integrator", "theta", &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_set_option(simulation, "strategy", "smooth_dem", &error), 0) << error.message;
  EXPECT_REFUSED(cairn_simulation_step(simulation, 1e-3, nullptr, &error), "NSCD");
}

} // namespace
