// Networks of heat and current through the C API, by name.
#include <cmath>

#include "c_scene.hpp"

struct CNetworks : CScene {
  double number(const char* kind, const char* name) {
    double value = NAN;
    EXPECT_EQ(cairn_simulation_network_report(simulation, kind, name, &value, &error), 0) << error.message;
    return value;
  }
  std::vector<double> field(const char* name) {
    std::vector<double> values(3);
    int64_t count = 0;
    EXPECT_EQ(cairn_simulation_body_field(simulation, name, 3, values.data(), &count, &error), 0) << error.message;
    EXPECT_EQ(count, 3);
    return values;
  }
  void three_apart() {
    make(3);
    for (int k = 0; k < 3; ++k) ball(3, body({10.0 * k, 0, 0}), 0.5, rock);
    start();
  }
};

TEST_F(CNetworks, CurrentThroughWires) {
  three_apart();
  ASSERT_EQ(cairn_simulation_add_network(simulation, "electrical", &error), 0) << error.message;
  const int64_t ends[] = {0, 1, 1, 2}, electrodes[] = {0, 2};
  const double siemens[] = {2, 4}, current[] = {3, -3};
  ASSERT_EQ(cairn_simulation_add_wires(simulation, "electrical", 2, ends, siemens, &error), 0) << error.message;
  int32_t source = -1;
  ASSERT_EQ(cairn_simulation_add_network_source(simulation, "electrical", "flow", 2, electrodes, current, nullptr, 0,
                                                &source, &error),
            0)
      << error.message;
  ASSERT_EQ(cairn_simulation_step(simulation, 1e-3, nullptr, &error), 0) << error.message;
  std::vector<double> v = field("potential");
  EXPECT_NEAR(v[0] - v[2], 2.25, 1e-14);
  EXPECT_EQ(number("electrical", "status"), 0);
  EXPECT_NEAR(number("electrical", "power"), 6.75, 1e-13);
  const double none[] = {1, 0};
  ASSERT_EQ(cairn_simulation_set_network_source(simulation, "electrical", source, 2, none, &error), 0);
  ASSERT_EQ(cairn_simulation_step(simulation, 1e-3, nullptr, &error), 0);
  EXPECT_EQ(number("electrical", "status"), 3); // nowhere to go
}

TEST_F(CNetworks, HeatBetweenBodies) {
  three_apart();
  ASSERT_EQ(cairn_simulation_add_network(simulation, "thermal", &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_set_network_material(simulation, "thermal", rock, "capacity", 100, &error), 0);
  ASSERT_EQ(cairn_simulation_set_network(simulation, "thermal", "theta", 0.5, &error), 0) << error.message;
  const int64_t ends[] = {0, 1, 1, 2};
  const double conductance[] = {50, 50}, begin[] = {400, 300, 200};
  ASSERT_EQ(cairn_simulation_add_wires(simulation, "thermal", 2, ends, conductance, &error), 0);
  ASSERT_EQ(cairn_simulation_set_temperature(simulation, 3, nullptr, begin, &error), 0) << error.message;
  for (int k = 0; k < 100; ++k) ASSERT_EQ(cairn_simulation_step(simulation, 0.01, nullptr, &error), 0) << error.message;
  const std::vector<double> t = field("temperature");
  EXPECT_NEAR(t[0] - 300, 100 * std::exp(-0.5), 1e-3); // mass 1, rate 50 / 100
  EXPECT_NEAR(t[0] + t[2], 600, 1e-10);
  EXPECT_LE(std::abs(number("thermal", "balance")), 1e-12 * number("thermal", "in_play"));
}

TEST_F(CNetworks, WhatIsWrongIsNamed) {
  three_apart();
  EXPECT_EQ(cairn_simulation_add_network(simulation, "magnetic", &error), cairn_wrong_input);
  EXPECT_NE(std::string(error.message).find("magnetic"), std::string::npos);
  EXPECT_EQ(cairn_simulation_set_network(simulation, "thermal", "theta", 0.5, &error), cairn_wrong_input);
  ASSERT_EQ(cairn_simulation_add_network(simulation, "thermal", &error), 0);
  EXPECT_EQ(cairn_simulation_set_network(simulation, "thermal", "theta", 0.1, &error), cairn_wrong_input);
  EXPECT_EQ(cairn_simulation_add_conductance(simulation, "thermal", "Ohm", 0, nullptr, &error), cairn_wrong_input);
  EXPECT_NE(std::string(error.message).find("Holm"), std::string::npos);
  EXPECT_EQ(cairn_simulation_add_conductance(simulation, "thermal", "Sharvin", 0, nullptr, &error), cairn_wrong_input);
  EXPECT_EQ(cairn_simulation_set_network_material(simulation, "thermal", 7, "young", 1, &error), cairn_wrong_input);
  const double cold[] = {0};
  const int64_t first[] = {0};
  EXPECT_EQ(cairn_simulation_set_temperature(simulation, 1, first, cold, &error), cairn_wrong_input);
}
