// Deformable bodies whose forces functions of the program find, through the C API; histories of several simulations.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "c_scene.hpp"

namespace {

// A row of springs along x on ground springs that yield; the state is their plastic elongation.
constexpr int nodes = 5, dofs = 2 * nodes, entries = 3 * dofs - 3;
struct Springs {
  double k = 2e4, most = 30, slipped[nodes - 1] = {}, trial[nodes - 1] = {};
  int commits = 0, rollbacks = 0, refuse = 0, spoil = 0;
};

int32_t forces(void* context, int64_t n, int64_t, double, double, double, const double* u, const double*, double* force,
               double* tangent, double* energy, double* dissipated) {
  auto& s = *static_cast<Springs*>(context);
  if (s.refuse) return 7;
  std::fill_n(force, n, 0.0);
  double diagonal[dofs] = {}, side[dofs] = {};
  *energy = *dissipated = 0;
  for (int i = 0; i < nodes; ++i) {
    force[2 * i + 1] = s.k * u[2 * i + 1];
    diagonal[2 * i + 1] = s.k;
    *energy += 0.5 * s.k * u[2 * i + 1] * u[2 * i + 1];
  }
  for (int i = 0; i + 1 < nodes; ++i) {
    const double longer = u[2 * i + 2] - u[2 * i], elastic = s.k * (longer - s.slipped[i]);
    const bool slips = std::abs(elastic) > s.most;
    const double pull = slips ? std::copysign(s.most, elastic) : elastic, slope = slips ? 1e-3 * s.k : s.k;
    s.trial[i] = slips ? longer - pull / s.k : s.slipped[i];
    force[2 * i] -= pull;
    force[2 * i + 2] += pull;
    diagonal[2 * i] += slope;
    diagonal[2 * i + 2] += slope;
    side[2 * i] = -slope;
    *energy += 0.5 * pull * pull / s.k;
    *dissipated += s.most * std::abs(s.trial[i] - s.slipped[i]);
  }
  if (s.spoil) force[3] = NAN;
  if (!tangent) return 0;
  double* t = tangent; // columns of a lower triangle: the diagonal, the row below, that of the next node
  for (int c = 0; c < dofs; ++c) {
    *t++ = diagonal[c];
    if (c + 1 < dofs) *t++ = 0;
    if (c + 2 < dofs) *t++ = side[c];
  }
  return t - tangent == entries ? 0 : 1;
}
int32_t commit(void* context) {
  auto& s = *static_cast<Springs*>(context);
  std::copy_n(s.trial, nodes - 1, s.slipped);
  ++s.commits;
  return 0;
}
int32_t rollback(void* context) { return ++static_cast<Springs*>(context)->rollbacks, 0; }
int64_t state_size(void*) { return nodes - 1; }
int32_t save(void* context, int64_t n, double* state) {
  std::copy_n(static_cast<Springs*>(context)->slipped, n, state);
  return 0;
}
int32_t load(void* context, int64_t n, const double* state) {
  if (n != nodes - 1) return 1;
  std::copy_n(state, n, static_cast<Springs*>(context)->slipped);
  return 0;
}
int alive = 0;
int32_t create(void* context, void** another) {
  auto* made = new Springs(*static_cast<Springs*>(context));
  std::fill_n(made->slipped, nodes - 1, 0.0);
  *another = made;
  return ++alive, 0;
}
void destroy(void* context) {
  delete static_cast<Springs*>(context);
  --alive;
}
const char* complaint(void*) { return "the springs are tired"; }

struct CCalls : CScene {
  cairn_mesh* mesh = nullptr;
  cairn_simulation* second = nullptr;
  Springs springs;
  std::vector<int64_t> start_{0};
  std::vector<int32_t> row;
  const double node_mass[nodes] = {0.5, 0.5, 0.5, 0.5, 0.5};
  CCalls() {
    for (int c = 0; c < dofs; ++c) {
      for (int r = c; r < std::min(c + 3, dofs); ++r) row.push_back(r);
      start_.push_back(int64_t(row.size()));
    }
  }
  ~CCalls() override {
    cairn_simulation_destroy(second);
    cairn_mesh_destroy(mesh);
  }
  cairn_body_calls calls() {
    cairn_body_calls c{};
    c.abi = CAIRN_BODY_CALLS_ABI;
    c.size = sizeof c;
    c.gives_energy = c.gives_dissipation = 1;
    c.dofs = dofs;
    c.entries = entries;
    c.context = &springs;
    c.forces = forces;
    c.commit = commit;
    c.rollback = rollback;
    c.state_size = state_size;
    c.save = save;
    c.load = load;
    c.create = create;
    c.destroy = destroy;
    c.complaint = complaint;
    return c;
  }
  int32_t give(const cairn_body_calls& c) {
    return cairn_mesh_set_calls(mesh, start_.data(), row.data(), nullptr, node_mass, &c, &error);
  }
  void row_of_springs() {
    double place[dofs];
    for (int i = 0; i < nodes; ++i) place[2 * i] = 0.25 * i, place[2 * i + 1] = 0;
    ASSERT_EQ(cairn_mesh_create(2, nodes, place, &mesh, &error), 0) << error.message;
  }
  // A scene in which a disk hits the free end.
  void hit(const cairn_body_calls& c) {
    set_up(c);
    start();
  }
  void set_up(const cairn_body_calls& c) {
    make(2);
    row_of_springs();
    ASSERT_EQ(give(c), 0) << error.message;
    const int32_t first = 0, last = nodes - 1;
    ASSERT_EQ(cairn_mesh_hold(mesh, 1, &first, 3, &error), 0);
    ASSERT_EQ(cairn_mesh_touch_nodes(mesh, 1, &last, &error), 0);
    ASSERT_EQ(cairn_scene_add_mesh(scene, mesh, "springs", rock, -1, nullptr, nullptr, &error), 0) << error.message;
    ball(2, body({1.2, 0.0}, 2.0, 0.02), 0.15, rock);
    const double fast[] = {-3, 0, 0};
    ASSERT_EQ(cairn_scene_set_body_field(scene, "velocity", 1, nullptr, fast, &error), 0) << error.message;
  }
  std::vector<double> way(cairn_simulation* of) {
    std::vector<double> u(dofs);
    int64_t count = 0;
    EXPECT_EQ(cairn_simulation_mesh_field(of, 0, "displacement", dofs, u.data(), &count, &error), 0);
    return u;
  }
  void go(cairn_simulation* of, int n) {
    for (int i = 0; i < n; ++i) ASSERT_EQ(cairn_simulation_step(of, 5e-4, nullptr, &error), 0) << error.message;
  }
};

TEST_F(CCalls, each_simulation_has_a_history_of_its_own) {
  hit(calls());
  const int before = springs.commits;
  go(simulation, 40);
  EXPECT_EQ(springs.commits, before + 40);
  EXPECT_EQ(text("status"), "converged");
  EXPECT_GT(energy("dissipated_material"), 0.01 * energy("in_play"));
  EXPECT_LT(std::abs(energy("closure")), 1e-10 * energy("in_play"));
  ASSERT_EQ(cairn_simulation_create(scene, nullptr, &second, &error), 0) << error.message;
  EXPECT_EQ(alive, 1);
  go(second, 40);
  EXPECT_EQ(springs.commits, before + 40);
  EXPECT_EQ(way(simulation), way(second));
  const char* path = "c_calls.checkpoint.h5";
  ASSERT_EQ(cairn_simulation_write_checkpoint(simulation, path, &error), 0) << error.message;
  go(simulation, 20);
  go(second, 5);
  ASSERT_EQ(cairn_simulation_restart(second, path, &error), 0) << error.message;
  go(second, 20);
  EXPECT_EQ(way(simulation), way(second));
  std::remove(path);
  cairn_simulation_destroy(second);
  second = nullptr;
  EXPECT_EQ(alive, 0);
}

TEST_F(CCalls, a_history_without_create_is_of_one_simulation) {
  cairn_body_calls c = calls();
  c.create = nullptr;
  c.destroy = nullptr;
  c.state_size = nullptr;
  c.save = nullptr;
  c.load = nullptr;
  hit(c);
  EXPECT_EQ(cairn_simulation_create(scene, nullptr, &second, &error), cairn_wrong_input);
  EXPECT_NE(std::string(error.message).find("is of one simulation"), std::string::npos) << error.message;
  go(simulation, 3);
  EXPECT_EQ(cairn_simulation_write_checkpoint(simulation, "none.h5", &error), cairn_wrong_input);
  EXPECT_NE(std::string(error.message).find("keeps a history and does not give it"), std::string::npos);
}

TEST_F(CCalls, a_simulation_that_is_refused_leaves_the_history_to_the_next) {
  cairn_body_calls c = calls();
  c.create = nullptr;
  c.destroy = nullptr;
  set_up(c);
  cairn_nscd options;
  cairn_nscd_defaults(&options);
  options.project_positions = 1;
  EXPECT_REFUSED(cairn_simulation_create(scene, &options, &second, &error), "project_positions");
  ASSERT_EQ(cairn_simulation_create(scene, nullptr, &second, &error), 0) << error.message;
  go(second, 3);
  EXPECT_REFUSED(cairn_simulation_create(scene, nullptr, &simulation, &error), "is of one simulation");
}

TEST_F(CCalls, what_fails_is_told_and_undone) {
  hit(calls());
  go(simulation, 30);
  const auto before = way(simulation);
  const int commits = springs.commits;
  springs.refuse = 1;
  EXPECT_EQ(cairn_simulation_step(simulation, 5e-4, nullptr, &error), cairn_wrong_input);
  EXPECT_NE(std::string(error.message).find("the mesh 'springs': the calls finds no forces (7): the springs are tired"),
            std::string::npos)
      << error.message;
  springs.refuse = 0;
  springs.spoil = 1;
  EXPECT_EQ(cairn_simulation_step(simulation, 5e-4, nullptr, &error), cairn_wrong_input);
  EXPECT_NE(std::string(error.message).find("on node 1 along y is not finite"), std::string::npos) << error.message;
  springs.spoil = 0;
  EXPECT_EQ(before, way(simulation));
  EXPECT_EQ(springs.commits, commits);
  EXPECT_EQ(springs.rollbacks, 3); // of the stiffness at rest, and of two steps
  go(simulation, 1);
}

TEST_F(CCalls, what_does_not_fit_is_refused) {
  row_of_springs();
  const auto refused = [&](cairn_body_calls c, const char* why) {
    EXPECT_EQ(give(c), cairn_wrong_input) << why;
    EXPECT_NE(std::string(error.message).find(why), std::string::npos) << error.message;
  };
  cairn_body_calls c = calls();
  c.abi = 99;
  refused(c, "ABI version of the calls is 99, and 1 was expected: compile");
  c = calls();
  c.size = 8;
  refused(c, "size of the calls is 8");
  c = calls();
  c.dofs = 3;
  refused(c, "dofs of the calls is 3, and 10 was expected: give the nodes");
  c = calls();
  c.entries = 1;
  refused(c, "entries of the calls is 1");
  c = calls();
  c.forces = nullptr;
  refused(c, "forces of the calls is NULL");
  c = calls();
  c.load = nullptr;
  refused(c, "some are NULL");
  springs.refuse = 1;
  refused(calls(), "finds no forces (7): the springs are tired, at displacements of zero");
  springs.refuse = 0;
  row[1] = 0;
  refused(calls(), "row[1] of the pattern is 0 in column 0");
  row[1] = 1;
  c = calls();
  EXPECT_EQ(cairn_mesh_set_calls(mesh, start_.data(), row.data(), node_mass, node_mass, &c, &error), cairn_wrong_input);
  EXPECT_EQ(give(calls()), 0) << error.message;
  EXPECT_EQ(give(calls()), cairn_wrong_input);
}

// States of a material, of two simulations of one scene: they had been of both.
TEST_F(CCalls, two_simulations_have_states_of_materials_of_their_own) {
  const double place[] = {0, 0, 1, 0, 1, 1, 0, 1}, values[] = {2e5, 0.3, 100, 1e3};
  const int32_t cell[] = {0, 1, 2, 3}, left[] = {0, 3}, right[] = {1, 2};
  const char* names[] = {"young", "poisson", "yield_stress", "isotropic"};
  make(2);
  ASSERT_EQ(cairn_mesh_create(2, 4, place, &mesh, &error), 0);
  ASSERT_EQ(cairn_mesh_add_solid_cells(mesh, "q4", 1, cell, "j2_plasticity", 4, names, values, 1000, "small", "strain",
                                       0, 1, &error),
            0)
      << error.message;
  ASSERT_EQ(cairn_mesh_hold(mesh, 2, left, 3, &error), 0);
  ASSERT_EQ(cairn_mesh_hold(mesh, 2, right, 1, &error), 0);
  ASSERT_EQ(cairn_scene_add_mesh(scene, mesh, "metal", rock, -1, nullptr, nullptr, &error), 0) << error.message;
  start();
  ASSERT_EQ(cairn_simulation_create(scene, nullptr, &second, &error), 0) << error.message;
  double held[8] = {0};
  for (const int32_t n : right) held[2 * n] = 0.5;
  for (cairn_simulation* of : {simulation, second}) {
    ASSERT_EQ(cairn_simulation_load_mesh(of, 0, nullptr, nullptr, held, &error), 0) << error.message;
    for (int i = 0; i < 20; ++i) ASSERT_EQ(cairn_simulation_step(of, 1e-4, nullptr, &error), 0) << error.message;
  }
  double spent[2];
  for (int k = 0; k < 2; ++k)
    ASSERT_EQ(cairn_simulation_energy(k == 0 ? simulation : second, "dissipated_material", &spent[k], &error), 0);
  EXPECT_GT(spent[0], 0);
  EXPECT_EQ(spent[0], spent[1]);
}

} // namespace
