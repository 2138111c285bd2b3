// Bodies that a criterion makes deformable, and rigid again, and meshes that become bodies of another shape, through
// the C API.
#include <algorithm>
#include <cmath>

#include "c_transforms.hpp"

namespace {

struct CWatches : CTransforms {
  int32_t mesh_of(int64_t id) {
    int32_t number = -2;
    EXPECT_EQ(cairn_simulation_mesh_of_body(simulation, id, &number, &error), 0) << error.message;
    return number;
  }
  void reshape_when(int64_t id, double force, double stress, double back) {
    ASSERT_EQ(cairn_simulation_reshape_when(simulation, 1, &id, mesh, force, stress, back, -1, -1, &error), 0)
        << error.message;
  }
  void forget() {
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    simulation = nullptr;
    scene = nullptr;
  }
  // The largest force of a contact of the body, or of the mesh that it is, as a program would find it itself [N].
  double largest(const std::vector<double>& ids, double h) {
    const auto impulse = contact("impulse"), bodies = contact("bodies");
    double most = 0;
    for (std::size_t i = 0; i < impulse.size() / 2; ++i)
      for (const double id : ids)
        if (std::abs(bodies[2 * i] - id) < 0.5 || std::abs(bodies[2 * i + 1] - id) < 0.5)
          most = std::max(most, std::hypot(impulse[2 * i], impulse[2 * i + 1]) / h);
    return most;
  }
  // Two squares above the ground, that fall on it; the first is watched, or looked at here after each step.
  std::vector<double> fall(bool watched) {
    forget();
    make(2, 0.3);
    floor(2);
    const int64_t one = block({1, 1}, {0, 0.52}), other = block({1, 1}, {3, 0.52});
    for (const int64_t id : {one, other}) {
      const double down[] = {0, -2, 0};
      EXPECT_EQ(cairn_scene_set_body_field(scene, "velocity", 1, &id, down, &error), 0) << error.message;
    }
    grid(4, {1, 1}, {-0.5, 0.02}, true);
    start();
    EXPECT_EQ(cairn_simulation_set_number(simulation, "tol", 1e-10, &error), 0);
    EXPECT_EQ(cairn_simulation_set_number(simulation, "max_iter", 20000, &error), 0);
    const double force = 1e5, back = 1e2, h = 5e-4;
    if (watched) reshape_when(one, force, infinite, back);
    std::vector<double> kinds;
    for (int k = 0; k < 120; ++k) {
      steps(1, h);
      if (!watched) {
        if (cairn_simulation_nodes(simulation) == 0) {
          if (largest({double(one)}, h) > force) { EXPECT_EQ(deform(one), 0); }
        } else {
          int64_t count = 0;
          std::vector<double> ids(std::size_t(cairn_simulation_nodes(simulation)));
          EXPECT_EQ(cairn_simulation_node_field(simulation, "id", int64_t(ids.size()), ids.data(), &count, &error), 0);
          if (largest(ids, h) < back) { EXPECT_EQ(rigidify(0), one); }
        }
      }
      EXPECT_EQ(mesh_of(other), -1);
      kinds.push_back(mesh_of(one));
    }
    EXPECT_EQ(kinds.front(), -1);
    EXPECT_EQ(kinds.back(), -1);
    EXPECT_EQ(*std::max_element(kinds.begin(), kinds.end()), 0);
    EXPECT_GT(energy("dissipated_reshaping"), 0);
    EXPECT_LT(std::abs(energy("closure")), 1e-12 * energy("in_play"));
    EXPECT_EQ(field("id"), (std::vector<double>{0, double(one), double(other)}));
    for (const char* name : {"position", "velocity"})
      for (const double x : field(name)) kinds.push_back(x);
    return kinds;
  }
};

TEST_F(CWatches, a_threshold_of_force_does_what_a_program_does_after_each_step) { EXPECT_EQ(fall(true), fall(false)); }

// Two squares are pressed on each other by 10 kN: the lower one has a mean stress of 10 kPa over its thickness of 1, of
// 5 kPa over one of 2.
TEST_F(CWatches, a_threshold_of_stress_is_that_of_the_mean_stress) {
  for (const double thickness : {1.0, 2.0})
    for (const double share : {0.99, 1.01}) {
      SCOPED_TRACE(testing::Message() << thickness << " " << share);
      forget();
      make(2, 0.3);
      const double none[] = {0, 0}, push[] = {0, -1e4, 0};
      ASSERT_EQ(cairn_scene_set_gravity(scene, none, &error), 0);
      floor(2);
      const int64_t id = block({1, 1}, {0, 0.5}), above = block({1, 1}, {0, 1.5});
      ASSERT_EQ(cairn_scene_set_body_field(scene, "force", 1, &above, push, &error), 0) << error.message;
      grid(2, {1, 1}, {0, 0}, false);
      cairn_mesh_destroy(mesh);
      mesh = nullptr;
      ASSERT_EQ(cairn_mesh_create(2, 9, node.data(), &mesh, &error), 0);
      ASSERT_EQ(cairn_mesh_add_elastic_cells(mesh, "q4", 4, cell.data(), 1e7, 0.3, 1, 0, thickness, &error), 0);
      start();
      ASSERT_EQ(cairn_simulation_set_number(simulation, "tol", 1e-12, &error), 0);
      ASSERT_EQ(cairn_simulation_set_number(simulation, "max_iter", 20000, &error), 0);
      reshape_when(id, infinite, share * 1e4 / thickness, 0);
      steps(5);
      EXPECT_EQ(mesh_of(id), share < 1 ? 0 : -1);
      EXPECT_EQ(mesh_of(above), -1);
    }
}

// A box pressed on a floor in space: the principal stress is along the load, for any axes.
TEST_F(CWatches, the_stress_in_space_is_a_principal_value) {
  for (const double share : {0.99, 1.01}) {
    forget();
    weightless(3);
    const double c = std::cos(0.3), s = std::sin(0.3); // the floor leans
    const int64_t ground = body({0, 0, 0}, infinite, infinite);
    const double up[] = {0, -s, c, 0};
    ASSERT_EQ(cairn_scene_add_contactors(scene, "plane", 1, &ground, &rock, nullptr, nullptr, up, nullptr, &error), 0);
    const double mass = 1000, inertia[] = {1000.0 / 6, 1000.0 / 6, 1000.0 / 6}, place[] = {0, -0.5 * s, 0.5 * c},
                 rotation[] = {std::cos(0.15), std::sin(0.15), 0, 0}, push[] = {0, 3e4 * s, -3e4 * c, 0, 0, 0};
    const int64_t first = block({1, 1, 1}, {0, 0, 10}); // for its hull
    int64_t id = -1;
    ASSERT_EQ(cairn_scene_add_bodies(scene, 1, place, rotation, nullptr, &mass, inertia, &id, &error), 0);
    hull("polyhedron", id, 0);
    ASSERT_EQ(cairn_scene_set_body_field(scene, "force", 1, &id, push, &error), 0) << error.message;
    grid(1, {1, 1, 1}, {0, 0, 0}, false);
    start();
    ASSERT_EQ(cairn_simulation_set_number(simulation, "tol", 1e-12, &error), 0);
    // forces of 30 kN on one face alone, half of the box from its centre: 15 kPa, and no friction
    reshape_when(id, infinite, share * 1.5e4, 0);
    steps(5);
    EXPECT_EQ(mesh_of(id), share < 1 ? 0 : -1);
    EXPECT_EQ(mesh_of(first), -1);
  }
}

TEST_F(CWatches, a_mesh_becomes_a_body_of_another_shape) {
  for (const bool body_before : {true, false}) {
    SCOPED_TRACE(body_before);
    forget();
    weightless(2);
    const int64_t id = block({1, 1}, {2, 1}, 0.7);
    speed({1, -2, 3});
    const double push[] = {5, 7, 9}, damping = 0.25;
    ASSERT_EQ(cairn_scene_set_body_field(scene, "force", 1, &id, push, &error), 0) << error.message;
    ASSERT_EQ(cairn_scene_set_body_field(scene, "damping", 1, &id, &damping, &error), 0) << error.message;
    grid(4, {1, 1}, {-0.5, -0.5}, true);
    if (!body_before) {
      std::vector<double> moving;
      for (std::size_t i = 0; i < node.size() / 2; ++i)
        moving.insert(moving.end(), {1 - 3 * node[2 * i + 1], -2 + 3 * node[2 * i]});
      ASSERT_EQ(cairn_mesh_set_motion(mesh, nullptr, moving.data(), &error), 0);
      ASSERT_EQ(cairn_scene_add_mesh(scene, mesh, "cut out", rock, -1, nullptr, nullptr, &error), 0) << error.message;
    }
    start();
    steps(20);
    if (body_before) {
      ASSERT_EQ(deform(id), 0);
    } else {
      ASSERT_EQ(cairn_simulation_remove_bodies(simulation, 1, &id, &error), 0) << error.message;
    }
    steps(5);
    const double density = body_before ? 1000 : 900;
    const auto before = momentum(2, density);
    const double in_all = energy("kinetic") + energy("stored") + energy("dissipated_reshaping");
    // a disk of 2 kg with a moment that no disk has, and two small ones on it
    const double moment = 0.3, radius[] = {0.4, 0.1, 0.1}, offset[] = {0, 0, 0.4, 0, -0.4, 0}, angle = 0.2, bad = -1;
    const int32_t material[] = {rock, rock, rock}, wrong[] = {rock, 7, rock};
    int64_t made = -1;
    const auto as = [&](double mass, const double* inertia, const char* shape, const int32_t* of) {
      return cairn_simulation_rigidify_as(simulation, 0, &angle, mass, inertia, shape, 3, of, radius, offset, nullptr,
                                          nullptr, &made, &error);
    };
    EXPECT_REFUSED(as(infinite, &moment, "disk", material), "give a finite mass");
    EXPECT_REFUSED(as(2, &bad, "disk", material), "moments of inertia above 0");
    EXPECT_REFUSED(as(2, &moment, "disc", material), "there is no shape 'disc'");
    EXPECT_REFUSED(as(2, &moment, "disk", wrong), "material[1] is 7");
    expect_near(momentum(2, density), before, 1e-15); // all as it was
    ASSERT_EQ(as(2, &moment, "disk", material), 0) << error.message;
    EXPECT_GT(made, id);
    EXPECT_EQ(cairn_simulation_nodes(simulation), 0);
    EXPECT_EQ(field("id"), std::vector<double>{double(made)});
    expect_near(momentum(2), before, 1e-12);
    EXPECT_NEAR(field("mass")[0] / density, 1, 1e-12);
    EXPECT_NEAR(field("inertia")[0] / (0.15 * density), 1, 1e-12);
    EXPECT_EQ(field("rotation")[0], 0.2);
    EXPECT_NEAR((energy("kinetic") + energy("dissipated_reshaping")) / in_all, 1, 1e-12);
    if (body_before) {
      EXPECT_EQ(field("force"), (std::vector<double>{5, 7, 9}));
      EXPECT_EQ(field("damping")[0], 0.25);
    }
    steps(10);
    EXPECT_LT(std::abs(energy("closure")), 1e-12 * energy("in_play"));
    grid(2, {1, 1}, {-0.5, -0.5}, true); // and it may be made deformable again
    const double stood = field("rotation")[0];
    ASSERT_EQ(deform(made), 0);
    const auto x = nodes(0, "position"); // of nine nodes the fifth is in the middle
    EXPECT_NEAR(std::atan2(x[9] - x[1], x[8] - x[0]), stood - 0.2 + std::atan(1), 1e-12); // it was its shape at 0.2
    EXPECT_EQ(rigidify(0), made);
    EXPECT_NEAR(field("rotation")[0] / stood, 1, 1e-12);
  }
}

TEST_F(CWatches, a_box_in_space_becomes_a_ball) {
  weightless(3);
  const int64_t id = block({1, 2, 0.5}, {3, 5, -7}, 0.4);
  speed({1, 2, 3, 0.4, -1.2, 2});
  grid(2, {1, 2, 0.5}, {-0.5, -1, -0.25}, true);
  start();
  steps(30, 1e-2);
  ASSERT_EQ(deform(id), 0);
  const auto before = momentum(3, 1000);
  const double mass = 1, inertia[] = {0.1, 0.2, 0.25}, rotation[] = {2, 0, 2, 0}, radius = 0.5;
  int64_t made = -1;
  ASSERT_EQ(cairn_simulation_rigidify_as(simulation, 0, rotation, mass, inertia, "sphere", 1, &rock, &radius, nullptr,
                                         nullptr, nullptr, &made, &error),
            0)
      << error.message;
  expect_near(momentum(3), before, 1e-12);
  EXPECT_NEAR(field("rotation")[0], std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(field("inertia")[2] / 250, 1, 1e-12);
  steps(5, 1e-2);
  EXPECT_LT(std::abs(energy("closure")), 1e-12 * energy("in_play"));
}

TEST_F(CWatches, what_cannot_be_watched_is_refused) {
  make(2, 0.3);
  floor(2);
  const int64_t id = block({1, 1}, {0, 0.5}), none = 9, ground = 0;
  grid(1, {1, 1}, {-0.5, 0}, false);
  start();
  const auto when = [&](const int64_t* bodies, double force, double stress, double back, int32_t material = -1) {
    return cairn_simulation_reshape_when(simulation, 1, bodies, mesh, force, stress, back, material, -1, &error);
  };
  EXPECT_REFUSED(when(&id, infinite, infinite, 0), "there is no threshold");
  EXPECT_REFUSED(when(&id, -1, infinite, 0), "force is -1");
  EXPECT_REFUSED(when(&id, 1, NAN, 0), "stress is ");
  EXPECT_REFUSED(when(&id, 1, infinite, -2), "back is -2");
  EXPECT_REFUSED(when(&id, 1, infinite, infinite), "back is inf");
  EXPECT_REFUSED(when(&none, 1, infinite, 0), "no rigid body 9");
  EXPECT_REFUSED(when(&ground, 1, infinite, 0), "is held or driven");
  EXPECT_REFUSED(when(&id, 1, infinite, 0, 5), "material is 5");
  int32_t number = 0;
  EXPECT_REFUSED(cairn_simulation_mesh_of_body(simulation, 9, &number, &error), "9");
  EXPECT_REFUSED(cairn_simulation_reshape_when(simulation, 0, &id, mesh, 1, infinite, 0, -1, -1, &error), "no body");
  steps(3);
  EXPECT_EQ(mesh_of(id), -1);
}

// Watches evaluate the completed step: two watches of a body, and that of a body it touches, see the same.
TEST_F(CWatches, watches_do_not_see_what_others_change) {
  make(2, 0.3);
  floor(2);
  const int64_t low = block({1, 1}, {0, 0.5}), high = block({1, 1}, {0, 1.5});
  grid(2, {1, 1}, {-0.5, 0}, false);
  start();
  ASSERT_EQ(cairn_simulation_set_number(simulation, "tol", 1e-10, &error), 0);
  ASSERT_EQ(cairn_simulation_set_number(simulation, "max_iter", 20000, &error), 0);
  reshape_when(low, 1, infinite, 0);
  reshape_when(low, 2, infinite, 0);
  reshape_when(high, 1, infinite, 0);
  steps(1);
  EXPECT_GE(mesh_of(low), 0);
  EXPECT_GE(mesh_of(high), 0);
  EXPECT_EQ(cairn_simulation_bodies(simulation), 1);
  steps(3);
}

} // namespace
