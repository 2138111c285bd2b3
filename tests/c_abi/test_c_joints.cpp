// Joints through the C API: constraints of each kind, limits, motors, springs, strength, and refused input.
#include <cmath>
#include <map>
#include <numbers>

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
    const double* along = axis.empty() ? nullptr : axis.data();
    if (simulation)
      return cairn_simulation_add_joint(simulation, kind, a, b, point.data(), along, int32_t(names.size()),
                                        names.data(), values.data(), ends, &error);
    return cairn_scene_add_joint(scene, kind, a, b, point.data(), along, int32_t(names.size()), names.data(),
                                 values.data(), ends, &error);
  }
  void end() {
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    simulation = nullptr;
    scene = nullptr;
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

// A block of cells hung at a corner from a rope over a pulley, with a ball beyond: one tension on both, whichever is a.
TEST_F(CJoints, RopesBeginAtNodes) {
  const std::vector<double> place = {0, 0, 0.5, 0, 1, 0, 0, 0.5, 0.5, 0.5, 1, 0.5};
  const std::vector<int32_t> cells = {0, 1, 4, 3, 1, 2, 5, 4};
  for (const bool node_first : {true, false}) {
    make(2);
    cairn_mesh* mesh = nullptr;
    const int32_t corner = 3;
    ASSERT_EQ(cairn_mesh_create(2, 6, place.data(), &mesh, &error), 0);
    ASSERT_EQ(cairn_mesh_add_elastic_cells(mesh, "q4", 2, cells.data(), 1e6, 0.3, 1000, 0, 1, &error), 0);
    int64_t first = -1;
    const int64_t before = node_first ? -1 : body({-0.5, 0}, 400, 1);
    ASSERT_EQ(cairn_scene_add_mesh(scene, mesh, "block", rock, -1, &first, nullptr, &error), 0) << error.message;
    const int64_t weight = node_first ? body({-0.5, 0}, 400, 1) : before;
    ball(2, weight, 0.05, rock);
    const std::vector<double> points = {0, 0.5, -0.25, 1, -0.5, 0}, back = {-0.5, 0, -0.25, 1, 0, 0.5};
    EXPECT_REFUSED(join("Cable", first, first + 1, {0, 0, 0, 1, 0.5, 0}), "of meshes; give one end a rigid body, or");
    EXPECT_REFUSED(join("Cable", first + corner, weight, {0, 0.4, -0.25, 1, -0.5, 0}), "m away from node");
    ASSERT_EQ(node_first ? join("Cable", first + corner, weight, points) : join("Cable", weight, first + corner, back),
              0)
        << error.message;
    cairn_mesh_destroy(mesh);
    begin();
    for (int k = 0; k < 30; ++k) {
      const double fell = field("velocity")[1];
      steps(1);
      const std::vector<double> pull = contact("impulse"), x = field("position"), v = field("velocity");
      const double tension = std::hypot(pull[0], pull[1]), up = 400 * (v[1] - fell + 9.81e-3);
      EXPECT_GT(tension, 0);
      // along the rope where contacts are detected, half a step before
      const double slope = (1 - x[1]) / std::hypot(-0.25 - x[0], 1 - x[1]);
      EXPECT_NEAR(up, tension * slope, 2e-3 * tension) << k;
      EXPECT_LT(std::abs(energy("closure")), 1e-9 * energy("in_play"));
    }
    EXPECT_EQ(cairn_simulation_contacts(simulation), 1);
    const std::vector<double> key = contact("key");
    for (const int64_t of : ends) EXPECT_TRUE(key[0] == double(of) || key[1] == double(of));
    end();
  }
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
    if (how == 0) {
      EXPECT_REFUSED(join("Distance", first, first + 1, {0, 0, 0.5, 0}), "nodes 0 and 1 of one mesh");
      EXPECT_REFUSED(join("Fixed", first, post, {0, 0.1}), "m away from node 0; give the place of the node");
      EXPECT_REFUSED(join("Fixed", first + 99, post, {0, 0.1}), "give the id of a rigid body or of a node of");
      EXPECT_REFUSED(join("Pivot", first, post, {0, 0}, {}, {{"highest", 1.0}}), "highest of Pivot is of an angle");
      EXPECT_REFUSED(join("Cable", post, -1, {0, 0.6, 0, 0, 1, 0}, {}, {{"pulley", double(first)}}),
                     "pulley of a joint is 0, a node of a mesh; give a rigid body, or leave it out: the world");
    }
    begin();
    EXPECT_REFUSED(join("Pivot", first, post, {0, 0}),
                   "a node of a mesh; give a rigid body, or join it by cairn_scene_");
    steps(100, 2e-3);
    int64_t count = 0;
    ends_of[how].resize(12);
    ASSERT_EQ(cairn_simulation_node_field(simulation, "position", 12, ends_of[how].data(), &count, &error), 0);
    if (how > 0) {
      EXPECT_EQ(cairn_simulation_contacts(simulation), 1);
      EXPECT_EQ(contact("key")[0], double(ends[0]));
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

// In mid-flight: momentum and centres are kept, and released bodies fly on.
TEST_F(CJoints, AreMadeAndLetGoInARun) {
  for (const int dim : {2, 3}) {
    two(dim);
    spin(dim == 2 ? std::vector<double>{0.3, -0.2, 2, -0.1, 0.3, -1}
                  : std::vector<double>{0.3, -0.2, 0.1, 2, -1, 1.5, -0.1, 0.3, 0.2, 1, 2, -3});
    begin();
    steps(20);
    EXPECT_EQ(cairn_simulation_contacts(simulation), 0);
    const auto momentum = [&](int k) {
      const std::vector<double> v = field("velocity");
      return v[std::size_t(k)] + v[std::size_t(3 * dim - 3 + k)];
    };
    std::vector<double> before, x = field("position"), middle;
    for (int k = 0; k < dim; ++k) {
      before.push_back(momentum(k));
      middle.push_back((x[std::size_t(k)] + x[std::size_t(dim + k)]) / 2);
    }
    ASSERT_EQ(join("Fixed", 0, 1, middle), 0) << error.message;
    const auto apart = [&] {
      x = field("position");
      double square = 0;
      for (std::size_t k = 0; k < std::size_t(dim); ++k)
        square += (x[k] - x[std::size_t(dim) + k]) * (x[k] - x[std::size_t(dim) + k]);
      return std::sqrt(square);
    };
    const double wide = apart();
    for (int k = 0; k < 20; ++k) {
      steps(10);
      EXPECT_NEAR(apart(), wide, 1e-6 * wide) << dim;
    }
    EXPECT_EQ(cairn_simulation_contacts(simulation), 1);
    EXPECT_EQ(contact("key")[0], double(ends[0]));
    EXPECT_EQ(contact("beta"), std::vector<double>{1});
    for (int k = 0; k < dim; ++k) EXPECT_NEAR(momentum(k), before[std::size_t(k)], 1e-12) << dim;
    EXPECT_LT(std::abs(energy("closure")), 1e-10 * energy("in_play"));
    ASSERT_EQ(cairn_simulation_remove_joint(simulation, ends, &error), 0) << error.message;
    steps(100);
    EXPECT_EQ(cairn_simulation_contacts(simulation), 0);
    EXPECT_GT(std::abs(apart() - wide), 1e-3 * wide) << dim;
    for (int k = 0; k < dim; ++k) EXPECT_NEAR(momentum(k), before[std::size_t(k)], 1e-12) << dim;
    EXPECT_REFUSED(cairn_simulation_remove_joint(simulation, ends, &error), "which no joint has; give those of one");
    end();
  }
}

// A bar that rests is hung at its end in a run: it swings with the period of a physical pendulum, and a joint that was
// there before holds as it did.
TEST_F(CJoints, AreHungFromTheWorldInARun) {
  for (const int dim : {2, 3}) {
    two(dim);
    std::vector<double> at(std::size_t(dim), 0.0);
    at[0] = 0.25;
    ASSERT_EQ(join(dim == 2 ? "Pivot" : "Ball", 1, -1, at), 0) << error.message;
    begin();
    steps(5);
    const double g = 9.81, arm = 0.1, lean = 0.1, down[] = {0, -g, 0};
    const std::vector<double> hung = dim == 2 ? std::vector<double>{-arm * std::sin(lean), arm * std::cos(lean)}
                                              : std::vector<double>{-arm * std::sin(lean), arm * std::cos(lean), 0};
    ASSERT_EQ(join(dim == 2 ? "Pivot" : "Hinge", 0, -1, hung,
                   dim == 2 ? std::vector<double>{} : std::vector<double>{0, 0, 1}),
              0)
        << error.message;
    EXPECT_EQ(cairn_simulation_bodies(simulation), 4);
    ASSERT_EQ(cairn_simulation_set_gravity(simulation, down, &error), 0);
    const double inertia = 0.01 + arm * arm, period = 2 * std::numbers::pi * std::sqrt(inertia / (g * arm)), h = 1e-3;
    // that of a swing of `lean` is longer by lean^2/16
    int turns = 0, step = 0;
    double first = 0, last = 0;
    for (double before = field("velocity")[0]; turns < 5; ++step) {
      steps(1, h);
      const double now = field("velocity")[0];
      if (step > 0 && (now > 0) != (before > 0)) {
        last = (step + 1) * h - h * now / (now - before);
        if (turns++ == 0) first = last;
      }
      before = now;
    }
    EXPECT_NEAR((last - first) / 2, period * (1 + lean * lean / 16), 5e-4 * period) << dim;
    const std::vector<double> x = field("position");
    double square = 0;
    for (std::size_t k = 0; k < 2; ++k) square += (x[k] - hung[k]) * (x[k] - hung[k]);
    EXPECT_NEAR(std::sqrt(square), arm, 1e-5 * arm) << dim;
    EXPECT_NEAR(x[std::size_t(dim)], 0.25, 1e-9);
    end();
  }
}

TEST_F(CJoints, SpringsThatAreLetGoAreAccountedFor) {
  two(2);
  spin({-0.5, 0, 0, 0.5, 0, 0});
  begin();
  steps(1);
  const std::vector<double> x = field("position");
  ASSERT_EQ(join("Distance", 0, 1, x, {}, {{"stiffness", 500.0}}), 0) << error.message;
  steps(20);
  const double stored = energy("stored");
  EXPECT_GT(stored, 0.01 * energy("kinetic"));
  ASSERT_EQ(cairn_simulation_remove_joint(simulation, ends, &error), 0) << error.message;
  steps(5);
  EXPECT_EQ(energy("stored"), 0);
  EXPECT_NEAR(energy("dissipated_reshaping"), stored, 1e-12 * stored);
  EXPECT_LT(std::abs(energy("closure")), 1e-11 * energy("in_play"));
}

// A restart goes into a simulation in which the same was joined and let go.
TEST_F(CJoints, OfARunAreInCheckpoints) {
  const std::string path = testing::TempDir() + "joints_of_a_run.h5";
  std::vector<double> reached;
  for (const bool again : {false, true}) {
    two(2);
    spin({0.3, -0.2, 2, -0.1, 0.3, -1});
    begin();
    int64_t first[2] = {-1, -1};
    const auto hang = [&] {
      ASSERT_EQ(join("Pivot", 0, 1, {0.1, 0}), 0) << error.message;
      first[0] = ends[0];
      first[1] = ends[1];
      ASSERT_EQ(join("Pivot", 1, -1, {0.25, 0}), 0) << error.message;
      ASSERT_EQ(cairn_simulation_remove_joint(simulation, first, &error), 0) << error.message;
    };
    if (again) {
      EXPECT_EQ(cairn_simulation_restart(simulation, path.c_str(), &error), cairn_file_error);
      EXPECT_NE(std::string(error.message).find("materials"), std::string::npos) << error.message;
      hang();
      ASSERT_EQ(cairn_simulation_restart(simulation, path.c_str(), &error), 0) << error.message;
    } else {
      hang();
      steps(30);
      ASSERT_EQ(cairn_simulation_write_checkpoint(simulation, path.c_str(), &error), 0) << error.message;
    }
    steps(30);
    if (again) { EXPECT_EQ(field("position"), reached); }
    reached = field("position");
    end();
  }
  std::remove(path.c_str());
}

TEST_F(CJoints, OfARunThatAreWrongLeaveAllAsItWas) {
  two(3);
  spin({0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, -3});
  begin();
  steps(3);
  const std::vector<double> at = {0.1, 0, 0};
  EXPECT_REFUSED(join("Weld", 0, 1, at), "there is no joint 'Weld'; there are Ball, Hinge");
  EXPECT_REFUSED(join("Ball", 0, 7, at), "b of a joint is 7; give the id of a rigid body");
  EXPECT_REFUSED(join("Ball", 0, 0, at), "a and b of a joint are both body 0; give two bodies");
  EXPECT_REFUSED(join("Ball", 0, 1, {NAN, 0, 0}), "point[0] of Ball is nan; give a finite number");
  EXPECT_REFUSED(join("Ball", 0, 1, at, {}, {{"strength", -1.0}}), "strength of Ball is -1; give a force above 0 [N]");
  EXPECT_REFUSED(join("Cable", 0, 1, {0, 0, 0, 0.1, 1, 0, 0.25, 0, 0}, {}, {{"length", 1.0}}), "length of Cable is 1");
  EXPECT_REFUSED(
      cairn_simulation_add_joint(simulation, nullptr, 0, 1, at.data(), nullptr, 0, nullptr, nullptr, nullptr, &error),
      "kind is NULL");
  EXPECT_REFUSED(cairn_simulation_remove_joint(simulation, nullptr, &error), "ends is NULL");
  const int64_t bodies[] = {0, 1}, none[] = {77, 78};
  EXPECT_REFUSED(cairn_simulation_remove_joint(simulation, bodies, &error), "ends are 0 and 1, which no joint has");
  EXPECT_REFUSED(cairn_simulation_remove_joint(simulation, none, &error), "ends are 77 and 78, which no joint has");
  EXPECT_EQ(cairn_simulation_bodies(simulation), 2);
  steps(2);
  EXPECT_EQ(cairn_simulation_contacts(simulation), 0);
  const std::vector<double> v = field("velocity");
  EXPECT_EQ(v[5], 2);
  EXPECT_EQ(v[11], -3);
  // a strategy that has no impulses takes no joint
  ASSERT_EQ(cairn_simulation_set_option(simulation, "strategy", "smooth_dem", &error), 0) << error.message;
  EXPECT_REFUSED(join("Ball", 0, 1, at), "oint");
  EXPECT_EQ(cairn_simulation_bodies(simulation), 2);
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
