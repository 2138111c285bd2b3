// Bars, beams, sides that are tied, and held nodes that move as functions of time, in C: numbers are those of the same
// scenes in Python, to rounding.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "c_scene.hpp"

namespace {

double wave(double t, void* context) {
  ++*static_cast<int*>(context);
  return 0.01 * std::sin(30 * t);
}
double quick(double t, void*) { return 0.1 * std::cos(30 * t); }
double late_nan(double t, void*) { return t > 0.0105 ? NAN : 0.1 * t; }
double endless(double, void*) { return INFINITY; }

struct CFrames : CScene {
  cairn_mesh* mesh = nullptr;
  int32_t number = -1;
  int64_t nodes = 0;
  int calls = 0;
  ~CFrames() override { cairn_mesh_destroy(mesh); }
  void of(int dim, const std::vector<double>& place) {
    make(dim);
    nodes = int64_t(place.size()) / dim;
    ASSERT_EQ(cairn_mesh_create(dim, nodes, place.data(), &mesh, &error), 0) << error.message;
  }
  void begin(double theta = 0.5) {
    ASSERT_EQ(cairn_scene_add_mesh(scene, mesh, "mesh", rock, -1, nullptr, &number, &error), 0) << error.message;
    start();
    ASSERT_EQ(cairn_simulation_set_number(simulation, "theta", theta, &error), 0) << error.message;
  }
  void hold(std::vector<int32_t> node, uint8_t mask) {
    ASSERT_EQ(cairn_mesh_hold(mesh, int64_t(node.size()), node.data(), mask, &error), 0) << error.message;
  }
  void same(const std::vector<double>& python, double tolerance = 1e-12) {
    std::vector<double> u(python.size());
    int64_t n = 0;
    ASSERT_EQ(cairn_simulation_mesh_field(simulation, number, "displacement", int64_t(u.size()), u.data(), &n, &error),
              0);
    ASSERT_EQ(n, int64_t(python.size()));
    double size = 0, off = 0;
    for (std::size_t i = 0; i < u.size(); ++i)
      size = std::max(size, std::abs(python[i])), off = std::max(off, std::abs(u[i] - python[i]));
    EXPECT_LT(off, tolerance * size) << off;
  }
  void plane_frame() { of(2, {0, 0, 1, 0, 1, 1, 2, 1.5}); }
  void space_frame() { of(3, {0, 0, 0, 1, 0, 0, 1, 1, 0.2, 1.5, 1, 1}); }
  const int32_t cells[8] = {0, 1, 1, 2, 2, 3, 0, 2};
  const double young[4] = {1e6, 2e6, 1e6, 3e6}, area[4] = {1e-3, 1e-3, 2e-3, 1e-3}, density[4] = {1e3, 1e3, 1e3, 1e3};
  const double stress[4] = {1e3, -2e3, 5e2, 0};
  const int32_t tip = 3, one = 1;
};

TEST_F(CFrames, bars_by_tables) {
  plane_frame();
  ASSERT_EQ(cairn_mesh_set_bars(mesh, 4, cells, young, area, density, stress, &error), 0) << error.message;
  ASSERT_EQ(cairn_mesh_set_damping(mesh, 1, 1e-4, 0, &error), 0);
  hold({0}, 3);
  hold({1, 3}, 2);
  begin();
  const double time[] = {0.02, 0.05, 0.08}, way[] = {0, 0.03, 0.01}, start[] = {0}, still[] = {0};
  ASSERT_EQ(cairn_simulation_displace_nodes(simulation, number, 1, &tip, 'y', 3, time, way, &error), 0)
      << error.message;
  ASSERT_EQ(cairn_simulation_drive_nodes(simulation, number, 1, &one, 'y', 1, start, still, &error), 0);
  steps(100);
  same({0, 0, -0.0019671070639238897, 0, 0.013096465435789462, -0.015626827368360074, -0.016650233828297889,
        0.010000000000000231});
  EXPECT_NEAR(energy("stored"), 0.4709801374570674, 1e-11);
  EXPECT_LT(std::abs(energy("closure")), 1e-9 * energy("kinetic") + 1e-9);
}

TEST_F(CFrames, bars_in_space_driven_by_a_function) {
  space_frame();
  const int32_t all[] = {0, 1, 1, 2, 2, 3, 0, 2, 0, 3, 1, 3};
  const std::vector<double> e(6, 1e7), a(6, 1e-3), rho(6, 1e3);
  ASSERT_EQ(cairn_mesh_set_bars(mesh, 6, all, e.data(), a.data(), rho.data(), nullptr, &error), 0) << error.message;
  hold({0}, 7);
  hold({3}, 4);
  begin(1);
  ASSERT_EQ(cairn_simulation_drive_nodes_by(simulation, number, 1, &tip, 'z', quick, nullptr, &error), 0);
  steps(100);
  same({0, 0, 0, 0.0011717522920422496, 0.0065117339861220699, -0.028291055616825732, 0.0052338457316580822,
        0.0015513337226555901, -0.012747597098707292, -0.0099947389502172967, -0.0082067695309745448,
        0.00037086512150463768});
}

TEST_F(CFrames, beams_by_a_function) {
  plane_frame();
  const double inertia[] = {1e-7, 2e-7, 1e-7, 1e-7}, sheared[] = {1e-3, 8e-4, 1e-3, 1e-3};
  const int32_t foot = 0;
  ASSERT_EQ(cairn_mesh_set_beams(mesh, 4, cells, young, area, density, stress, inertia, sheared, nullptr, 0.2, nullptr,
                                 1, &foot, &error),
            0)
      << error.message;
  ASSERT_EQ(cairn_mesh_set_damping(mesh, 1, 1e-4, 0, &error), 0);
  hold({0}, 3);
  hold({3}, 1);
  begin();
  ASSERT_EQ(cairn_simulation_displace_nodes_by(simulation, number, 1, &tip, 'x', wave, &calls, &error), 0);
  steps(100);
  EXPECT_EQ(calls, 300); // the begin, the middle and the end of each step
  same({0, 0, -0.0019880915550209988, -0.040018880869773468, 0.015889773359857085, -0.038466324319853973,
        0.0014112001022090759, -0.055156040554898755});
}

TEST_F(CFrames, beams_in_space) {
  space_frame();
  const double inertia[] = {1e-7, 2e-7, 1e-7, 3e-7, 2e-7, 1e-7}, torsion[] = {3e-7, 1e-7, 2e-7}, up[] = {0.1, 0.2, 1};
  const double e[] = {1e7, 1e7, 1e7}, a[] = {1e-3, 1e-3, 1e-3};
  const int32_t foot = 0;
  ASSERT_EQ(
      cairn_mesh_set_beams(mesh, 3, cells, e, a, density, stress, inertia, nullptr, torsion, 0.3, up, 1, &foot, &error),
      0)
      << error.message;
  hold({0}, 7);
  hold({3}, 4);
  begin();
  ASSERT_EQ(cairn_simulation_set_option(simulation, "integrator", "newmark", &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_set_number(simulation, "beta", 0.3025, &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_set_number(simulation, "gamma", 0.6, &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_displace_nodes_by(simulation, number, 1, &tip, 'z', wave, &calls, &error), 0);
  steps(100);
  same({0, 0, 0, -0.00017828173302125716, 0.0023662681419187571, -0.048265187251315803, 0.014159476363974077,
        -0.0024874709779292292, -0.02662955977814116, -0.029653605461771537, -0.00021994209196507519,
        0.0014112001022086318},
       1e-11);
}

// Frames that fall through half a turn about their foot.
TEST_F(CFrames, bars_that_move_far) {
  const std::pair<const char*, std::vector<double>> known[] = {
      {"corotational",
       {0, 0, -0.1738555143598346, -0.5781000948688103, 0.40326546170511013, -0.7581354331740295, 0.4399816069349214,
        -0.8297653449592045}},
      {"total_lagrangian",
       {0, 0, -0.17419449813404986, -0.5784617596638074, 0.40256908647734435, -0.758128547893072, 0.4390926726719262,
        -0.830082602078832}}};
  for (const auto& [kinematics, python] : known) {
    cairn_mesh_destroy(mesh), mesh = nullptr;
    cairn_simulation_destroy(simulation), simulation = nullptr;
    cairn_scene_destroy(scene), scene = nullptr;
    plane_frame();
    ASSERT_EQ(cairn_mesh_set_bars(mesh, 4, cells, young, area, density, stress, &error), 0) << error.message;
    ASSERT_EQ(cairn_mesh_set_kinematics(mesh, kinematics, &error), 0) << error.message;
    ASSERT_EQ(cairn_mesh_set_damping(mesh, 1, 1e-4, 0, &error), 0);
    hold({0}, 3);
    begin();
    steps(100, 5e-3);
    same(python, 1e-11);
    EXPECT_LT(std::abs(energy("closure")), 1e-12 * energy("in_play"));
  }
}

TEST_F(CFrames, beams_that_move_far) {
  plane_frame();
  const double inertia[] = {1e-7, 2e-7, 1e-7, 1e-7}, sheared[] = {1e-3, 8e-4, 1e-3, 1e-3};
  const int32_t foot = 0;
  ASSERT_EQ(cairn_mesh_set_beams(mesh, 4, cells, young, area, density, stress, inertia, sheared, nullptr, 0.2, nullptr,
                                 1, &foot, &error),
            0)
      << error.message;
  ASSERT_EQ(cairn_mesh_set_kinematics(mesh, "corotational", &error), 0) << error.message;
  ASSERT_EQ(cairn_mesh_set_damping(mesh, 1, 1e-4, 0, &error), 0);
  hold({0}, 3);
  begin();
  steps(100, 5e-3);
  same({0, 0, -0.17150984499763766, -0.5742586604008528, 0.40178015514171306, -0.751732253150907, 0.442032205809348,
        -0.8325335972162807},
       1e-11);
}

TEST_F(CFrames, beams_that_move_far_in_space) {
  space_frame();
  const double inertia[] = {1e-7, 2e-7, 1e-7, 3e-7, 2e-7, 1e-7}, torsion[] = {3e-7, 1e-7, 2e-7}, up[] = {0.1, 0.2, 1};
  const double e[] = {1e7, 1e7, 1e7}, a[] = {1e-3, 1e-3, 1e-3};
  const int32_t foot = 0;
  ASSERT_EQ(
      cairn_mesh_set_beams(mesh, 3, cells, e, a, density, stress, inertia, nullptr, torsion, 0.3, up, 1, &foot, &error),
      0)
      << error.message;
  ASSERT_EQ(cairn_mesh_set_kinematics(mesh, "corotational", &error), 0) << error.message;
  hold({0}, 7);
  begin();
  steps(100, 5e-3);
  same({0, 0, 0, -0.5057399057609642, 0.0473975453620173, -0.870949824149647, -0.0268758961485438, -0.06254072107533215,
        -1.2196631467690848, 0.01560734426541499, -0.008983345277863819, -1.2496313679929087},
       1e-10);
  EXPECT_NEAR(energy("stored"), 2.6144322636519286, 1e-10);
  EXPECT_LT(std::abs(energy("closure")), 1e-12 * energy("in_play"));
}

// A checkpoint holds no functions of time: a simulation that has them goes on with them, one that is given them again
// to the same bits, and held nodes of one that is not stand still.
TEST_F(CFrames, functions_are_given_again_after_a_restart) {
  plane_frame();
  ASSERT_EQ(cairn_mesh_set_bars(mesh, 4, cells, young, area, density, stress, &error), 0) << error.message;
  hold({0}, 3);
  hold({1, 3}, 2);
  begin();
  const double time[] = {0.02, 0.05, 0.08}, way[] = {0, 0.03, 0.01};
  const auto give = [&] {
    ASSERT_EQ(cairn_simulation_displace_nodes_by(simulation, number, 1, &tip, 'y', wave, &calls, &error), 0);
    ASSERT_EQ(cairn_simulation_drive_nodes(simulation, number, 1, &one, 'y', 3, time, way, &error), 0);
  };
  const auto there = [&] {
    std::vector<double> u(8);
    int64_t n = 0;
    EXPECT_EQ(cairn_simulation_mesh_field(simulation, number, "displacement", 8, u.data(), &n, &error), 0);
    return u;
  };
  give();
  steps(30);
  const std::string path = testing::TempDir() + "cairn_functions_of_time.h5";
  ASSERT_EQ(cairn_simulation_write_checkpoint(simulation, path.c_str(), &error), 0) << error.message;
  const auto half = there();
  steps(30);
  const auto whole = there();
  ASSERT_EQ(cairn_simulation_restart(simulation, path.c_str(), &error), 0) << error.message;
  EXPECT_EQ(there(), half);
  steps(30);
  EXPECT_EQ(there(), whole);
  for (const bool again : {true, false}) {
    cairn_simulation_destroy(simulation), simulation = nullptr;
    start();
    ASSERT_EQ(cairn_simulation_restart(simulation, path.c_str(), &error), 0) << error.message;
    calls = 0;
    if (again) give();
    steps(1); // in which nodes that nothing leads come to a stop
    const auto soon = there();
    steps(29);
    EXPECT_EQ(calls, again ? 90 : 0);
    EXPECT_EQ(there() == whole, again);
    for (const int32_t node : {one, tip})
      EXPECT_EQ(there()[std::size_t(2 * node + 1)] == soon[std::size_t(2 * node + 1)], !again);
  }
  std::remove(path.c_str());
}

// A cantilever of one beam: P L^3 / 3 E I, of any size.
TEST_F(CFrames, one_beam_of_any_size_bends_as_theory_says) {
  for (const double size : {1e-9, 1.0, 1e6}) {
    cairn_mesh_destroy(mesh), mesh = nullptr;
    cairn_simulation_destroy(simulation), simulation = nullptr;
    cairn_scene_destroy(scene), scene = nullptr;
    of(2, {0, 0, size, 0});
    const double none[] = {0, 0};
    ASSERT_EQ(cairn_scene_set_gravity(scene, none, &error), 0);
    const double e = 1e9, a = 1e-4 * size * size, i = 1e-9 * std::pow(size, 4), rho = 1000;
    const int32_t foot = 0;
    ASSERT_EQ(cairn_mesh_set_beams(mesh, 1, cells, &e, &a, &rho, nullptr, &i, nullptr, nullptr, 0.3, nullptr, 1, &foot,
                                   &error),
              0)
        << error.message;
    hold({0}, 3);
    begin(1);
    const double load[] = {0, 0, 0, 1e-2 * e * i / (size * size)};
    ASSERT_EQ(cairn_simulation_load_mesh(simulation, number, load, load, nullptr, &error), 0);
    steps(8, 1e3 * size);
    same({0, 0, 0, 1e-2 * size / 3}, 1e-6);
  }
}

// A straight beam in space that nothing holds: it turns about itself without a force, and moves as a rigid body.
TEST_F(CFrames, a_free_beam_falls) {
  of(3, {0, 0, 0, 1, 0, 0, 2, 0, 0});
  const double e[] = {1e7, 1e7}, a[] = {1e-3, 1e-3}, inertia[] = {1e-7, 1e-7, 1e-7, 1e-7};
  ASSERT_EQ(cairn_mesh_set_beams(mesh, 2, cells, e, a, density, nullptr, inertia, nullptr, nullptr, 0.3, nullptr, 0,
                                 nullptr, &error),
            0)
      << error.message;
  begin();
  steps(100);
  const double z = -9.81 * 0.01 / 2;
  same({0, 0, z, 0, 0, z, 0, 0, z}, 1e-9);
}

TEST_F(CFrames, what_is_wrong_is_told) {
  plane_frame();
  const double wrong[] = {1e6, -1, 1e6, 1e6}, missing[] = {1, 2, NAN, 4}, inertia[] = {1e-7, 1e-7, 1e-7, 1e-7};
  EXPECT_REFUSED(cairn_mesh_set_bars(mesh, 4, cells, wrong, area, density, nullptr, &error), "young[1] is -1");
  EXPECT_REFUSED(cairn_mesh_set_bars(mesh, 4, cells, young, area, density, missing, &error), "initial_stress[2]");
  EXPECT_REFUSED(cairn_mesh_set_bars(mesh, 0, cells, young, area, density, nullptr, &error), "at least one");
  const int32_t point[] = {1, 1}, beyond[] = {0, 9};
  EXPECT_REFUSED(cairn_mesh_set_bars(mesh, 1, point, young, area, density, nullptr, &error), "cell 0 has no length");
  EXPECT_REFUSED(cairn_mesh_set_bars(mesh, 1, beyond, young, area, density, nullptr, &error), "9");
  EXPECT_REFUSED(cairn_mesh_set_beams(mesh, 4, cells, young, area, density, nullptr, wrong, nullptr, nullptr, 0.3,
                                      nullptr, 0, nullptr, &error),
                 "inertia[1] is -1");
  EXPECT_REFUSED(cairn_mesh_set_beams(mesh, 4, cells, young, area, density, nullptr, inertia, nullptr, nullptr, NAN,
                                      nullptr, 0, nullptr, &error),
                 "poisson");
  EXPECT_REFUSED(cairn_mesh_set_kinematics(mesh, "corotational", &error), "bars and beams: give these first");
  ASSERT_EQ(cairn_mesh_set_bars(mesh, 4, cells, young, area, density, nullptr, &error), 0);
  EXPECT_REFUSED(cairn_mesh_set_kinematics(mesh, "large", &error), "give small, corotational, total_lagrangian");
  const int64_t start[9] = {};
  EXPECT_REFUSED(cairn_mesh_set_matrices(mesh, start, cells, young, young, nullptr, &error),
                 "the mesh has bars or beams");
  EXPECT_REFUSED(cairn_mesh_set_bars(mesh, 4, cells, young, area, density, nullptr, &error), "bars, or beams");
}

TEST_F(CFrames, a_beam_along_up_is_told) {
  of(3, {0, 0, 0, 0, 0, 1});
  const double inertia[] = {1e-7, 1e-7}, across[] = {1, 0, 0};
  EXPECT_REFUSED(cairn_mesh_set_beams(mesh, 1, cells, young, area, density, nullptr, inertia, nullptr, nullptr, 0.3,
                                      nullptr, 0, nullptr, &error),
                 "along beam 0: give another direction");
  ASSERT_EQ(cairn_mesh_set_beams(mesh, 1, cells, young, area, density, nullptr, inertia, nullptr, nullptr, 0.3, across,
                                 0, nullptr, &error),
            0);
  EXPECT_REFUSED(cairn_mesh_set_kinematics(mesh, "total_lagrangian", &error), "of beams: give small, corotational");
}

// ---------------------------------------------------------------------- motions

struct CMotions : CFrames {
  void bar() {
    of(2, {0, 0, 1, 0});
    ASSERT_EQ(cairn_mesh_set_bars(mesh, 1, cells, young, area, density, nullptr, &error), 0);
    hold({0}, 3);
    hold({1}, 3);
    begin(1);
  }
  double end(int axis) {
    double u[4];
    int64_t n;
    EXPECT_EQ(cairn_simulation_mesh_field(simulation, number, "displacement", 4, u, &n, &error), 0);
    return u[2 + axis];
  }
};

TEST_F(CMotions, a_table_of_one_row_and_times_before_and_after) {
  bar();
  const double at[] = {5}, there[] = {0.25}, time[] = {0.01, 0.02}, way[] = {0.1, -0.3};
  ASSERT_EQ(cairn_simulation_displace_nodes(simulation, number, 1, &one, 'x', 1, at, there, &error), 0);
  ASSERT_EQ(cairn_simulation_displace_nodes(simulation, number, 1, &one, 'y', 2, time, way, &error), 0);
  steps(1); // constant before the first instant
  EXPECT_NEAR(end(0), 0.25, 1e-15);
  EXPECT_NEAR(end(1), 0.1, 1e-15);
  steps(14);
  EXPECT_NEAR(end(1), -0.1, 1e-14);
  steps(20);
  EXPECT_NEAR(end(1), -0.3, 1e-14);
  const double back[] = {0};
  ASSERT_EQ(cairn_simulation_displace_nodes(simulation, number, 1, &one, 'y', 1, at, back, &error), 0); // anew
  steps(1);
  EXPECT_NEAR(end(1), 0, 1e-15);
}

TEST_F(CMotions, what_a_function_gives_that_is_no_number_is_told_and_the_state_is_as_before) {
  bar();
  ASSERT_EQ(cairn_simulation_displace_nodes_by(simulation, number, 1, &one, 'x', late_nan, nullptr, &error), 0);
  steps(10);
  const double before = end(0);
  EXPECT_REFUSED(cairn_simulation_step(simulation, 1e-3, nullptr, &error), "node 1 of the mesh 'mesh' along x is");
  EXPECT_EQ(end(0), before);
  ASSERT_EQ(cairn_simulation_displace_nodes_by(simulation, number, 1, &one, 'x', wave, &calls, &error), 0);
  steps(1);
  EXPECT_NEAR(end(0), 0.01 * std::sin(30 * 0.011), 1e-15);
  ASSERT_EQ(cairn_simulation_drive_nodes_by(simulation, number, 1, &one, 'x', endless, nullptr, &error), 0);
  EXPECT_REFUSED(cairn_simulation_step(simulation, 1e-3, nullptr, &error), "the velocity of node 1");
}

TEST_F(CMotions, a_step_that_cannot_be_is_told_as_without_motions) {
  bar();
  const auto same = [](double t, void*) { return 0 * t; };
  ASSERT_EQ(cairn_simulation_displace_nodes_by(simulation, number, 1, &one, 'x', same, nullptr, &error), 0);
  steps(2);
  for (const double h : {0.0, -1e-3, double(NAN), infinite}) {
    EXPECT_EQ(cairn_simulation_step(simulation, h, nullptr, &error), cairn_wrong_input);
    EXPECT_EQ(std::string(error.message).find("displacement"), std::string::npos) << h << ": " << error.message;
  }
  steps(1);
  EXPECT_EQ(end(0), 0);
}

// Displaced nodes follow a quadratic function to rounding, as the header states; after a jump of its slope, or a start
// in motion, they reach it in two steps.
TEST_F(CMotions, where_displaced_nodes_end_by_the_trapezoidal_rule) {
  of(2, {0, 0, 1, 0});
  ASSERT_EQ(cairn_mesh_set_bars(mesh, 1, cells, young, area, density, nullptr, &error), 0);
  hold({0, 1}, 3);
  begin(0.5);
  const auto bend = [](double t, void*) { return 5 * t * t; };
  const double time[] = {0, 0.01, 1}, way[] = {0, 0.01, 0.01};
  ASSERT_EQ(cairn_simulation_displace_nodes_by(simulation, number, 1, &one, 'x', bend, nullptr, &error), 0);
  ASSERT_EQ(cairn_simulation_displace_nodes(simulation, number, 1, &one, 'y', 3, time, way, &error), 0);
  for (int k = 1; k <= 14; ++k) {
    steps(1);
    const double t = 1e-3 * k, leap = k == 1 ? -1 : k == 11 ? 1 : 0; // of the slope, over 1 m/s
    EXPECT_NEAR(end(0), 5 * t * t, 1e-15) << k;
    EXPECT_NEAR(end(1), std::min(t, 0.01) + leap * 1e-3 / 4, 1e-15) << k;
  }
}

TEST_F(CMotions, what_cannot_be_moved_is_told) {
  plane_frame();
  ASSERT_EQ(cairn_mesh_set_bars(mesh, 4, cells, young, area, density, nullptr, &error), 0);
  hold({0}, 3);
  begin();
  const double time[] = {0, 1, 1}, value[] = {0, 1, NAN};
  const int32_t free = 2, foot = 0, beyond = 4;
  EXPECT_REFUSED(cairn_simulation_displace_nodes(simulation, number, 1, &free, 'y', 2, time, value, &error),
                 "node 2 of the mesh 'mesh' along y is not held; hold it");
  EXPECT_REFUSED(cairn_simulation_displace_nodes(simulation, number, 1, &beyond, 'y', 2, time, value, &error),
                 "the mesh has 4 nodes");
  EXPECT_REFUSED(cairn_simulation_displace_nodes(simulation, number, 1, &foot, 'z', 2, time, value, &error),
                 "axis is 'z'; give 'x' or 'y'");
  EXPECT_REFUSED(cairn_simulation_displace_nodes(simulation, number, 1, &foot, 0, 2, time, value, &error),
                 "axis is 0; give 'x' or 'y'");
  EXPECT_REFUSED(cairn_simulation_displace_nodes(simulation, number, 1, &foot, 'x', 0, time, value, &error), "row");
  EXPECT_REFUSED(cairn_simulation_displace_nodes(simulation, number, 1, &foot, 'x', 3, time, value, &error), "row 2");
  const double numbers[] = {0, 1, 2};
  EXPECT_REFUSED(cairn_simulation_drive_nodes(simulation, number, 1, &foot, 'x', 3, time, numbers, &error),
                 "not after 1");
  EXPECT_REFUSED(cairn_simulation_drive_nodes_by(simulation, number, 1, &foot, 'x', nullptr, nullptr, &error),
                 "function is NULL");
  EXPECT_REFUSED(cairn_simulation_displace_nodes(simulation, 7, 1, &foot, 'x', 2, time, numbers, &error), "no mesh 7");
}

TEST_F(CMotions, a_mesh_that_goes_takes_its_motions_with_it) {
  bar();
  ASSERT_EQ(cairn_simulation_displace_nodes_by(simulation, number, 1, &one, 'x', wave, &calls, &error), 0);
  steps(2);
  std::vector<double> id(2);
  int64_t n = 0;
  ASSERT_EQ(cairn_simulation_node_field(simulation, "id", 2, id.data(), &n, &error), 0);
  const int64_t ids[] = {int64_t(id[0]), int64_t(id[1])};
  ASSERT_EQ(cairn_simulation_remove_bodies(simulation, 2, ids, &error), 0) << error.message;
  const int asked = calls;
  steps(2);
  EXPECT_EQ(calls, asked);
}

// A block of rubber that is pressed faster than a whole step can follow.
TEST_F(CMotions, parts_of_a_step_ask_for_their_own_times) {
  std::vector<double> place;
  std::vector<int32_t> cell, foot, top;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i) {
      const int32_t k = 4 * j + i;
      place.insert(place.end(), {i / 3.0, j / 3.0});
      if (i < 3 && j < 3) cell.insert(cell.end(), {k, k + 1, k + 5, k + 4});
      if (j == 0) foot.push_back(k);
      if (j == 3) top.push_back(k);
    }
  of(2, place);
  const double none[] = {0, 0}, values[] = {1e5, 0.45};
  const char* names[] = {"young", "poisson"};
  ASSERT_EQ(cairn_scene_set_gravity(scene, none, &error), 0);
  ASSERT_EQ(cairn_mesh_add_solid_cells(mesh, "q4", 9, cell.data(), "neo_hookean", 2, names, values, 1000,
                                       "total_lagrangian", "strain", 0, 1, &error),
            0)
      << error.message;
  hold(foot, 3);
  hold(top, 3);
  begin();
  ASSERT_EQ(cairn_simulation_set_number(simulation, "cut_back", 6, &error), 0) << error.message;
  ASSERT_EQ(cairn_simulation_set_number(simulation, "newton_passes", 3, &error), 0) << error.message;
  std::vector<double> asked;
  const auto press = [](double t, void* context) {
    static_cast<std::vector<double>*>(context)->push_back(t);
    return -6 * t;
  };
  ASSERT_EQ(cairn_simulation_displace_nodes_by(simulation, number, 4, top.data(), 'y', press, &asked, &error), 0);
  steps(1, 0.1);
  double parts = 0;
  ASSERT_EQ(cairn_simulation_report(simulation, "sub_steps", &parts, &error), 0);
  EXPECT_GT(parts, 1);
  for (const double t : {0.0, 0.05, 0.1}) EXPECT_NE(std::find(asked.begin(), asked.end(), t), asked.end()) << t;
  std::vector<double> u(32);
  int64_t n = 0;
  ASSERT_EQ(cairn_simulation_mesh_field(simulation, number, "displacement", 32, u.data(), &n, &error), 0);
  for (const int32_t i : top) EXPECT_NEAR(u[2 * i + 1], -0.6, 1e-12);
}

// ---------------------------------------------------------------------- ties

// Two cells below three, numbers as in Python: weights and motion.
TEST_F(CFrames, sides_are_tied) {
  of(2, {0,      0,   0.5,    0,   1, 0,   0, 0.5, 0.5,    0.5, 1,      0.5, 0, 0.5,
         1. / 3, 0.5, 2. / 3, 0.5, 1, 0.5, 0, 1,   1. / 3, 1,   2. / 3, 1,   1, 1});
  const int32_t low[] = {0, 1, 4, 3, 1, 2, 5, 4}, high[] = {6, 7, 11, 10, 7, 8, 12, 11, 8, 9, 13, 12};
  ASSERT_EQ(cairn_mesh_add_elastic_cells(mesh, "q4", 2, low, 1e5, 0.3, 1000, 0, 1, &error), 0) << error.message;
  ASSERT_EQ(cairn_mesh_add_elastic_cells(mesh, "q4", 3, high, 2e5, 0.2, 1000, 0, 1, &error), 0) << error.message;
  const int32_t follow[] = {6, 7, 7, 8, 8, 9}, lead[] = {4, 3, 5, 4};
  ASSERT_EQ(cairn_mesh_tie_sides(mesh, 3, follow, 2, lead, 1e-6, &error), 0) << error.message;
  hold({0, 1, 2}, 3);
  hold({10, 11, 12, 13}, 2);
  begin();
  const int32_t top[] = {10, 11, 12, 13};
  const auto press = [](double t, void*) { return -0.1 * std::sin(30 * t); };
  ASSERT_EQ(cairn_simulation_displace_nodes_by(simulation, number, 4, top, 'y', press, nullptr, &error), 0);
  steps(50);
  same({0,
        0,
        0,
        0,
        0,
        0,
        -0.014876057841267415,
        -0.06595781198192413,
        0,
        -0.061848819399262234,
        0.014876057841267443,
        -0.065957811981924186,
        -0.014876057841267415,
        -0.06595781198192413,
        -0.0049586859470891476,
        -0.062876067544927972,
        0.0049586859470890365,
        -0.062876067544927972,
        0.014876057841267443,
        -0.065957811981924186,
        -0.020995844080224361,
        -0.099749499919559392,
        -0.010806999063588063,
        -0.099749499919559392,
        0.010806999063588285,
        -0.099749499919559392,
        0.020995844080224479,
        -0.099749499919559392},
       1e-11);
}

// A cell below four, numbers of the last nodes as in Python.
TEST_F(CFrames, faces_are_tied) {
  std::vector<double> place;
  for (const int n : {1, 2})
    for (int k = 0; k < 2; ++k)
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i) place.insert(place.end(), {double(i) / n, double(j) / n, 0.5 * (n - 1 + k)});
  of(3, place);
  const int32_t low[] = {0, 1, 3, 2, 4, 5, 7, 6};
  std::vector<int32_t> high, follow;
  for (const int32_t k : {8, 9, 11, 12}) {
    const int32_t face[] = {k, k + 1, k + 4, k + 3};
    high.insert(high.end(), face, face + 4);
    for (const int32_t i : face) high.push_back(i + 9);
    follow.insert(follow.end(), {face[0], face[3], face[2], face[1]});
  }
  ASSERT_EQ(cairn_mesh_add_elastic_cells(mesh, "hex8", 1, low, 1e5, 0.3, 1000, 0, 1, &error), 0) << error.message;
  ASSERT_EQ(cairn_mesh_add_elastic_cells(mesh, "hex8", 4, high.data(), 2e5, 0.2, 1000, 0, 1, &error), 0)
      << error.message;
  const int32_t lead[] = {4, 5, 7, 6};
  ASSERT_EQ(cairn_mesh_tie_sides(mesh, 4, follow.data(), 1, lead, 1e-6, &error), 0) << error.message;
  hold({0, 1, 2, 3}, 7);
  begin();
  std::vector<double> load(3 * 26, 0.0);
  for (int i = 17; i < 26; ++i) load[3 * i] = 100.0 / 9;
  ASSERT_EQ(cairn_simulation_load_mesh(simulation, number, load.data(), load.data(), nullptr, &error), 0);
  steps(50);
  std::vector<double> u(3 * 26);
  int64_t n = 0;
  ASSERT_EQ(cairn_simulation_mesh_field(simulation, number, "displacement", 3 * 26, u.data(), &n, &error), 0);
  const double python[] = {0.0015777366697101128,
                           0.0004330832814166605,
                           -0.012667400256009653,
                           0.00082296436458573208,
                           0.00063770152431109851,
                           -0.013371265885971928,
                           0.00026443973864176407,
                           0.0008802136496532403,
                           -0.013187023238277029,
                           0.0010223925886673028,
                           0,
                           -0.013222199186794015,
                           0.00030728502545818159,
                           0,
                           -0.013812052092801119,
                           -0.00025301045995518301,
                           0,
                           -0.01352033258514862,
                           0.0015777366697100493,
                           -0.00043308328141644648,
                           -0.012667400256009653,
                           0.00082296436458573208,
                           -0.00063770152431119609,
                           -0.013371265885971817,
                           0.00026443973864176407,
                           -0.00088021364965307214,
                           -0.013187023238276807};
  for (int i = 0; i < 27; ++i) EXPECT_NEAR(u[3 * 17 + i], python[i], 1e-12 * 0.0138) << i;
}

TEST_F(CFrames, sides_that_cannot_be_tied_are_told) {
  of(2, {0, 0, 1, 0, 1, 1, 0, 1, 0, 1.01, 1, 1.01, 1, 2, 0, 2, 2, 1});
  const int32_t own[] = {4, 5}, other[] = {2, 3}, half[] = {2, 3, 2, 3}, off[] = {2, 8};
  EXPECT_REFUSED(cairn_mesh_tie_sides(mesh, 1, own, 1, other, 1e-6, &error), "give a larger within, 0.0101 or more");
  EXPECT_REFUSED(cairn_mesh_tie_sides(mesh, 1, own, 2, half, 0.02, &error), "1 more than once");
  EXPECT_REFUSED(cairn_mesh_tie_sides(mesh, 1, own, 1, off, 0.02, &error), "let the finer side follow");
  EXPECT_REFUSED(cairn_mesh_tie_sides(mesh, 1, own, 1, other, NAN, &error), "within is nan");
  EXPECT_REFUSED(cairn_mesh_tie_sides(mesh, 0, own, 1, other, 1e-6, &error), "at least one side");
}

} // namespace
