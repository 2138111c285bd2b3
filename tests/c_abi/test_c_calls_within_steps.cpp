// Calls that a body, a law or a material of the program may make to the simulation that calls it: readers alone,
// nothing that changes the step under way.
#include <dlfcn.h>

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

// A body that is made deformable is looked at in its contacts, for which other bodies are asked for their forces.
TEST_F(CWithinSteps, nothing_changes_a_body_that_is_being_made_deformable) {
  springs();
  steps(2);
  const auto before = places();
  cairn_mesh* square = nullptr;
  const double corner[] = {-0.1, -0.1, 0.1, -0.1, 0.1, 0.1, -0.1, 0.1};
  const int32_t cell[] = {0, 1, 2, 3};
  ASSERT_EQ(cairn_mesh_create(2, 4, corner, &square, &error), 0);
  ASSERT_EQ(cairn_mesh_add_elastic_cells(square, "q4", 1, cell, 1e7, 0.3, 1000, 0, 1, &error), 0);
  meddler = {simulation, [](auto* s, auto* e) { return cairn_simulation_step(s, 1e-3, nullptr, e); }, 0, 0, ""};
  int32_t number = -1;
  EXPECT_EQ(cairn_simulation_deform(simulation, 2, square, nullptr, -1, -1, &number, &error), 0) << error.message;
  EXPECT_GT(meddler.asked, 0);
  EXPECT_EQ(meddler.code, cairn_wrong_input);
  EXPECT_EQ(places(), before);
  meddler.asked = meddler.code = 0;
  EXPECT_EQ(cairn_simulation_rigidify(simulation, number, nullptr, &error), 0) << error.message;
  EXPECT_GT(meddler.asked, 0);
  EXPECT_EQ(meddler.code, cairn_wrong_input);
  EXPECT_EQ(places(), before);
  meddler.simulation = nullptr;
  steps(2);
  cairn_mesh_destroy(square);
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

// Callbacks of laws and materials get no context.
Meddler* asks = nullptr;
void ask() { // laws are asked by several threads
#pragma omp critical
  if (asks && asks->simulation) {
    cairn_error error{};
    asks->code = asks->meddle(asks->simulation, &error);
    asks->said = error.message;
    ++asks->asked;
  }
}

struct CWithinLaws : CWithinSteps {
  ~CWithinLaws() override { asks = nullptr; }
  void meddles(const std::function<void()>& scene_of) {
    scene_of();
    steps(2);
    const auto as_alone = [&] {
      steps(5);
      std::vector<double> x = field("position");
      if (cairn_simulation_nodes(simulation) > 0) {
        std::vector<double> more(8);
        int64_t n = 0;
        EXPECT_EQ(cairn_simulation_mesh_field(simulation, 0, "position", 8, more.data(), &n, &error), 0);
        x.insert(x.end(), more.begin(), more.end());
      }
      return x;
    };
    const auto wanted = as_alone();
    cairn_simulation_destroy(simulation);
    simulation = nullptr;
    start();
    steps(2);
    meddler = {simulation, [](auto* s, auto* e) { return cairn_simulation_step(s, 1e-3, nullptr, e); }, 0, 0, ""};
    asks = &meddler;
    const auto is = as_alone();
    EXPECT_GT(meddler.asked, 0);
    EXPECT_EQ(meddler.code, cairn_wrong_input);
    EXPECT_NE(meddler.said.find("cairn_simulation_step stands between steps, and one is being made"), std::string::npos)
        << meddler.said;
    EXPECT_EQ(is, wanted);
    double done = 0;
    ASSERT_EQ(cairn_simulation_report(simulation, "step", &done, &error), 0) << error.message;
    EXPECT_EQ(done, 7);
  }
};

TEST_F(CWithinLaws, a_law_may_not_step) {
  ASSERT_EQ(cairn_plug_contact_law(MEDDLING_LAW, "meddling", 1, &error), 0) << error.message;
  void* library = dlopen(MEDDLING_LAW, RTLD_NOW);
  ASSERT_NE(library, nullptr) << dlerror();
  auto* given = static_cast<void (**)(void)>(dlsym(library, "meddle"));
  ASSERT_NE(given, nullptr);
  *given = ask;
  meddles([&] {
    const double mu = 0.3;
    make(2);
    ASSERT_EQ(cairn_scene_set_law(scene, -1, -1, "meddling", 1, &mu, &error), 0) << error.message;
    floor(2);
    ball(2, body({0, 0.1}), 0.1, rock);
    ball(2, body({0, 0.3}), 0.1, rock);
    start();
  });
  *given = nullptr;
  dlclose(library);
}

extern "C" {
// Hooke's law without lateral contraction, in the order of Abaqus's interface.
static void meddling_umat(double* stress, double*, double* tangent, double*, double*, double*, double*, double*,
                          double*, double*, double* strain, double* change, double*, double*, double*, double*, double*,
                          double*, char*, int* direct, int* shear, int* components, int*, double* props) {
  ask();
  (void)shear;
  const int n = *components;
  for (int i = 0; i < n; ++i) {
    const double modulus = i < *direct ? props[0] : props[0] / 2;
    for (int j = 0; j < n; ++j) tangent[n * j + i] = i == j ? modulus : 0;
    stress[i] = modulus * (strain[i] + change[i]);
  }
}
}

TEST_F(CWithinLaws, a_material_may_not_step) {
  ASSERT_EQ(cairn_give_material("meddling", reinterpret_cast<cairn_umat*>(meddling_umat), 0, &error), 0)
      << error.message;
  meddles([&] {
    const double place[] = {0, 0, 1, 0, 1, 1, 0, 1}, young = 1e5;
    const int32_t cell[] = {0, 1, 2, 3}, low[] = {0, 1};
    make(2);
    ASSERT_EQ(cairn_mesh_create(2, 4, place, &mesh, &error), 0);
    ASSERT_EQ(cairn_mesh_add_solid_cells(mesh, "q4", 1, cell, "meddling", 1, nullptr, &young, 1000, "small", "strain",
                                         0, 1, &error),
              0)
        << error.message;
    ASSERT_EQ(cairn_mesh_hold(mesh, 2, low, 3, &error), 0);
    ASSERT_EQ(cairn_scene_add_mesh(scene, mesh, "square", rock, -1, nullptr, nullptr, &error), 0) << error.message;
    ball(2, body({5, 5}), 0.1, rock);
    start();
  });
}

// Functions of time, and callbacks before parts of a step, may set loads alone.
TEST_F(CWithinLaws, a_function_of_time_may_not_step) {
  const auto sway = [](double t, void*) {
    ask();
    return 0.01 * std::sin(30 * t);
  };
  const int32_t foot = 0;
  const double place[] = {0, 0, 1, 0, 1, 1, 0, 1}, young = 1e5;
  const int32_t cell[] = {0, 1, 2, 3}, low[] = {0, 1};
  make(2);
  ASSERT_EQ(cairn_mesh_create(2, 4, place, &mesh, &error), 0);
  ASSERT_EQ(cairn_mesh_add_elastic_cells(mesh, "q4", 1, cell, young, 0.3, 1000, 0, 1, &error), 0);
  ASSERT_EQ(cairn_mesh_hold(mesh, 2, low, 3, &error), 0);
  ASSERT_EQ(cairn_scene_add_mesh(scene, mesh, "square", rock, -1, nullptr, nullptr, &error), 0) << error.message;
  start();
  ASSERT_EQ(cairn_simulation_displace_nodes_by(simulation, 0, 1, &foot, 'x', sway, nullptr, &error), 0);
  meddler = {simulation, [](auto* s, auto* e) { return cairn_simulation_step(s, 1e-3, nullptr, e); }, 0, 0, ""};
  asks = &meddler;
  steps(3);
  EXPECT_EQ(meddler.asked, 9);
  EXPECT_EQ(meddler.code, cairn_wrong_input);
  EXPECT_NE(meddler.said.find("cairn_simulation_step stands between steps"), std::string::npos) << meddler.said;
  double done = 0;
  ASSERT_EQ(cairn_simulation_report(simulation, "step", &done, &error), 0) << error.message;
  EXPECT_EQ(done, 3);
}

} // namespace
