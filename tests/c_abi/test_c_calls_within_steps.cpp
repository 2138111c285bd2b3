// What a body of the program may ask of the simulation that calls it: to look, and nothing that a step would find half
// done.
#include <algorithm>
#include <cstdio>
#include <functional>

#include "c_scene.hpp"

namespace {

// Two nodes on springs to the ground.
constexpr int dofs = 4;
struct Meddler {
  cairn_simulation* simulation = nullptr;
  std::function<int32_t(cairn_simulation*, cairn_error*)> meddle;
  int asked = 0, code = 0;
  std::string said;
};

int32_t forces(void* context, int64_t n, int64_t, double, double, double, const double* u, const double*, double* force,
               double* tangent, double* energy, double*) {
  auto& m = *static_cast<Meddler*>(context);
  if (m.simulation && m.meddle) {
    cairn_error error{};
    m.code = m.meddle(m.simulation, &error);
    m.said = error.message;
    ++m.asked;
  }
  *energy = 0;
  for (int64_t i = 0; i < n; ++i) {
    force[i] = 1e3 * u[i];
    *energy += 500 * u[i] * u[i];
    if (tangent) tangent[i] = 1e3;
  }
  return 0;
}

struct CWithinSteps : CScene {
  cairn_mesh* mesh = nullptr;
  Meddler meddler;
  ~CWithinSteps() override { cairn_mesh_destroy(mesh); }
  void springs() {
    const double place[dofs] = {0, 0, 1, 0}, mass[] = {1, 1}, speed[dofs] = {1, 0, 0, 2};
    const int64_t first[] = {0, 1, 2, 3, 4};
    const int32_t row[] = {0, 1, 2, 3};
    cairn_body_calls calls{};
    calls.abi = CAIRN_BODY_CALLS_ABI;
    calls.size = sizeof calls;
    calls.gives_energy = 1;
    calls.dofs = calls.entries = dofs;
    calls.context = &meddler;
    calls.forces = forces;
    make(2);
    ASSERT_EQ(cairn_mesh_create(2, 2, place, &mesh, &error), 0);
    ASSERT_EQ(cairn_mesh_set_calls(mesh, first, row, nullptr, mass, &calls, &error), 0) << error.message;
    ASSERT_EQ(cairn_mesh_set_motion(mesh, nullptr, speed, &error), 0);
    ASSERT_EQ(cairn_scene_add_mesh(scene, mesh, "springs", rock, -1, nullptr, nullptr, &error), 0) << error.message;
    ball(2, body({5, 5}), 0.1, rock);
    start();
  }
  std::vector<double> places() {
    std::vector<double> x(dofs);
    int64_t n = 0;
    EXPECT_EQ(cairn_simulation_mesh_field(simulation, 0, "position", dofs, x.data(), &n, &error), 0);
    return x;
  }
};

TEST_F(CWithinSteps, nothing_changes_what_a_step_is_made_of) {
  springs();
  steps(5);
  const auto as_alone = places();
  const double zero[6] = {}, one = 1;
  const int64_t ball = 2;
  const int32_t node = 0;
  using Call = std::function<int32_t(cairn_simulation*, cairn_error*)>;
  const std::pair<const char*, Call> calls[] = {
      {"step", [](auto* s, auto* e) { return cairn_simulation_step(s, 1e-3, nullptr, e); }},
      {"set_option", [](auto* s, auto* e) { return cairn_simulation_set_option(s, "solver", "auto", e); }},
      {"set_number", [](auto* s, auto* e) { return cairn_simulation_set_number(s, "tol", 1e-3, e); }},
      {"set_gravity", [&](auto* s, auto* e) { return cairn_simulation_set_gravity(s, zero, e); }},
      {"drive", [&](auto* s, auto* e) { return cairn_simulation_drive(s, 1, &ball, 1, zero, e); }},
      {"set_body_field",
       [&](auto* s, auto* e) { return cairn_simulation_set_body_field(s, "velocity", 1, nullptr, zero, e); }},
      {"set_body_field",
       [&](auto* s, auto* e) { return cairn_simulation_set_body_field(s, "force", 1, nullptr, zero, e); }},
      {"set_node_field",
       [&](auto* s, auto* e) { return cairn_simulation_set_node_field(s, "velocity", 2, nullptr, zero, e); }},
      {"add_bodies",
       [&](auto* s, auto* e) {
         return cairn_simulation_add_bodies(s, 1, zero, nullptr, nullptr, &one, &one, nullptr, e);
       }},
      {"remove_bodies", [&](auto* s, auto* e) { return cairn_simulation_remove_bodies(s, 1, &ball, e); }},
      {"load_mesh", [&](auto* s, auto* e) { return cairn_simulation_load_mesh(s, 0, zero, nullptr, nullptr, e); }},
      {"press_mesh", [&](auto* s, auto* e) { return cairn_simulation_press_mesh(s, 0, 2, 0, &node, nullptr, e); }},
      {"set_pressure", [](auto* s, auto* e) { return cairn_simulation_set_pressure(s, 0, 0, 1, 1, e); }},
      {"deform", [&](auto* s, auto* e) { return cairn_simulation_deform(s, ball, mesh, nullptr, -1, -1, nullptr, e); }},
      {"rigidify", [](auto* s, auto* e) { return cairn_simulation_rigidify(s, 0, nullptr, e); }},
      {"write_checkpoint", [](auto* s, auto* e) { return cairn_simulation_write_checkpoint(s, "half.h5", e); }},
      {"restart", [](auto* s, auto* e) { return cairn_simulation_restart(s, "half.h5", e); }},
      {"add_network", [](auto* s, auto* e) { return cairn_simulation_add_network(s, "thermal", e); }},
  };
  for (const auto& [name, call] : calls) {
    cairn_simulation_destroy(simulation);
    simulation = nullptr;
    start();
    steps(2);
    meddler = {simulation, call, 0, 0, ""};
    steps(1);
    EXPECT_GT(meddler.asked, 0) << name;
    EXPECT_EQ(meddler.code, cairn_wrong_input) << name;
    EXPECT_NE(meddler.said.find(name), std::string::npos) << name << ": " << meddler.said;
    EXPECT_NE(meddler.said.find("stands between steps, and one is being made"), std::string::npos) << meddler.said;
    meddler.simulation = nullptr;
    steps(2);
    EXPECT_EQ(places(), as_alone) << name;
  }
}

TEST_F(CWithinSteps, looking_and_another_simulation_are_free) {
  springs();
  meddler = {simulation,
             [](auto* s, auto* e) {
               double value = 0;
               int64_t n = 0;
               double x[dofs];
               return cairn_simulation_energy(s, "kinetic", &value, e) +
                      cairn_simulation_mesh_field(s, 0, "velocity", dofs, x, &n, e);
             },
             0, 0, ""};
  steps(2);
  EXPECT_GT(meddler.asked, 0);
  EXPECT_EQ(meddler.code, 0) << meddler.said;
  cairn_scene* empty = nullptr;
  cairn_simulation* other = nullptr;
  ASSERT_EQ(cairn_scene_create(2, &empty, &error), 0);
  ASSERT_EQ(cairn_simulation_create(empty, nullptr, &other, &error), 0) << error.message;
  meddler.meddle = [&](auto*, auto* e) { return cairn_simulation_step(other, 1e-3, nullptr, e); };
  steps(1);
  EXPECT_EQ(meddler.code, 0) << meddler.said;
  meddler.simulation = nullptr;
  EXPECT_EQ(cairn_simulation_step(simulation, -1, nullptr, &error), cairn_wrong_input); // and fails, and goes on
  steps(1);
  cairn_simulation_destroy(other);
  cairn_scene_destroy(empty);
}

} // namespace
