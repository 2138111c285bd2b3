// Joints through the C API: what each kind holds, limits, motors, springs, strength, and what is refused.
#include <cmath>
#include <map>

#include "c_scene.hpp"

struct CJoints : CScene {
  using Numbers = std::vector<std::pair<const char*, double>>;
  int64_t ends[2] = {-1, -1};
  int32_t join(const char* kind, int64_t a, int64_t b, std::vector<double> point, std::vector<double> axis = {},
               const Numbers& numbers = {}) {
    std::vector<const char*> names;
    std::vector<double> values;
    for (const auto& [name, value] : numbers) {
      names.push_back(name);
      values.push_back(value);
    }
    return cairn_scene_add_joint(scene, kind, a, b, point.data(), axis.empty() ? nullptr : axis.data(),
                                 int32_t(names.size()), names.data(), values.data(), ends, &error);
  }
  // Bodies of mass 1 that nothing draws, one at the middle, the other 0.25 along x.
  void two(int dim) {
    make(dim);
    const double none[] = {0, 0, 0};
    ASSERT_EQ(cairn_scene_set_gravity(scene, none, &error), 0);
    ASSERT_EQ(cairn_scene_set_rule(scene, "*", "*", nullptr, 0, nullptr, &error), 0);
    for (int k = 0; k < 2; ++k) {
      std::vector<double> place(dim, 0.0);
      place[0] = 0.25 * k;
      ball(dim, body(place, 1, 0.01), 0.1, rock);
    }
  }
  void spin(std::vector<double> velocities) {
    ASSERT_EQ(cairn_scene_set_body_field(scene, "velocity", 2, nullptr, velocities.data(), &error), 0);
  }
  void begin() {
    cairn_nscd options;
    cairn_nscd_defaults(&options);
    options.tolerance = 1e-11;
    options.max_iterations = 50000;
    ASSERT_EQ(cairn_simulation_create(scene, &options, &simulation, &error), 0) << error.message;
  }
  // How far 2D bodies are from what a fixed joint at (0.1, 0) has: along x and y in the axes of the second, and turned.
  std::vector<double> apart() {
    const std::vector<double> x = field("position"), r = field("rotation");
    const double c[] = {std::cos(r[0]), std::cos(r[1])}, s[] = {std::sin(r[0]), std::sin(r[1])};
    const double dx = x[0] + 0.1 * c[0] - (x[2] - 0.15 * c[1]), dy = x[1] + 0.1 * s[0] - (x[3] - 0.15 * s[1]);
    return {c[1] * dx + s[1] * dy, c[1] * dy - s[1] * dx, r[0] - r[1]};
  }
};

TEST_F(CJoints, HoldWhatTheySay) {
  const std::map<std::string, std::vector<bool>> held = {
      {"Pivot", {true, true, false}}, {"Fixed", {true, true, true}}, {"Slider", {false, true, true}}};
  for (const auto& [kind, blocked] : held) {
    two(2);
    spin({0.3, -0.2, 2.0, -0.3, 0.4, -3.0});
    ASSERT_EQ(
        join(kind.c_str(), 0, 1, {0.1, 0}, kind == "Slider" ? std::vector<double>{2.0, 0.0} : std::vector<double>{}), 0)
        << error.message;
    begin();
    steps(500, 5e-4);
    const std::vector<double> now = apart();
    for (int k = 0; k < 3; ++k)
      EXPECT_TRUE(blocked[k] ? std::abs(now[k]) < 2e-6 : std::abs(now[k]) > 1e-2) << kind << now[k];
    EXPECT_LT(std::abs(energy("closure")), 1e-10 * energy("in_play"));
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    simulation = nullptr;
    scene = nullptr;
  }
}

TEST_F(CJoints, HingesTurnAboutTheirAxisAlone) {
  two(3);
  spin({0, 0, 0, 2, -1, 1.5, 0, 0, 0, 1, 2, -3});
  ASSERT_EQ(join("Hinge", 0, 1, {0.1, 0, 0}, {0, 3, 0}), 0) << error.message;
  begin();
  steps(300, 5e-4);
  const std::vector<double> q = field("rotation");
  const auto second_axis = [&](int k) { // of the body, in space
    const double *p = &q[4 * k], w = p[0], x = p[1], y = p[2], z = p[3];
    return std::vector<double>{2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)};
  };
  const std::vector<double> one = second_axis(0), other = second_axis(1);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(one[k], other[k], 1e-5);
  double same = 0;
  for (int k = 0; k < 4; ++k) same += q[k] * q[4 + k];
  EXPECT_LT(std::abs(same), 0.999); // and turned against each other
}

TEST_F(CJoints, MotorsDriveAndLimitsStop) {
  two(2);
  ASSERT_EQ(join("Pivot", 0, -1, {0, 0}, {}, {{"speed", 2.0}, {"effort", 5.0}, {"highest", 0.05}}), 0) << error.message;
  begin();
  EXPECT_EQ(cairn_simulation_bodies(simulation), 3); // the world is the third
  steps(10);
  EXPECT_NEAR(field("velocity")[2], 2.0, 1e-9);
  steps(90);
  EXPECT_NEAR(field("rotation")[0], 0.05, 1e-9);
  EXPECT_NEAR(field("velocity")[2], 0.0, 1e-9);
}

TEST_F(CJoints, SpringsSwing) {
  two(2);
  const double k = 40, m = 1, stretch = 0.01, t = 0.2;
  ASSERT_EQ(join("Slider", 0, -1, {0, 0}, {1, 0}, {{"stiffness", k}, {"rest", stretch}}), 0) << error.message;
  begin();
  steps(200);
  EXPECT_NEAR(field("position")[0], stretch * (1 - std::cos(std::sqrt(k / m) * t)), 1e-4 * stretch);
}

// Atwood's machine, and one whose pulley is on a body that a rope to the world carries.
TEST_F(CJoints, RopesRunOverPulleys) {
  for (const bool carried : {false, true}) {
    two(2);
    const double down[] = {0, -9.81, 0}, pull[] = {0, 40, 0};
    const int64_t first = 0;
    ASSERT_EQ(cairn_scene_set_gravity(scene, down, &error), 0);
    std::vector<double> points = {0, 0, 0.1, 1, 0.25, 0};
    if (carried) points = {0, 0, 0.25, 0, 0.5, 1};
    ASSERT_EQ(carried ? join("Cable", 0, -1, points, {}, {{"pulley", 1.0}}) : join("Cable", 0, 1, points), 0)
        << error.message;
    begin();
    ASSERT_EQ(cairn_simulation_set_body_field(simulation, "force", 1, &first, pull, &error), 0);
    const auto rope = [&] {
      const std::vector<double> x = field("position");
      const auto part = [](double dx, double dy) { return std::sqrt(dx * dx + dy * dy); };
      return carried ? part(x[0] - x[2], x[1] - x[3]) + part(x[2] - 0.5, x[3] - 1)
                     : part(x[0] - 0.1, x[1] - 1) + part(x[2] - 0.1, x[3] - 1);
    };
    const double whole = rope(), height = field("position")[3];
    steps(200, 1e-4);
    EXPECT_LE(rope(), whole * (1 + 1e-7));
    EXPECT_GT(std::abs(field("position")[3] - height), 1e-4);
    EXPECT_LT(std::abs(energy("closure")), 1e-12 * energy("in_play"));
    EXPECT_EQ(cairn_simulation_contacts(simulation), 1);
    const std::vector<double> key = contact("key");
    for (const int64_t end : ends) EXPECT_TRUE(key[0] == double(end) || key[1] == double(end));
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    simulation = nullptr;
    scene = nullptr;
  }
  two(2);
  EXPECT_REFUSED(join("Cable", 0, 1, {0, 0, 0, 0, 1, 0}), "points of Cable are the same beside each other");
  EXPECT_REFUSED(join("Cable", 0, 1, {0, 0, 0.1, 1, 0.25, 0}, {}, {{"length", 1.0}}),
                 "length of Cable is 1; give at least");
  EXPECT_REFUSED(join("Cable", 0, 1, {0, 0, 0.1, 1, 0.25, 0}, {}, {{"pulley", 1.0}}), "pulley of Cable is body 1");
  EXPECT_REFUSED(join("Cable", 0, 1, {0, 0, 0.1, 1, 0.25, 0}, {}, {{"pulley", 1.5}}), "pulley of Cable is 1.5");
}

// A block of cells hung at a corner by a joint, to the world or to a body, swings as one whose corner is held.
TEST_F(CJoints, HoldNodesOfMeshes) {
  const std::vector<double> place = {0, 0, 0.5, 0, 1, 0, 0, 0.5, 0.5, 0.5, 1, 0.5};
  const std::vector<int32_t> cells = {0, 1, 4, 3, 1, 2, 5, 4};
  std::vector<double> ends_of[3];
  for (int how = 0; how < 3; ++how) { // held; joined to the world; joined to a body that is driven nowhere
    make(2);
    cairn_mesh* mesh = nullptr;
    const int32_t corner = 3;
    ASSERT_EQ(cairn_mesh_create(2, 6, place.data(), &mesh, &error), 0);
    ASSERT_EQ(cairn_mesh_add_elastic_cells(mesh, "q4", 2, cells.data(), 1e6, 0.3, 1000, 0, 1, &error), 0);
    if (how == 0) { ASSERT_EQ(cairn_mesh_hold(mesh, 1, &corner, 3, &error), 0); }
    int64_t first = -1;
    ASSERT_EQ(cairn_scene_add_mesh(scene, mesh, "block", rock, -1, &first, nullptr, &error), 0) << error.message;
    cairn_mesh_destroy(mesh);
    const int64_t post = body({0, 0.6}, 1, 1);
    ball(2, post, 0.05, rock);
    ASSERT_EQ(cairn_scene_drive(scene, 1, &post, 7, nullptr, &error), 0);
    if (how > 0) { ASSERT_EQ(join("Pivot", first + corner, how == 1 ? -1 : post, {0, 0.5}), 0) << error.message; }
    begin();
    steps(100, 2e-3);
    int64_t count = 0;
    ends_of[how].resize(12);
    ASSERT_EQ(cairn_simulation_node_field(simulation, "position", 12, ends_of[how].data(), &count, &error), 0);
    if (how > 0) {
      EXPECT_EQ(cairn_simulation_contacts(simulation), 1);
      EXPECT_EQ(contact("key")[0], double(ends[0]));
    }
    if (how == 0) {
      EXPECT_REFUSED(join("Distance", first, first + 1, {0, 0, 0.5, 0}), "nodes 0 and 1 of one mesh");
      EXPECT_REFUSED(join("Fixed", first, post, {0, 0.1}), "m away from node 0; give the place of the node");
      EXPECT_REFUSED(join("Fixed", first + 99, post, {0, 0.1}), "give the id of a rigid body or of a node of");
      EXPECT_REFUSED(join("Pivot", first, post, {0, 0}, {}, {{"highest", 1.0}}), "highest of Pivot is of an angle");
      EXPECT_REFUSED(join("Cable", first, post, {0, 0, 0, 1, 0, 0.6}), "a node of a mesh; give a Cable rigid bodies");
    }
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    simulation = nullptr;
    scene = nullptr;
  }
  for (std::size_t i = 0; i < 12; ++i)
    for (const int how : {1, 2}) EXPECT_NEAR(ends_of[how][i], ends_of[0][i], 1e-9) << i << " " << how;
  EXPECT_GT(std::abs(ends_of[0][5] - place[5]), 0.05); // it swung
}

TEST_F(CJoints, RopesBreakAtTheirStrength) {
  two(2);
  const std::vector<double> points = {0.1, 0, 0.15, 0}, pull = {-6, 0, 0, 6, 0, 0};
  ASSERT_EQ(join("Distance", 0, 1, points, {}, {{"strength", 5.0}, {"lowest", 0.02}, {"highest", 0.06}}), 0)
      << error.message;
  begin();
  steps(1);
  ASSERT_EQ(cairn_simulation_contacts(simulation), 1);
  EXPECT_EQ(contact("bodies"), (std::vector<double>{0, 1}));
  const std::vector<double> key = contact("key");
  EXPECT_EQ(key[0], double(ends[0]));
  EXPECT_EQ(key[1], double(ends[1]));
  EXPECT_EQ(contact("beta"), std::vector<double>{1});
  ASSERT_EQ(cairn_simulation_set_body_field(simulation, "force", 2, nullptr, pull.data(), &error), 0);
  steps(200); // the rope tightens, and then bears 6 N
  for (const double beta : contact("beta")) EXPECT_EQ(beta, 0);
  const std::vector<double> x = field("position");
  EXPECT_GT(x[2] - x[0], 0.3);
}

// A body that stands turned is held where the joint was made: no leap when it is let go, and its energy is kept.
TEST_F(CJoints, HoldBodiesThatStandTurned) {
  for (const int dim : {2, 3}) {
    two(dim);
    const double down[] = {0, -9.81, 0}, turn[] = {0.5, 0.1, -0.7, 0.5}, angle = 0.7;
    const int64_t first = 0;
    ASSERT_EQ(cairn_scene_set_gravity(scene, down, &error), 0);
    ASSERT_EQ(cairn_scene_set_body_field(scene, "rotation", 1, &first, dim == 2 ? &angle : turn, &error), 0);
    const double arm[] = {-0.1, 0.05, 0.08};
    ASSERT_EQ(join(dim == 2 ? "Pivot" : "Ball", 0, -1, std::vector<double>(arm, arm + dim)), 0) << error.message;
    begin();
    steps(1);
    const std::vector<double> v = field("velocity");
    for (int k = 0; k < dim; ++k) EXPECT_LE(std::abs(v[std::size_t(k)]), 9.81e-3) << dim;
    const double before = energy("kinetic") + energy("potential");
    steps(200);
    const std::vector<double> x = field("position");
    double away = 0, arm_square = 0, moved = 0;
    for (int k = 0; k < dim; ++k) {
      away += (x[std::size_t(k)] - arm[k]) * (x[std::size_t(k)] - arm[k]);
      arm_square += arm[k] * arm[k];
      moved += x[std::size_t(k)] * x[std::size_t(k)];
    }
    EXPECT_GT(moved, 0.1 * arm_square) << dim;
    EXPECT_NEAR(std::sqrt(away / arm_square), 1, 1e-4) << dim;
    EXPECT_NEAR((energy("kinetic") + energy("potential") - before) / energy("kinetic"), 0, 1e-4) << dim;
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    simulation = nullptr;
    scene = nullptr;
  }
}

// A rule about groups that comes later counts before those of materials, and yet the ends of a joint touch nothing.
TEST_F(CJoints, EndsTouchNothing) {
  two(3);
  int32_t grain = -1;
  ASSERT_EQ(cairn_scene_add_material_of_group(scene, "rock", "grains", &grain, &error), 0);
  ball(3, body({0.125, 0, 0}), 0.02, grain); // its surface is beyond those of both, and behind the mark of the end
  ASSERT_EQ(join("Ball", 0, 1, {0.1, 0, 0}), 0) << error.message;
  const double mu = 0.5;
  ASSERT_EQ(cairn_scene_set_rule(scene, "grains", "*", "Coulomb", 1, &mu, &error), 0);
  begin();
  steps(2);
  const std::vector<double> key = contact("key");
  int joints = 0;
  for (std::size_t i = 0; i < key.size(); i += 4) {
    const bool first = key[i] == double(ends[0]), second = key[i + 1] == double(ends[1]);
    joints += first && second;
    for (const double id : {key[i], key[i + 1]})
      EXPECT_TRUE((first && second) || (id != double(ends[0]) && id != double(ends[1])));
  }
  EXPECT_EQ(joints, 1);
}

TEST_F(CJoints, WhatIsWrongIsNamed) {
  two(3);
  const std::vector<double> at = {0.1, 0, 0}, up = {0, 0, 1};
  EXPECT_REFUSED(join("Weld", 0, 1, at),
                 "there is no joint 'Weld'; there are Ball, Hinge, Pivot, Fixed, Slider, Distance");
  EXPECT_REFUSED(join("Pivot", 0, 1, at), "Pivot is a joint of 2D: in 3D give Ball or Hinge");
  EXPECT_REFUSED(join("Hinge", 0, 1, at), "axis of Hinge is missing; give a direction");
  EXPECT_REFUSED(join("Hinge", 0, 1, at, {0, 0, 0}), "length of the axis of Hinge is 0; give a finite direction");
  EXPECT_REFUSED(join("Ball", 0, 1, at, up), "axis of Ball is given; it has none, leave it out");
  EXPECT_REFUSED(join("Ball", 0, 0, at), "a and b of a joint are both body 0; give two bodies");
  EXPECT_REFUSED(join("Ball", -1, 0, at), "a of a joint is -1; give the id of a rigid body");
  EXPECT_REFUSED(join("Ball", 0, 7, at), "b of a joint is 7; give the id of a rigid body");
  EXPECT_REFUSED(join("Ball", 0, 1, {NAN, 0, 0}), "point[0] of Ball is nan; give a finite number");
  EXPECT_REFUSED(join("Ball", 0, 1, at, {}, {{"lowest", 0.0}}), "Ball has no 'lowest'; there are strength");
  EXPECT_REFUSED(join("Ball", 0, 1, at, {}, {{"strength", 0.0}}), "strength of Ball is 0; give a force above 0 [N]");
  EXPECT_REFUSED(join("Ball", 0, 1, at, {}, {{"strength", NAN}}), "strength of Ball is nan; give a number");
  EXPECT_REFUSED(join("Hinge", 0, 1, at, up, {{"lowest", 1.0}, {"highest", 0.0}}),
                 "lowest of Hinge is 1; give no more than highest, 0");
  EXPECT_REFUSED(join("Hinge", 0, 1, at, up, {{"speed", 1.0}}), "effort of Hinge is 0; give what its motor has");
  EXPECT_REFUSED(join("Hinge", 0, 1, at, up, {{"effort", 1.0}}), "speed of Hinge is missing; give it beside effort");
  EXPECT_REFUSED(join("Hinge", 0, 1, at, up, {{"damping", -1.0}}), "damping of Hinge is -1; give a value from 0 on");
  EXPECT_REFUSED(join("Hinge", 0, 1, at, up, {{"rest", 1.0}}), "rest of Hinge is 1; give the stiffness of its spring");
  EXPECT_REFUSED(join("Hinge", 0, 1, at, up, {{"lowest", 0.0}, {"lowest", 0.0}}), "lowest of Hinge is given twice");
  EXPECT_REFUSED(join("Distance", 0, 1, {0, 0, 0, 0, 0, 0}), "points of Distance are the same; give two that differ");
  EXPECT_REFUSED(join("Distance", 0, 1, {0, 0, 0, 1, 0, 0}, {}, {{"highest", 1.0}}),
                 "lowest of Distance is -inf; give a length above 0 [m]");
  EXPECT_REFUSED(cairn_scene_add_joint(scene, "Ball", 0, 1, nullptr, nullptr, 0, nullptr, nullptr, nullptr, &error),
                 "point is NULL");
  // none of these left a trace: the first joint that is right is the one that holds
  ASSERT_EQ(join("Ball", 0, 1, at), 0) << error.message;
  int32_t taken = -1;
  EXPECT_REFUSED(cairn_scene_add_material(scene, "joint 0", &taken, &error), "'joint 0' is the name of a joint");
  spin({0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, -3});
  begin();
  EXPECT_EQ(cairn_simulation_bodies(simulation), 2);
  steps(20);
  EXPECT_EQ(cairn_simulation_contacts(simulation), 1);
}
