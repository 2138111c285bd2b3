// Warnings of the C API about steps that converge and are inaccurate nevertheless.
#include "c_scene.hpp"

namespace {

struct CWarnings : CScene {
  void segment(int64_t id, double radius) {
    const double along[] = {1, 0, 0.5};
    ASSERT_EQ(cairn_scene_add_contactors(scene, "segment", 1, &id, &rock, &radius, nullptr, along, nullptr, &error), 0)
        << error.message;
  }
  bool says(const std::string& words) { return text("warning").find(words) != std::string::npos; }
};

TEST_F(CWarnings, NothingIsToldOfASceneThatIsRight) {
  make(2);
  floor(2);
  ball(2, body({0, 0.1}), 0.1, rock);
  start();
  steps(3);
  EXPECT_EQ(text("warning"), "");
}

TEST_F(CWarnings, ABodyWithinAnother) {
  make(2);
  ball(2, body({0, 0.1}), 0.1, rock);
  ball(2, body({0.05, 0.1}), 0.1, rock);
  start();
  steps(1);
  EXPECT_TRUE(says("bodies 0 and 1 overlap by 1.5 of the smaller one's size")) << text("warning");
}

TEST_F(CWarnings, ABodyFasterThanItsSizeAStep) {
  make(2);
  floor(2);
  const int64_t id = body({0, 3});
  ball(2, id, 0.1, rock);
  start();
  const double fast[] = {500, 0, 0};
  ASSERT_EQ(cairn_simulation_set_body_field(simulation, "velocity", 1, &id, fast, &error), 0) << error.message;
  steps(1);
  EXPECT_TRUE(says("a body moved by 5 times its size")) << text("warning");
}

TEST_F(CWarnings, ShapesThatPassThroughEachOther) {
  make(2);
  floor(2);
  segment(body({0, 1}), 0.1);
  ball(2, body({0, 5}), 0.1, rock);
  start();
  steps(1);
  EXPECT_TRUE(says("no contact between shapes half_plane and segment: bodies such as 0 and 1 pass")) << text("warning");
  EXPECT_FALSE(says("disk"));
}

TEST_F(CWarnings, WhatCannotMoveOrHasNoLawIsNotTold) {
  make(2);
  floor(2);
  segment(body({0, 1}, infinite, infinite), 0.1);
  ball(2, body({0, 5}), 0.1, rock);
  start();
  steps(1);
  EXPECT_EQ(text("warning"), "");
}

} // namespace
