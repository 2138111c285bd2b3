// Laws and options of smooth DEM by the C API, against closed forms; the same calls in Fortran. Growth of bodies.
#include <map>

#include "c_scene.hpp"

extern "C" void cairn_fortran_smooth_force(int32_t law, double* force, int32_t* refused);
extern "C" void cairn_fortran_growth(double* mass, int32_t* refused);

namespace {

constexpr double radius = 0.01, overlap = 1e-5, young = 1e8, plane = young / (2 * (1 - 0.09));
const double pi = std::acos(-1.0);
const double hertz = 4.0 / 3 * plane * std::sqrt(radius) * std::pow(overlap, 1.5);

struct CSmooth : CScene {
  // Force of a law on a sphere that overlaps a plane, and rests.
  double force_of(const char* law, const std::vector<double>& parameters) {
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    simulation = nullptr;
    make(3);
    EXPECT_EQ(cairn_scene_set_law(scene, -1, -1, law, int32_t(parameters.size()), parameters.data(), &error), 0)
        << error.message;
    ball(3, body({0, 0, radius - overlap}, 1, 4e-5), radius, rock);
    floor(3);
    start();
    EXPECT_EQ(cairn_simulation_set_option(simulation, "strategy", "smooth_dem", &error), 0) << error.message;
    constexpr double h = 1e-9;
    steps(1, h);
    return contact("impulse").at(2) / h;
  }
};

//                             model young poisson work dashpot damping slip ratio mu roll rolling ratio damping twist
const std::vector<double> granular = {1, young, 0.3, 0, 0, 1, 2, 2.0 / 7, 0.5, 2, 0.1, 2.25, 0.3, 2, 0, 1, -1};

TEST_F(CSmooth, laws_take_their_options_in_the_order_of_their_row) {
  const std::map<std::string, std::pair<std::vector<double>, double>> cases = {
      {"LinearSpring", {{1e5, 0.3, 1, 0.5}, 1e5 * overlap}},
      {"HertzMindlin", {{young, 0.3, 1, 0.5}, hertz}},
      {"GranularContact", {granular, hertz}},
      {"PlasticContact", {{1e5, 3e5, 1e4, 0.05, 0, 2.0 / 7, 0.5}, 1e5 * overlap}},
      {"YieldContact", {{young, 1e9, 0.3, 1, 0.5}, hertz}},
      {"LiquidBridge", {{young, 0.07, 1e-10, 0.3, 1, 0.3, 1, 0.5}, hertz - 4 * pi * radius * 0.07 * std::cos(0.3)}},
      {"SmoothBond", {{1e9, 1e9, 1e6, 1e6, 0.5, 1, 0, 0}, 0}}, // at rest where it is made
  };
  for (const auto& [law, of] : cases) EXPECT_NEAR(force_of(law.c_str(), of.first), of.second, 1e-7 * hertz) << law;
  const double dmt = force_of("GranularContact", [] {
    std::vector<double> p = granular;
    p[0] = 2, p[3] = 0.1;
    return p;
  }());
  EXPECT_NEAR(dmt, hertz - 2 * pi * 0.1 * radius, 1e-7 * hertz);
  std::vector<double> wrong = granular;
  wrong[9] = 3; // no third resistance to rolling
  EXPECT_REFUSED(cairn_scene_set_law(scene, -1, -1, "GranularContact", 17, wrong.data(), &error), "roll");
}

TEST_F(CSmooth, fortran_finds_the_same_forces) {
  const std::vector<std::pair<const char*, std::vector<double>>> laws = {
      {"GranularContact", granular},
      {"PlasticContact", {1e5, 3e5, 1e4, 0.05, 0, 2.0 / 7, 0.5}},
      {"LiquidBridge", {young, 0.07, 1e-10, 0.3, 1, 0.3, 1, 0.5}}};
  for (int32_t k = 0; k < 3; ++k) {
    double force = 0;
    int32_t refused = 0;
    cairn_fortran_smooth_force(k + 1, &force, &refused);
    EXPECT_EQ(force, force_of(laws[std::size_t(k)].first, laws[std::size_t(k)].second));
    EXPECT_EQ(refused, 1);
  }
}

TEST_F(CSmooth, options_are_numbers_with_limits) {
  force_of("LinearSpring", {1e5, 0.3, 1, 0.5});
  for (const auto& [name, value] : {std::pair("local_damping", 0.7), std::pair("mass_scale", 100.0),
                                    std::pair("skin", 1e-4), std::pair("overlap", 0.02), std::pair("energy", 0.0)}) {
    double found = -1;
    ASSERT_EQ(cairn_simulation_set_number(simulation, name, value, &error), 0) << error.message;
    ASSERT_EQ(cairn_simulation_get_number(simulation, name, &found, &error), 0) << error.message;
    EXPECT_EQ(found, value) << name;
  }
  EXPECT_REFUSED(cairn_simulation_set_number(simulation, "mass_scale", 0.5, &error), "mass_scale");
  EXPECT_REFUSED(cairn_simulation_set_number(simulation, "local_damping", 2, &error), "local_damping");
}

TEST_F(CSmooth, bodies_grow_by_text) {
  make(2);
  const int64_t one = body({0, 0}, 2, 0.3), wall = body({0, -5}, infinite, infinite);
  ball(2, one, 0.1, rock);
  start();
  ASSERT_EQ(cairn_simulation_grow(simulation, 1, &one, "2*t", &error), 0) << error.message;
  steps(100, 1e-2);
  EXPECT_NEAR(field("mass")[0], 2 * std::exp(2.0), 1e-12); // the size has grown by e
  EXPECT_NEAR(field("inertia")[0], 0.3 * std::exp(4.0), 1e-11);
  ASSERT_EQ(cairn_simulation_grow(simulation, 1, &one, nullptr, &error), 0);
  steps(3, 1e-2);
  EXPECT_NEAR(field("mass")[0], 2 * std::exp(2.0), 1e-12);
  EXPECT_REFUSED(cairn_simulation_grow(simulation, 1, &wall, "1", &error), "no finite mass");
  EXPECT_REFUSED(cairn_simulation_grow(simulation, 1, &one, "2*", &error), "its end");
  double mass[2];
  int32_t refused = 0;
  cairn_fortran_growth(mass, &refused);
  EXPECT_EQ(refused, 1);
  EXPECT_NEAR(mass[0], 2 * std::exp(2.0), 1e-12);
  EXPECT_EQ(mass[1], mass[0]); // after its end
}

} // namespace
