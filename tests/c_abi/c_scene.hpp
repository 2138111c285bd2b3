// A scene and a simulation of the C API that are destroyed with the test.
#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "cairn/cairn.h"

struct CScene : testing::Test {
  const double infinite = std::numeric_limits<double>::infinity();
  cairn_error error{};
  cairn_scene* scene = nullptr;
  cairn_simulation* simulation = nullptr;
  int32_t rock = -1;

  ~CScene() override {
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
  }
  void make(int dim, double mu = 0.5) {
    const double gravity[] = {0, dim == 2 ? -9.81 : 0, -9.81};
    ASSERT_EQ(cairn_scene_create(dim, &scene, &error), 0);
    ASSERT_EQ(cairn_scene_set_gravity(scene, gravity, &error), 0);
    ASSERT_EQ(cairn_scene_add_material(scene, "rock", &rock, &error), 0);
    ASSERT_EQ(cairn_scene_set_law(scene, -1, -1, "Coulomb", 1, &mu, &error), 0);
  }
  void start() { ASSERT_EQ(cairn_simulation_create(scene, nullptr, &simulation, &error), 0) << error.message; }
  int64_t body(std::vector<double> place, double mass = 1, double inertia = 0.1) {
    const double moments[] = {inertia, inertia, inertia};
    int64_t id = -1;
    EXPECT_EQ(cairn_scene_add_bodies(scene, 1, place.data(), nullptr, nullptr, &mass, moments, &id, &error), 0)
        << error.message;
    return id;
  }
  void floor(int dim) {
    const int64_t id = body(std::vector<double>(dim, 0.0), infinite, infinite);
    const double up[] = {0, dim == 2 ? 1.0 : 0.0, dim == 2 ? 0.0 : 1.0, 0};
    ASSERT_EQ(cairn_scene_add_contactors(scene, dim == 2 ? "half_plane" : "plane", 1, &id, &rock, nullptr, nullptr, up,
                                         nullptr, &error),
              0)
        << error.message;
  }
  void ball(int dim, int64_t id, double radius, int32_t material) {
    ASSERT_EQ(cairn_scene_add_contactors(scene, dim == 2 ? "disk" : "sphere", 1, &id, &material, &radius, nullptr,
                                         nullptr, nullptr, &error),
              0)
        << error.message;
  }
  void hull(const char* shape, int64_t id, int32_t number) {
    ASSERT_EQ(cairn_scene_add_hull_contactors(scene, shape, 1, &id, &rock, &number, nullptr, nullptr, &error), 0)
        << error.message;
  }
  void steps(int n, double h = 1e-3) {
    for (int i = 0; i < n; ++i) ASSERT_EQ(cairn_simulation_step(simulation, h, nullptr, &error), 0) << error.message;
  }
  std::vector<double> field(const char* name) {
    int64_t count = -1;
    EXPECT_EQ(cairn_simulation_body_field(simulation, name, 0, nullptr, &count, &error), 0) << error.message;
    std::vector<double> values(count);
    EXPECT_EQ(cairn_simulation_body_field(simulation, name, count, values.data(), &count, &error), 0) << error.message;
    return values;
  }
  std::vector<double> contact(const char* name) {
    int64_t count = -1;
    EXPECT_EQ(cairn_simulation_contact_field(simulation, name, 0, nullptr, &count, &error), 0) << error.message;
    std::vector<double> values(count);
    EXPECT_EQ(cairn_simulation_contact_field(simulation, name, count, values.data(), &count, &error), 0)
        << error.message;
    return values;
  }
  std::string text(const char* name) {
    char room[256] = "";
    EXPECT_EQ(cairn_simulation_report_text(simulation, name, sizeof room, room, &error), 0) << error.message;
    return room;
  }
  double energy(const char* term) {
    double value = -1;
    EXPECT_EQ(cairn_simulation_energy(simulation, term, &value, &error), 0) << error.message;
    return value;
  }
};

#define EXPECT_REFUSED(call, word)                                                                                     \
  EXPECT_EQ(call, cairn_wrong_input);                                                                                  \
  EXPECT_EQ(error.code, cairn_wrong_input);                                                                            \
  EXPECT_NE(std::string(error.message).find(word), std::string::npos) << error.message
