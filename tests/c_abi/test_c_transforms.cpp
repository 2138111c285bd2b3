// Rigid bodies made deformable in a run, and back, through the C API: transferred state, errors, extremes.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "c_transforms.hpp"

namespace {

// A UMAT of springs that knows no large rotations.
void upright_alone(double* stress, double*, double* tangent, double*, double*, double*, double*, double*, double*,
                   double*, const double*, const double* change, const double*, const double*, const double*,
                   const double*, const double*, const double*, const char*, const int*, const int*,
                   const int* components, const int*, const double*, const int*, const double*, const double*, double*,
                   const double*, const double*, const double* gradient, const int*, const int*, const int*, const int*,
                   const int*, const int*, std::size_t) {
  const int n = *components;
  for (int k = 0; k < n; ++k) tangent[(n + 1) * k] = 1e7, stress[k] += 1e7 * change[k];
  if (std::abs(gradient[1]) > 0.1) stress[0] = NAN;
}
void (*const checked)(double*, double*, double*, double*, double*, double*, double*, double*, double*, double*,
                      const double*, const double*, const double*, const double*, const double*, const double*,
                      const double*, const double*, const char*, const int*, const int*, const int*, const int*,
                      const double*, const int*, const double*, const double*, double*, const double*, const double*,
                      const double*, const int*, const int*, const int*, const int*, const int*, const int*,
                      std::size_t) = upright_alone;

TEST_F(CTransforms, momentum_passes_over_and_back) {
  for (const double size : {1.0, 1e-9, 1e3})
    for (const bool rubber : {false, true}) {
      SCOPED_TRACE(testing::Message() << size << (rubber ? " rubber" : " linear"));
      cairn_simulation_destroy(simulation);
      cairn_scene_destroy(scene);
      simulation = nullptr;
      scene = nullptr;
      weightless(2);
      const int64_t id = block({size, size}, {2 * size, size}, 0.7);
      speed({size, -2 * size, 3});
      grid(4, {size, size}, {-0.5 * size, -0.5 * size}, rubber, 1e7 * size * size);
      start();
      steps(20);
      const auto before = momentum(2);
      const double kinetic = energy("kinetic");
      ASSERT_EQ(deform(id), 0);
      EXPECT_EQ(cairn_simulation_bodies(simulation), 0);
      expect_near(momentum(2, 1000), before, 1e-12);
      EXPECT_NEAR(energy("dissipated_reshaping") / kinetic, 1 - energy("kinetic") / kinetic, 1e-12);
      // the square has turned by 0.06 since it came in, and its mesh with it
      const auto x = nodes(0, "position");
      const double c = std::cos(0.06), s = std::sin(0.06);
      expect_near({x[0] - 2.02 * size, x[1] - 0.96 * size}, {0.5 * size * (s - c), -0.5 * size * (s + c)}, 1e-11);
      steps(10);
      const auto later = momentum(2, 1000);
      for (const std::size_t k : {0, 1}) EXPECT_NEAR(later[k] / before[k], 1, 1e-11);
      EXPECT_EQ(rigidify(0), id);
      EXPECT_EQ(cairn_simulation_nodes(simulation), 0);
      EXPECT_EQ(field("id"), std::vector<double>{double(id)});
      expect_near(momentum(2), later, 1e-12);
      EXPECT_NEAR(field("mass")[0] / (1000 * size * size), 1, 1e-13);
      EXPECT_NEAR(field("inertia")[0] / (1000 * std::pow(size, 4) / 6), 1, 1e-12);
      steps(1);
      EXPECT_LT(std::abs(energy("closure")), 1e-12 * energy("in_play"));
      EXPECT_NEAR((energy("kinetic") + energy("dissipated_reshaping") + energy("dissipated_integrator")) / kinetic, 1,
                  1e-12);
    }
}

TEST_F(CTransforms, at_once_there_and_back_nothing_is_lost_in_space) {
  weightless(3);
  const int64_t id = block({1, 2, 0.5}, {3, 5, -7}, 0.4);
  speed({1, 2, 3, 0.4, -1.2, 2});
  start();
  steps(30, 1e-2);
  const auto x = field("position"), v = field("velocity"), r = field("rotation"), p = momentum(3);
  grid(2, {1, 2, 0.5}, {-0.5, -1, -0.25}, true);
  for (int turn = 0; turn < 2; ++turn) { // and a second time
    ASSERT_EQ(deform(id), 0);
    expect_near(momentum(3, 1000), p, 1e-12);
    EXPECT_EQ(rigidify(0), id);
  }
  expect_near(field("position"), x, 1e-13);
  expect_near(field("velocity"), v, 1e-12);
  const auto now = field("rotation");
  const double same = now[0] * r[0] + now[1] * r[1] + now[2] * r[2] + now[3] * r[3];
  EXPECT_NEAR(std::abs(same), 1, 1e-13);
  EXPECT_LT(std::abs(energy("dissipated_reshaping")), 1e-12 * energy("kinetic"));
  steps(5, 1e-2);
}

// A block on the ground, and a disk on it: the solution goes on from what its contacts remember.
TEST_F(CTransforms, impulses_and_forces_pass_over) {
  make(2, 0.3);
  floor(2);
  const int64_t id = block({1, 1}, {0, 0.5});
  ball(2, body({0.1, 1.2}, 125, 2.5), 0.2, rock);
  start();
  for (const char* precise : {"tol", "newton_tol"})
    ASSERT_EQ(cairn_simulation_set_number(simulation, precise, 1e-12, &error), 0) << error.message;
  const double push[] = {50, 0, 0};
  ASSERT_EQ(cairn_simulation_set_body_field(simulation, "force", 1, &id, push, &error), 0) << error.message;
  steps(50);
  const auto up = [&] { // on the block from below, over the step [N]
    double sum = 0;
    const auto impulse = contact("impulse"), bodies = contact("bodies");
    for (std::size_t i = 0; i < bodies.size() / 2; ++i)
      if (bodies[2 * i] == 0 || bodies[2 * i + 1] == 0) sum += std::abs(impulse[2 * i + 1]) / 1e-3;
    return sum;
  };
  EXPECT_NEAR(up() / (1125 * 9.81), 1, 1e-6);
  grid(4, {1, 1}, {-0.5, 0}, true);
  ASSERT_EQ(cairn_mesh_set_damping(mesh, 0, 5e-3, 0, &error), 0) << error.message;
  ASSERT_EQ(deform(id), 0);
  cairn_report report{};
  ASSERT_EQ(cairn_simulation_step(simulation, 1e-3, &report, &error), 0) << error.message;
  EXPECT_EQ(report.status, cairn_converged);
  EXPECT_GT(up(), 0);
  steps(400);
  EXPECT_NEAR(up() / (1125 * 9.81), 1, 1e-2);
  const auto x = nodes(0, "position");
  EXPECT_LT(x.back(), 1); // it has settled
  EXPECT_EQ(rigidify(0), id);
  EXPECT_EQ(field("force")[3], 50); // bodies by their numbers: ground, block, disk
  EXPECT_EQ(field("id"), (std::vector<double>{0, 1, 2}));
  steps(20);
  EXPECT_NEAR(up() / (1125 * 9.81), 1, 1e-2);
  EXPECT_EQ(text("status"), "converged");
  EXPECT_LT(std::abs(energy("closure")), 1e-11 * energy("in_play"));
}

// Impulses of contacts are transferred unchanged: for a nearly rigid block they are the solution, so that a solver with
// half of the error as tolerance leaves them. A cold start would only come near them.
TEST_F(CTransforms, a_step_begins_with_the_impulses_that_there_were) {
  for (const double size : {1.0, 1e-6, 1e6}) {
    SCOPED_TRACE(size);
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    simulation = nullptr;
    scene = nullptr;
    make(2, 0.5);
    const double gravity[] = {0, -9.81 * size, 0}, push[] = {1e3 * size * size * size, 0, 0}; // a tenth of its weight
    ASSERT_EQ(cairn_scene_set_gravity(scene, gravity, &error), 0);
    floor(2);
    const int64_t id = block({size, size}, {0, 0.5 * size});
    const double weight = 125 * size * size;
    ball(2, body({0.1 * size, 1.2 * size}, weight, 0.02 * weight * size * size), 0.2 * size, rock);
    start();
    const auto set = [&](const char* name, double value) {
      ASSERT_EQ(cairn_simulation_set_number(simulation, name, value, &error), 0) << name << error.message;
    };
    set("tol", 1e-13);
    set("max_iter", 10000);
    ASSERT_EQ(cairn_simulation_set_body_field(simulation, "force", 1, &id, push, &error), 0) << error.message;
    steps(50);
    // of the impulses on the body, or the mesh, that stands where the block does: along both axes, and their moment
    const auto on_it = [&](bool whole) {
      const auto impulse = contact("impulse"), bodies = contact("bodies"), point = contact("point");
      std::vector<double> sum(3, 0.0);
      for (std::size_t i = 0; i < impulse.size() / 2; ++i) {
        // the ground is 0 and the disk is 2; all else is the block
        const bool first = bodies[2 * i] != 0 && bodies[2 * i] != 2;
        const double side = first ? 1 : -1, *p = &impulse[2 * i], *x = &point[2 * i];
        sum[0] += side * p[0];
        sum[1] += side * p[1];
        sum[2] += side * (x[0] * p[1] - x[1] * p[0]) / size;
      }
      EXPECT_EQ(impulse.size() > 6, whole); // a mesh has more points
      return sum;
    };
    const auto before = on_it(false);
    EXPECT_NEAR(before[1] / (9.81 * 1000 * size * size * size * 1e-3), 1, 1e-9);
    EXPECT_LT(before[0], -0.05 * before[1]);
    ASSERT_EQ(cairn_simulation_set_option(simulation, "solver", "ppa_newton", &error), 0) << error.message;
    set("tol", 0.5);
    for (const bool rubber : {false, true}) {
      grid(4, {size, size}, {-0.5 * size, 0}, rubber, 1e16 * size * size);
      ASSERT_EQ(deform(id), 0);
      steps(1);
      expect_near(on_it(true), before, 1e-12);
      EXPECT_EQ(rigidify(0), id);
      steps(1);
      expect_near(on_it(false), before, 1e-12);
    }
  }
}

TEST_F(CTransforms, a_force_and_its_torque_act_on_the_nodes) {
  weightless(2);
  const int64_t id = block({1, 1}, {3, -2});
  start();
  const double push[] = {300, 200, 50};
  ASSERT_EQ(cairn_simulation_set_body_field(simulation, "force", 1, &id, push, &error), 0) << error.message;
  grid(3, {1, 1}, {-0.5, -0.5}, true);
  steps(1);
  const auto begin = momentum(2);
  ASSERT_EQ(deform(id), 0);
  steps(50);
  const auto pushed = momentum(2, 1000);
  EXPECT_NEAR((pushed[0] - begin[0]) / (300 * 0.05), 1, 1e-9);
  EXPECT_NEAR((pushed[1] - begin[1]) / (200 * 0.05), 1, 1e-9);
  EXPECT_NEAR((pushed[2] - begin[2]) / ((50 + 3 * 200 + 2 * 300) * 0.05), 1, 1e-4); // its place moves by micrometres
  const std::vector<double> none(node.size(), 0.0);
  ASSERT_EQ(cairn_simulation_load_mesh(simulation, 0, none.data(), nullptr, nullptr, &error), 0) << error.message;
  steps(50);
  for (const std::size_t k : {0, 1}) EXPECT_NEAR(momentum(2, 1000)[k] / pushed[k], 1, 1e-10);
}

TEST_F(CTransforms, what_cannot_be_is_refused_and_leaves_all_as_it_was) {
  make(2);
  floor(2);
  const int64_t id = block({1, 1}, {0, 0.5});
  grid(2, {1, 1}, {-0.5, 0}, false);
  int32_t held = -1;
  const int32_t corner = 0;
  cairn_mesh* second = nullptr;
  const double place[] = {5, 5, 6, 5, 6, 6, 5, 6};
  const int32_t one[] = {0, 1, 2, 3};
  ASSERT_EQ(cairn_mesh_create(2, 4, place, &second, &error), 0);
  ASSERT_EQ(cairn_mesh_add_elastic_cells(second, "q4", 1, one, 1e7, 0.3, 1000, 0, 1, &error), 0);
  ASSERT_EQ(cairn_mesh_hold(second, 1, &corner, 3, &error), 0);
  ASSERT_EQ(cairn_scene_add_mesh(scene, second, "held", rock, -1, nullptr, &held, &error), 0) << error.message;
  start();
  steps(3);
  const auto refused = [&](int32_t code, const char* why) {
    EXPECT_EQ(code, cairn_wrong_input) << why;
    EXPECT_NE(std::string(error.message).find(why), std::string::npos) << error.message;
    EXPECT_EQ(cairn_simulation_bodies(simulation), 2);
    EXPECT_EQ(cairn_simulation_nodes(simulation), 4);
  };
  const auto into = [&](int64_t body, const cairn_mesh* of, int32_t material) {
    return cairn_simulation_deform(simulation, body, of, nullptr, material, -1, nullptr, &error);
  };
  refused(into(77, mesh, -1), "there is no rigid body 77");
  refused(into(0, mesh, -1), "body 0 is held or driven");
  refused(into(id, mesh, 9), "there are");
  refused(into(id, mesh, -2), "material is -2");
  refused(into(id, nullptr, -1), "mesh is NULL");
  refused(cairn_simulation_rigidify(simulation, held, nullptr, &error), "has held dofs");
  refused(cairn_simulation_rigidify(simulation, 5, nullptr, &error), "there is no mesh 5");
  cairn_mesh* empty = nullptr;
  ASSERT_EQ(cairn_mesh_create(2, 4, place, &empty, &error), 0);
  refused(into(id, empty, -1), "no cells");
  const int32_t flat[] = {0, 3, 2, 1};
  ASSERT_EQ(cairn_mesh_add_elastic_cells(empty, "q4", 1, flat, 1e7, 0.3, 1000, 0, 1, &error), 0);
  refused(into(id, empty, -1), "inside out");
  ASSERT_EQ(cairn_simulation_set_number(simulation, "project_positions", 1, &error), 0) << error.message;
  grid(2, {1, 1}, {-0.5, 0}, true);
  refused(into(id, mesh, -1), "project_positions");
  cairn_mesh_destroy(empty);
  cairn_mesh_destroy(second);
  ASSERT_EQ(cairn_simulation_set_number(simulation, "project_positions", 0, &error), 0) << error.message;
  steps(3);
  ASSERT_EQ(cairn_simulation_remove_bodies(simulation, 1, &id, &error), 0) << error.message;
  EXPECT_EQ(into(id, mesh, -1), cairn_wrong_input); // and of a body that is gone
}

// A checkpoint goes into a simulation whose mesh lies where that of the checkpoint does, and into no other.
TEST_F(CTransforms, a_restart_goes_on_to_the_same_bits_where_the_body_was_made_deformable) {
  const std::string rigid = testing::TempDir() + "rigid.checkpoint.h5",
                    soft = testing::TempDir() + "soft.checkpoint.h5";
  weightless(2);
  const int64_t id = block({1, 1}, {0, 0}, 0.3);
  speed({1, 0.5, 2});
  grid(2, {1, 1}, {-0.5, -0.5}, false, 1e4);
  start();
  steps(20, 1e-2);
  ASSERT_EQ(cairn_simulation_write_checkpoint(simulation, rigid.c_str(), &error), 0) << error.message;
  ASSERT_EQ(deform(id), 0);
  steps(10, 1e-2);
  ASSERT_EQ(cairn_simulation_write_checkpoint(simulation, soft.c_str(), &error), 0) << error.message;
  steps(10, 1e-2);
  const auto there = nodes(0, "position"), moved = nodes(0, "displacement");
  EXPECT_EQ(rigidify(0), id);
  const auto turned = field("rotation");
  const auto anew = [&] {
    cairn_simulation_destroy(simulation);
    simulation = nullptr;
    start();
  };
  const auto restart = [&](const std::string& from) {
    return cairn_simulation_restart(simulation, from.c_str(), &error);
  };
  anew();
  ASSERT_EQ(restart(rigid), 0) << error.message;
  ASSERT_EQ(deform(id), 0);
  ASSERT_EQ(restart(soft), 0) << error.message;
  steps(10, 1e-2);
  EXPECT_EQ(nodes(0, "position"), there);
  EXPECT_EQ(nodes(0, "displacement"), moved);
  EXPECT_EQ(rigidify(0), id);
  EXPECT_EQ(field("rotation"), turned);
  anew();
  ASSERT_EQ(deform(id), 0); // before it has moved and turned
  const auto before = nodes(0, "position");
  EXPECT_EQ(restart(soft), cairn_file_error);
  EXPECT_NE(std::string(error.message).find("make them deformable where they"), std::string::npos) << error.message;
  EXPECT_EQ(nodes(0, "position"), before);
  anew();
  EXPECT_EQ(restart(soft), cairn_file_error) << "of a body that is rigid";
  EXPECT_NE(std::string(error.message).find("meshes"), std::string::npos) << error.message;
  EXPECT_EQ(cairn_simulation_bodies(simulation), 1);
  ASSERT_EQ(deform(id), 0);
  EXPECT_EQ(restart(rigid), cairn_file_error) << "of a body that is deformable";
  EXPECT_NE(std::string(error.message).find("meshes"), std::string::npos) << error.message;
  EXPECT_EQ(cairn_simulation_nodes(simulation), int64_t(node.size()) / 2);
  steps(2);
  std::remove(rigid.c_str());
  std::remove(soft.c_str());
}

TEST_F(CTransforms, a_material_that_has_no_stress_where_the_body_stands_is_refused) {
  weightless(2);
  const int64_t id = block({1, 1}, {3, 2});
  speed({0, 0, 5});
  start();
  steps(20, 1e-2); // it turns by one
  const double place[] = {-0.5, -0.5, 0.5, -0.5, 0.5, 0.5, -0.5, 0.5};
  const int32_t square[] = {0, 1, 2, 3};
  ASSERT_EQ(cairn_give_material("upright", reinterpret_cast<cairn_umat*>(checked), 0, &error), 0) << error.message;
  ASSERT_EQ(cairn_mesh_create(2, 4, place, &mesh, &error), 0);
  ASSERT_EQ(cairn_mesh_add_solid_cells(mesh, "q4", 1, square, "upright", 0, nullptr, nullptr, 900, "logarithmic",
                                       "strain", 0, 1, &error),
            0)
      << error.message;
  const auto before = field("position");
  EXPECT_REFUSED(cairn_simulation_deform(simulation, id, mesh, nullptr, -1, -1, nullptr, &error),
                 "upright finds no finite stress");
  EXPECT_EQ(field("position"), before);
  EXPECT_EQ(cairn_simulation_nodes(simulation), 0);
  steps(2);
}

// Initial orientation of a body added within the run; its number may be that of a body before a restart.
TEST_F(CTransforms, bodies_that_come_in_within_a_run_keep_how_they_stood) {
  const std::string early = testing::TempDir() + "early.checkpoint.h5",
                    late = testing::TempDir() + "late.checkpoint.h5";
  weightless(2);
  block({1, 1}, {0, 0});
  grid(1, {1, 1}, {-0.5, -0.5}, false);
  start();
  steps(1);
  ASSERT_EQ(cairn_simulation_write_checkpoint(simulation, early.c_str(), &error), 0) << error.message;
  const auto insert = [&](double angle) {
    const double place[] = {5, 0}, mass = 1000, inertia = 1000.0 / 6;
    const int32_t number = 0;
    int64_t id = -1;
    EXPECT_EQ(cairn_simulation_add_bodies(simulation, 1, place, &angle, nullptr, &mass, &inertia, &id, &error), 0);
    EXPECT_EQ(cairn_simulation_add_contactors(simulation, "polygon", 1, &id, &rock, nullptr, nullptr, nullptr, &number,
                                              nullptr, &error),
              0)
        << error.message;
    return id;
  };
  const auto stands = [&](int64_t id) { // the first corner, from the middle
    const auto x = nodes(deform(id), "position");
    EXPECT_EQ(rigidify(0), id);
    return std::vector<double>{x[0] - 5, x[1]};
  };
  const int64_t turned = insert(0.4);
  steps(1);
  ASSERT_EQ(cairn_simulation_write_checkpoint(simulation, late.c_str(), &error), 0) << error.message;
  expect_near(stands(turned), {-0.5, -0.5}, 1e-12); // its mesh is of its shape as it came in
  ASSERT_EQ(cairn_simulation_restart(simulation, early.c_str(), &error), 0) << error.message;
  EXPECT_EQ(insert(0), turned); // another, under the same number
  steps(1);
  expect_near(stands(turned), {-0.5, -0.5}, 1e-12);
  cairn_simulation_destroy(simulation);
  simulation = nullptr;
  start();
  ASSERT_EQ(cairn_simulation_restart(simulation, late.c_str(), &error), 0) << error.message;
  EXPECT_REFUSED(cairn_simulation_deform(simulation, turned, mesh, nullptr, -1, -1, nullptr, &error),
                 "how body 1 stood as it came in is not known after a restart");
  steps(1);
  const int64_t third = insert(0.4);
  expect_near(stands(third), {-0.5, -0.5}, 1e-12);
  std::remove(early.c_str());
  std::remove(late.c_str());
}

// A joint goes with the body that it is on: one that is joined stays rigid.
TEST_F(CTransforms, a_body_that_is_joined_is_refused) {
  weightless(2);
  const int64_t id = block({1, 1}, {0, 0}), other = block({1, 1}, {2, 0});
  const double point[] = {1, 0};
  ASSERT_EQ(cairn_scene_add_joint(scene, "Pivot", id, other, point, nullptr, 0, nullptr, nullptr, nullptr, &error), 0)
      << error.message;
  grid(1, {1, 1}, {-0.5, -0.5}, false);
  start();
  steps(2);
  EXPECT_REFUSED(cairn_simulation_deform(simulation, id, mesh, nullptr, -1, -1, nullptr, &error),
                 "is an end of a joint");
  EXPECT_EQ(cairn_simulation_bodies(simulation), 2);
  steps(2);
}

// Numbers of other meshes follow: the first of two that were bodies goes back, and then the second.
TEST_F(CTransforms, two_of_them_go_back_in_any_order) {
  weightless(2);
  const int64_t left = block({1, 1}, {0, 0}), right = block({1, 1}, {5, 0});
  start();
  grid(1, {1, 1}, {-0.5, -0.5}, false);
  ASSERT_EQ(deform(left), 0);
  ASSERT_EQ(deform(right), 1);
  steps(3);
  EXPECT_EQ(rigidify(0), left);
  EXPECT_EQ(rigidify(0), right);
  EXPECT_EQ(field("id"), (std::vector<double>{double(left), double(right)}));
  EXPECT_EQ(cairn_simulation_rigidify(simulation, 0, nullptr, &error), cairn_wrong_input);
  ASSERT_EQ(deform(right), 0);
  steps(3);
}

} // namespace
