// Networks of heat and current through the C API, by name.
#include <cmath>
#include <filesystem>

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

// Three balls on a floor, a current from top to bottom through oxidised spots, whose heat warms them.
struct CFilms : CNetworks {
  int32_t flow = -1;
  void pile(double amperes) {
    make(3);
    floor(3);
    for (int k = 0; k < 3; ++k) ball(3, body({0, 0, 0.5 + k}), 0.5, rock);
    start();
    for (const char* kind : {"electrical", "thermal"}) {
      ASSERT_EQ(cairn_simulation_add_network(simulation, kind, &error), 0) << error.message;
      ASSERT_EQ(cairn_simulation_add_conductance(simulation, kind, "Holm", 0, nullptr, &error), 0) << error.message;
      for (const auto& [name, value] : {std::pair{"conductivity", 40.0}, {"young", 1e9}, {"poisson", 0.25}})
        ASSERT_EQ(cairn_simulation_set_network_material(simulation, kind, rock, name, value, &error), 0);
    }
    ASSERT_EQ(cairn_simulation_set_network_material(simulation, "thermal", rock, "capacity", 10, &error), 0);
    ASSERT_EQ(cairn_simulation_set_network(simulation, "thermal", "joule", 1, &error), 0);
    ASSERT_EQ(cairn_simulation_set_film(simulation, 1e-3, 1e-2, 0, infinite, &error), 0) << error.message;
    const int64_t ends[] = {0, 3};
    const double current[] = {-amperes, amperes};
    ASSERT_EQ(cairn_simulation_add_network_source(simulation, "electrical", "flow", 2, ends, current, nullptr, 0, &flow,
                                                  &error),
              0)
        << error.message;
  }
  void change(double amperes) {
    const double current[] = {-amperes, amperes};
    ASSERT_EQ(cairn_simulation_set_network_source(simulation, "electrical", flow, 2, current, &error), 0);
  }
  double spot(int rank) const { // Holm's, of balls and of a ball on a plane, under the weight of those above
    const double reduced = rank == 0 ? 0.5 : 0.25, modulus = 1e9 / (2 * (1 - 0.0625));
    return 2 * 40 * std::cbrt(0.75 * 9.81 * (3 - rank) * reduced / modulus);
  }
};

TEST_F(CFilms, BreakAndStayBroken) {
  pile(1e-3); // a milliwatt each in films of a millisiemens
  steps(5);
  std::vector<double> c = contact("electrical_conductance");
  ASSERT_EQ(c.size(), 3u);
  double series = 0, conducted = 0;
  for (int k = 0; k < 3; ++k) {
    series += 1e3 + 1 / spot(k);
    conducted += 1 / (1e3 + 1 / spot(k));
  }
  EXPECT_NEAR(c[0] + c[1] + c[2], conducted, 1e-5 * conducted);
  EXPECT_NEAR(number("electrical", "power"), 1e-6 * series, 1e-5 * 1e-6 * series);
  change(4e-3); // sixteen
  steps(2);
  c = contact("electrical_conductance");
  const std::vector<double> through = contact("current");
  double sum = 0, resistance = 0;
  for (int k = 0; k < 3; ++k) {
    sum += c[k];
    resistance += 1 / spot(k);
    EXPECT_NEAR(std::abs(through[k]), 4e-3, 1e-14);
  }
  EXPECT_NEAR(sum, spot(0) + spot(1) + spot(2), 1e-3 * sum); // impulses are solved to a tolerance
  EXPECT_NEAR(number("electrical", "power"), 16e-6 * resistance, 1e-3 * 16e-6 * resistance);
  change(1e-3);
  steps(1);
  EXPECT_LT(number("electrical", "power"), 1e-6 * resistance * 1.01);
  EXPECT_NEAR(number("electrical", "charge_in"), 1e-3 * (5e-3 + 8e-3 + 1e-3), 1e-15);
  EXPECT_NEAR(number("thermal", "joule"), number("electrical", "supplied"), 1e-12 * number("electrical", "in_play"));
  EXPECT_LE(std::abs(number("thermal", "balance")), 1e-12 * number("thermal", "in_play"));
}

TEST_F(CFilms, GoOnFromACheckpointInTheSameBits) {
  pile(4e-3);
  const std::string folder = testing::TempDir() + "films", file = folder + "/a.checkpoint.h5";
  std::filesystem::create_directories(folder);
  steps(7);
  ASSERT_EQ(cairn_simulation_write_checkpoint(simulation, file.c_str(), &error), 0) << error.message;
  change(1e-3);
  steps(5);
  const auto told = [&] {
    std::vector<double> all = CScene::field("temperature");
    for (const char* name : {"current", "electrical_conductance", "heat_flux"})
      for (const double value : contact(name)) all.push_back(value);
    for (const char* name : {"joule", "stored", "balance", "in_play"}) all.push_back(number("thermal", name));
    return all;
  };
  const std::vector<double> straight = told();
  cairn_simulation_destroy(simulation);
  cairn_scene_destroy(scene);
  simulation = nullptr;
  scene = nullptr;
  pile(1e-3); // loads and laws are the program's to give
  ASSERT_EQ(cairn_simulation_restart(simulation, file.c_str(), &error), 0) << error.message;
  steps(5);
  EXPECT_EQ(told(), straight);
  EXPECT_GT(straight[1], 293.15);
  std::filesystem::remove_all(folder);
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
