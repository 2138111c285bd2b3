// Cohesion through the C API: a cohesive zone against its closed form, joints of each kind that break at their
// strength.
#include <cmath>
#include <numbers>

#include "c_scene.hpp"

namespace {

struct CCohesion : CScene {
  void end() {
    cairn_simulation_destroy(simulation);
    cairn_scene_destroy(scene);
    simulation = nullptr;
    scene = nullptr;
  }
  void weightless(int dim) {
    make(dim);
    const double none[] = {0, 0, 0};
    ASSERT_EQ(cairn_scene_set_gravity(scene, none, &error), 0);
  }
};

// MAL in mode I: K u up to the strength, a parabola behind it, whose area with that triangle is the work of the zone.
TEST_F(CCohesion, AZoneHasItsStrengthAndItsWorkInModeI) {
  const double stiffness = 1e12, strength = 2e6, work = 10, radius = 0.05, h = 2e-5, speed = 1e-3;
  const double first = strength / stiffness, length = 1.5 * (work / strength - first / 2);
  const auto curve = [&](double u) {
    if (u < first) return stiffness * u;
    const double part = (u - first) / length;
    return part < 1 ? strength * (1 - part * part) : 0.0;
  };
  for (const int dim : {2, 3}) {
    end();
    weightless(dim);
    //                         stiffness             mu power recovery within kinetic  strengths    works    pressure,
    //                         power
    const double parameters[] = {stiffness, stiffness, 0.3, 1, 0, 0, strength, strength, work, work, 0, 1, 0.3};
    EXPECT_REFUSED(cairn_scene_set_law(scene, -1, -1, "MAL", 3, parameters, &error), "MAL");
    ASSERT_EQ(cairn_scene_set_law(scene, -1, -1, "MAL", 13, parameters, &error), 0) << error.message;
    const int64_t held = body(std::vector<double>(std::size_t(dim), 0.0), 1, 1);
    std::vector<double> place(std::size_t(dim), 0.0), moving(std::size_t(3 * dim - 3), 0.0);
    place[0] = 2 * radius;
    moving[0] = speed;
    const int64_t heavy = body(place, 1e14, 1e14);
    ball(dim, held, radius, rock);
    ball(dim, heavy, radius, rock);
    ASSERT_EQ(cairn_scene_drive(scene, 1, &held, dim == 2 ? 7 : 63, nullptr, &error), 0) << error.message;
    ASSERT_EQ(cairn_scene_set_body_field(scene, "velocity", 1, &heavy, moving.data(), &error), 0);
    start();
    ASSERT_EQ(cairn_simulation_set_number(simulation, "tol", 1e-12, &error), 0) << error.message;
    const double area = dim == 2 ? radius / 2 : std::numbers::pi * radius * radius / 4;
    double peak = 0, spent = 0, before = 0, off = 0;
    for (int k = 1; k <= 500; ++k) {
      steps(1, h);
      const bool there = cairn_simulation_contacts(simulation) > 0;
      const double stress = there ? std::abs(contact("impulse")[0]) / (h * area) : 0;
      // the law is asked at the middle of the step of theta = 1/2, or at its end: both lie within a step
      const double u = speed * h * k;
      const double low = std::min({curve(u - speed * h), curve(u), curve(u + speed * h)});
      const double high = std::max({curve(u - speed * h), curve(u), curve(u + speed * h)});
      off = std::max(off, std::max(low - stress, stress - high) / strength);
      peak = std::max(peak, stress);
      spent += 0.5 * (before + stress) * speed * h;
      before = stress;
    }
    EXPECT_LT(off, 1e-2) << dim;
    EXPECT_NEAR(peak / strength, 1, 2e-3) << dim;
    EXPECT_NEAR(spent / work, 1, 1e-2) << dim;
    EXPECT_NEAR(energy("released") / (work * area), 1, 1e-6) << dim;
    EXPECT_EQ(energy("stored"), 0);
    EXPECT_LT(std::abs(energy("closure")), 1e-12 * energy("in_play"));
  }
}

// A body that hangs on the world by a joint of each kind: its weight is less, then more than the strength.
TEST_F(CCohesion, JointsOfEachKindBreakAtTheirStrength) {
  struct Kind {
    int dim;
    const char* name;
    std::vector<double> point, axis;
  };
  const std::vector<Kind> kinds = {{2, "Pivot", {0, 0}, {}},
                                   {2, "Fixed", {0, 0}, {}},
                                   {2, "Slider", {0, 0}, {1, 0}},
                                   {2, "Distance", {0, 0, 0, 0.5}, {}},
                                   {2, "Cable", {0, 0, 0, 0.5, 1, 0.5}, {}},
                                   {3, "Ball", {0, 0, 0}, {}},
                                   {3, "Hinge", {0, 0, 0}, {0, 1, 0}},
                                   {3, "Fixed", {0, 0, 0}, {}},
                                   {3, "Slider", {0, 0, 0}, {1, 0, 0}},
                                   {3, "Distance", {0, 0, 0, 0, 0, 0.5}, {}},
                                   {3, "Cable", {0, 0, 0, 0, 0, 0.5, 1, 0, 0.5}, {}}};
  const char* const names[] = {"strength"};
  for (const bool late : {false, true})
    for (const Kind& kind : kinds)
      for (const double share : {1.01, 0.99}) {
        SCOPED_TRACE(testing::Message() << kind.name << " " << kind.dim << " " << share << (late ? " late" : ""));
        end();
        make(kind.dim);
        const int64_t id = body(std::vector<double>(std::size_t(kind.dim), 0.0), 3, 0.1);
        ball(kind.dim, id, 0.1, rock);
        const double strength = share * 3 * 9.81, *axis = kind.axis.empty() ? nullptr : kind.axis.data();
        if (!late) {
          ASSERT_EQ(cairn_scene_add_joint(scene, kind.name, id, -1, kind.point.data(), axis, 1, names, &strength,
                                          nullptr, &error),
                    0)
              << error.message;
        }
        start();
        ASSERT_EQ(cairn_simulation_set_number(simulation, "tol", 1e-11, &error), 0);
        ASSERT_EQ(cairn_simulation_set_number(simulation, "max_iter", 50000, &error), 0);
        if (late) {
          ASSERT_EQ(cairn_simulation_add_joint(simulation, kind.name, id, -1, kind.point.data(), axis, 1, names,
                                               &strength, nullptr, &error),
                    0)
              << error.message;
        }
        steps(100);
        const auto x = field("position");
        const double fell = -x[std::size_t(kind.dim) - 1], free = 0.5 * 9.81 * 0.1 * 0.1;
        if (share > 1) {
          EXPECT_LT(std::abs(fell), 1e-9 * free);
          EXPECT_EQ(contact("beta"), std::vector<double>{1});
        } else {
          EXPECT_NEAR(fell / free, 1, 0.05); // a step or so later
          for (const double beta : contact("beta")) EXPECT_EQ(beta, 0);
        }
      }
}

} // namespace
