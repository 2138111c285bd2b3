// Pairs kept between calls give the same contacts as a search, to the bit and in its order.
#include <gtest/gtest.h>
#include <omp.h>

#include <cstring>
#include <functional>

#include "base/call.hpp"
#include "detection_scene.hpp"

using namespace cairn;
using namespace cairn::test;

namespace {

bool same_bits(const Candidates& a, const Candidates& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof x[0]) == 0;
  };
  return a.count == b.count && same(a.contactor_a, b.contactor_a) && same(a.contactor_b, b.contactor_b) &&
         same(a.image, b.image) && same(a.feature, b.feature) && same(a.gap, b.gap) && same(a.normal, b.normal) &&
         same(a.point, b.point);
}

struct Kept {
  InteractionHandler handler;
  Candidates found;
  const LawRules* rules = nullptr;
  void detect(const DetectionScene& scene) {
    handler.detect(scene.bodies, scene.contactors, scene.cell, {0, scene.margin.data()}, found, {.soon_again = true},
                   nullptr, rules);
  }
  // True if it had to search; the contacts are those of a fresh handler.
  bool searched(const DetectionScene& scene) {
    const std::int64_t before = handler.searches();
    detect(scene);
    InteractionHandler fresh;
    EXPECT_TRUE(same_bits(scene.detect(fresh, rules), found));
    return handler.searches() > before;
  }
};

// Balls and walls, or all shapes.
DetectionScene pack(int dim, std::mt19937_64& random, bool all_shapes = false) {
  if (all_shapes) return random_scene(dim, 200, dim == 2 ? 0.05 : 0.1, 4, random);
  std::uniform_real_distribution<double> u(0, 1);
  DetectionScene scene(dim);
  for (int i = 0; i < 300; ++i) {
    std::vector<double> x(dim);
    for (double& c : x) c = u(random);
    scene.add(scene.add_body(x), dim == 2 ? Shape::disk : Shape::sphere, (dim == 2 ? 0.02 : 0.05) * (1 + u(random)),
              1e-3);
  }
  for (int k = 0; k < dim; ++k) {
    std::vector<double> up(dim + 1, 0.0);
    up[k] = 1;
    scene.add(scene.add_body(std::vector<double>(dim, 0.0), false), dim == 2 ? Shape::half_plane : Shape::plane, 0,
              1e-3, {}, up);
  }
  if (dim == 2) scene.add(scene.add_body({0.5, 0.5}, false), Shape::ring, 0.6, 1e-3);
  if (dim == 3) scene.add(scene.add_body({0.5, 0.5, 0.5}, false), Shape::tube, 0.6, 1e-3, {}, {0, 0, 1, INFINITY});
  return scene;
}

} // namespace

TEST(KeptPairs, find_what_a_search_finds_while_bodies_move) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> g;
  for (int dim : {2, 3})
    for (double step : {1e-5, 2e-4, 2e-3}) {
      auto scene = pack(dim, random);
      Kept kept;
      std::vector<double> drift(std::size_t(dim) * 300);
      for (double& d : drift) d = step * g(random);
      int searches = 0;
      for (int k = 0; k < 60; ++k) {
        searches += kept.searched(scene);
        EXPECT_GT(kept.found.count, 50);
        for (std::size_t i = 0; i < drift.size(); ++i) scene.bodies.position.values[i] += drift[i] + step * g(random);
        for (double& m : scene.margin) m = 1e-3 * (1 + 0.2 * std::abs(g(random)));
      }
      EXPECT_LE(searches, step < 1e-4 ? 2 : 60);
      EXPECT_GE(searches, step > 1e-3 ? 50 : 1);
    }
}

TEST(KeptPairs, end_when_what_they_were_found_from_changes) {
  std::mt19937_64 random(2);
  LawRules rules(3), others(3);
  rules.add(0, 1, false);
  others.add(0, 2, false);
  for (int dim : {2, 3}) {
    auto scene = pack(dim, random);
    for (std::int64_t i = 0; i < 300; ++i) scene.contactors.material.values[i] = std::int32_t(i % 3);
    Kept kept;
    const std::int64_t wall = 300, hollow = 300 + dim;
    const std::vector<std::pair<const char*, std::function<void()>>> changes = {
        {"a jump", [&] { scene.bodies.position[7][0] += 0.3; }},
        {"a margin", [&] { scene.margin[8] += 0.1; }},
        {"a radius", [&] { scene.contactors.radius.values[9] *= 2; }},
        {"a wall that moves", [&] { scene.bodies.position[wall][0] += 0.1; }},
        {"a wall that turns", [&] { scene.contactors.direction[wall][0] = -1; }},
        {"a ring that shrinks", [&] { scene.contactors.radius.values[hollow] = 0.4; }},
        {"a body that is held", [&] { std::fill_n(scene.bodies.inverse_mass[3], scene.bodies.dofs(), 0.0); }},
        {"a material", [&] { std::swap(scene.contactors.material.values[0], scene.contactors.material.values[1]); }},
        {"no rules", [&] { kept.rules = nullptr; }},
        {"other rules", [&] { kept.rules = &others; }},
        {"another body",
         [&] {
           scene.add(scene.add_body(std::vector<double>(dim, 0.5)), dim == 2 ? Shape::disk : Shape::sphere, 0.04, 1e-3);
         }},
        {"another order", [&] { scene.shuffle(random); }},
        {"bodies that are gone",
         [&] {
           for (int k = 0; k < 20; ++k) {
             --scene.contactors.count;
             --scene.bodies.count;
           }
           scene.bodies.for_each_field([&](auto& field) { field.resize(scene.bodies.count); });
           scene.contactors.for_each_field([&](auto& field) { field.resize(scene.contactors.count); });
           for (auto& body : scene.contactors.body.values) body = body >= scene.bodies.count ? 0 : body;
         }},
    };
    for (const auto& [what, change] : changes) {
      if (what == std::string("a material")) kept.rules = &rules;
      kept.searched(scene);
      for (int k = 0; k < 4; ++k) EXPECT_FALSE(kept.searched(scene)) << what; // long enough that they pay
      change();
      EXPECT_TRUE(kept.searched(scene)) << what;
      EXPECT_FALSE(kept.searched(scene)) << what;
      for (int k = 0; k < 4; ++k) kept.detect(scene);
    }
  }
}

TEST(KeptPairs, are_left_alone_where_bodies_move_too_fast_and_begin_again_when_they_rest) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> g;
  auto scene = pack(2, random);
  Kept kept;
  for (int k = 0; k < 40; ++k) {
    for (double& x : scene.bodies.position.values) x += 0.01 * g(random);
    EXPECT_TRUE(kept.searched(scene));
  }
  int searches = 0;
  for (int k = 0; k < 100; ++k) searches += kept.searched(scene);
  EXPECT_LT(searches, 70); // the rest after a few failures, then none
  EXPECT_FALSE(kept.searched(scene));
}

TEST(KeptPairs, serve_any_number_of_threads_and_any_unit_of_length) {
  std::mt19937_64 random(4);
  for (int dim : {2, 3})
    for (int power : {0, 40, -900, 500}) {
      auto scene = random_scene(dim, 20000, dim == 2 ? 0.01 : 0.03, 3, random, false);
      scene.scale(std::ldexp(1.0, power));
      const int before = omp_get_max_threads();
      Kept kept;
      int searches = 0;
      for (int n : {1, 2, 5, 1, 3}) {
        omp_set_num_threads(n);
        searches += kept.searched(scene);
        for (double& x : scene.bodies.position.values) x += std::ldexp(1e-5, power);
      }
      omp_set_num_threads(before);
      EXPECT_LE(searches, std::abs(power) < 500 ? 1 : 5) << power; // squares of others are no numbers to trust
    }
}

TEST(KeptPairs, of_all_shapes_in_periodic_cells_and_declared_are_those_of_a_search) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> g;
  for (int dim : {2, 3})
    for (bool periodic : {false, true}) {
      auto scene = random_scene(dim, 200, 0.08, 4, random, !periodic);
      for (int k = 0; k < dim && periodic; ++k) scene.cell.periodic[k] = true, scene.cell.vectors[4 * k] = 1;
      Kept kept;
      for (int k = 0; k < 30; ++k) {
        kept.searched(scene);
        for (double& x : scene.bodies.position.values) x += 1e-4 * g(random);
        if (k > 10 && k < 20)
          for (std::int64_t i = 0; i < scene.bodies.count && dim == 2; ++i) scene.bodies.rotation[i][0] += 0.01;
        if (k == 15) scene.cell.vectors[0] *= 1.01;
        if (k == 18) scene.bodies.position[3][0] += 1; // brought back into the cell
      }
      const auto is_ball = [&](std::int64_t i) { return info(Shape(scene.contactors.shape.values[i])).ball(); };
      std::int64_t one = 0, other = 100;
      while (!is_ball(one)) ++one;
      while (!is_ball(other)) ++other;
      kept.handler.declared().push_back({one, other});
      kept.detect(scene);
      InteractionHandler fresh;
      fresh.declared() = kept.handler.declared();
      EXPECT_TRUE(same_bits(scene.detect(fresh), kept.found));
      kept.handler.declared().clear();
      kept.searched(scene);
    }
}

TEST(KeptPairs, say_what_stands_nowhere_and_go_on) {
  std::mt19937_64 random(6);
  auto scene = pack(2, random);
  Kept kept;
  for (int k = 0; k < 4; ++k) kept.searched(scene);
  const double x = scene.bodies.position[5][0];
  for (double wrong : {NAN, INFINITY}) {
    scene.bodies.position[5][0] = wrong;
    EXPECT_THROW(kept.detect(scene), Error);
    EXPECT_EQ(kept.found.count, 0);
    scene.bodies.position[5][0] = x;
    kept.searched(scene);
  }
  scene.margin[4] = NAN;
  EXPECT_THROW(kept.detect(scene), Error);
}
