// A pressure that follows a body whose forces functions of the program find, through the C API.
#include <algorithm>
#include <cmath>

#include "c_scene.hpp"

namespace {

constexpr int nodes = 12;
constexpr double pi = 3.14159265358979323846;

// A spring of its own, to the ground, for each dof.
int32_t springs(void*, int64_t n, int64_t entries, double, double, double, const double* u, const double*,
                double* force, double* tangent, double* energy, double*) {
  *energy = 0;
  for (int64_t i = 0; i < n; ++i) force[i] = 1e3 * u[i], *energy += 500 * u[i] * u[i];
  if (tangent) std::fill_n(tangent, entries, 1e3);
  return 0;
}

struct CPressed : CScene {
  cairn_mesh* mesh = nullptr;
  int32_t number = -1, set = -1;
  std::vector<double> place;
  std::vector<int32_t> skin;
  ~CPressed() override { cairn_mesh_destroy(mesh); }
  // Nodes on a ring, or in a row along x = 1, between which there is a skin.
  void of(bool ring, double size = 1) {
    const double none[] = {0, 0};
    make(2);
    ASSERT_EQ(cairn_scene_set_gravity(scene, none, &error), 0);
    for (int i = 0; i < nodes; ++i) {
      const double turn = 2 * pi * i / nodes;
      place.push_back(size * (ring ? std::cos(turn) : 1));
      place.push_back(size * (ring ? std::sin(turn) : double(i) / (nodes - 1)));
      if (ring || i + 1 < nodes) skin.insert(skin.end(), {i, (i + 1) % nodes});
    }
    ASSERT_EQ(cairn_mesh_create(2, nodes, place.data(), &mesh, &error), 0) << error.message;
    std::vector<int64_t> start;
    std::vector<int32_t> row;
    for (int i = 0; i <= 2 * nodes; ++i) start.push_back(i), row.push_back(i);
    const std::vector<double> mass(nodes, 1e-3);
    cairn_body_calls calls{};
    calls.abi = CAIRN_BODY_CALLS_ABI;
    calls.size = sizeof calls;
    calls.gives_energy = 1;
    calls.dofs = calls.entries = 2 * nodes;
    calls.forces = springs;
    EXPECT_REFUSED(cairn_mesh_set_sides(mesh, 1, skin.data(), "strain", 1, &error), "another code finds");
    ASSERT_EQ(cairn_mesh_set_calls(mesh, start.data(), row.data(), nullptr, mass.data(), &calls, &error), 0)
        << error.message;
  }
  int64_t sides() const { return int64_t(skin.size()) / 2; }
  void press(double pressure) {
    ASSERT_EQ(cairn_scene_add_mesh(scene, mesh, "skin", rock, -1, nullptr, &number, &error), 0) << error.message;
    start();
    ASSERT_EQ(cairn_simulation_set_number(simulation, "theta", 1, &error), 0);
    ASSERT_EQ(cairn_simulation_set_number(simulation, "newton_tol", 1e-12, &error), 0);
    ASSERT_EQ(cairn_simulation_press_mesh(simulation, number, 2, sides(), skin.data(), &set, &error), 0)
        << error.message;
    ASSERT_EQ(cairn_simulation_set_pressure(simulation, number, set, pressure, pressure, &error), 0);
    steps(3, 1);
  }
  std::vector<double> places() {
    std::vector<double> x(2 * nodes);
    int64_t n = 0;
    EXPECT_EQ(cairn_simulation_mesh_field(simulation, number, "position", 2 * nodes, x.data(), &n, &error), 0);
    return x;
  }
  int passes() {
    double value = -1;
    EXPECT_EQ(cairn_simulation_report(simulation, "newton_passes", &value, &error), 0);
    return int(value);
  }
};

// A corner of the ring is pushed by p thickness sin(a) r towards the middle.
TEST_F(CPressed, the_tangent_knows_what_no_spring_couples) {
  for (const double size : {1.0, 1e-9, 1e6}) {
    place.clear(), skin.clear();
    cairn_mesh_destroy(mesh), mesh = nullptr;
    cairn_simulation_destroy(simulation), simulation = nullptr;
    cairn_scene_destroy(scene), scene = nullptr;
    of(true, size);
    ASSERT_EQ(cairn_mesh_set_sides(mesh, sides(), skin.data(), "strain", 0.5, &error), 0) << error.message;
    press(1000);
    EXPECT_LE(passes(), 3);
    const std::vector<double> x = places();
    for (int i = 0; i < nodes; ++i)
      EXPECT_NEAR(std::hypot(x[2 * i], x[2 * i + 1]), size / (1 + 0.5 * std::sin(2 * pi / nodes)), 1e-5 * size);
  }
}

// Without the sides the balance is the same, in more passes.
TEST_F(CPressed, without_sides_it_takes_more_passes) {
  of(true);
  press(500);
  EXPECT_GT(passes(), 3);
  const std::vector<double> x = places();
  EXPECT_NEAR(std::hypot(x[0], x[1]), 1 / (1 + 0.5 * std::sin(2 * pi / nodes)), 1e-5);
}

// A skin that goes round the axis x = 0: a metre of it carries 2 pi r p.
TEST_F(CPressed, round_an_axis) {
  of(false);
  ASSERT_EQ(cairn_mesh_set_sides(mesh, sides(), skin.data(), "axisymmetric", 1, &error), 0) << error.message;
  press(10);
  const std::vector<double> x = places();
  double force = 0;
  for (int i = 0; i < nodes; ++i) force += 1e3 * (1 - x[2 * i]);
  double middle = 0, high = 0;
  for (int i = 0; i + 1 < nodes; ++i) {
    const double rise = x[2 * i + 3] - x[2 * i + 1];
    middle += rise * (x[2 * i] + x[2 * i + 2]) / 2, high += rise;
  }
  EXPECT_NEAR(force, 2 * pi * 10 * middle, 1e-5 * force);
  EXPECT_GT(high, 0.9);
}

TEST_F(CPressed, what_is_wrong_is_told) {
  of(true);
  const int32_t beyond[] = {0, 99};
  EXPECT_REFUSED(cairn_mesh_set_sides(mesh, 1, beyond, "strain", 1, &error), "99");
  EXPECT_REFUSED(cairn_mesh_set_sides(mesh, 1, skin.data(), "flat", 1, &error), "plane is 'flat'");
  EXPECT_REFUSED(cairn_mesh_set_sides(mesh, 1, skin.data(), "strain", 0, &error), "thickness is 0");
  EXPECT_REFUSED(cairn_mesh_set_sides(mesh, 1, skin.data(), "strain", NAN, &error), "thickness is nan");
  int64_t n = -1;
  std::vector<int32_t> told(2 * nodes);
  ASSERT_EQ(cairn_mesh_set_sides(mesh, sides(), skin.data(), "strain", 1, &error), 0) << error.message;
  ASSERT_EQ(cairn_mesh_boundary(mesh, 2 * nodes, told.data(), &n, &error), 0);
  EXPECT_EQ(told, skin);
}

} // namespace
