// Detection where it is easy to get wrong: exact touch, coincident centres, extremes of size and place, bonds, bad
// input.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "base/call.hpp"
#include "base/threads.hpp"
#include "detection_scene.hpp"

using namespace cairn;
using namespace cairn::test;

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();

DetectionScene two(Shape a, Shape b, double radius_a, double radius_b, std::vector<double> between,
                   std::vector<double> direction_b = {}) {
  const int dim = int(between.size());
  DetectionScene scene(dim);
  scene.add(scene.add_body(between), a, radius_a, 1e-3);
  scene.add(scene.add_body(std::vector<double>(dim, 0.0)), b, radius_b, 1e-3, {}, direction_b);
  return scene;
}

// Message of the error that detection throws.
std::string complaint(const DetectionScene& scene) {
  try {
    scene.detect();
  } catch (const Error& error) { return error.what(); }
  return "";
}

bool says(const std::string& message, const std::string& part) { return message.find(part) != std::string::npos; }

} // namespace

TEST(DetectionEdges, touching_exactly_has_gap_zero) {
  const auto expect_touch = [](const DetectionScene& scene, std::vector<double> normal, std::vector<double> point) {
    const Candidates found = scene.detect();
    ASSERT_EQ(found.count, 1);
    EXPECT_EQ(found.gap[0], 0.0);
    for (int k = 0; k < scene.dim; ++k) {
      EXPECT_EQ(found.normal[k], normal[k]);
      EXPECT_DOUBLE_EQ(found.point[k], point[k]);
    }
  };
  expect_touch(two(Shape::disk, Shape::disk, 2, 3, {3, 4}), {0.6, 0.8}, {1.8, 2.4});
  expect_touch(two(Shape::disk, Shape::segment, 2, 1, {0.5, -3}, {1, 0, 1}), {0, -1}, {0.5, -1});
  expect_touch(two(Shape::disk, Shape::segment, 2, 3, {1 + 3, 4}, {1, 0, 1}), {0.6, 0.8}, {2.8, 2.4});
  expect_touch(two(Shape::disk, Shape::half_plane, 2, 0, {7, 2}, {0, 1, 0}), {0, 1}, {7, 0});
  expect_touch(two(Shape::sphere, Shape::sphere, 1, 2, {1, 2, 2}), {1. / 3, 2. / 3, 2. / 3}, {2. / 3, 4. / 3, 4. / 3});
  expect_touch(two(Shape::sphere, Shape::plane, 2, 0, {5, 6, 2}, {0, 0, 1, 0}), {0, 0, 1}, {5, 6, 0});
  expect_touch(two(Shape::sphere, Shape::tube, 1, 6, {3, 4, 9}, {0, 0, 1, inf}), {-0.6, -0.8, 0}, {3.6, 4.8, 9});
  expect_touch(two(Shape::sphere, Shape::tube, 5, 6, {2, 0, 5}, {0, 0, 1, 2}), {-0.8, 0, 0.6}, {6, 0, 2}); // the rim
}

TEST(DetectionEdges, deep_overlap_and_coincident_centres_have_a_unit_normal) {
  for (double offset : {0.0, 1e-300, 1e-160, 1e-9, 0.3}) {
    for (const auto& scene : {two(Shape::disk, Shape::disk, 1, 2, {0, offset}),
                              two(Shape::disk, Shape::segment, 1, 2, {0.2, offset}, {1, 0, 1}),
                              two(Shape::disk, Shape::half_plane, 1, 0, {0.2, -offset}, {0, 1, 0}),
                              two(Shape::sphere, Shape::sphere, 1, 2, {0, offset, 0}),
                              two(Shape::sphere, Shape::plane, 1, 0, {0, -offset, 0}, {0, 1, 0, 0}),
                              two(Shape::sphere, Shape::tube, 1, 1.0009765625, {0, offset, 0}, {0, 0, 1, 4})}) {
      const Candidates found = scene.detect();
      ASSERT_EQ(found.count, 1);
      double length = 0;
      for (int k = 0; k < scene.dim; ++k) length += found.normal[k] * found.normal[k];
      EXPECT_NEAR(length, 1, 1e-15);
      EXPECT_TRUE(std::isfinite(found.gap[0]));
      if (offset > 0) { EXPECT_EQ(std::abs(found.normal[1]), 1); }
    }
  }
  EXPECT_EQ(two(Shape::disk, Shape::disk, 1, 2, {0, 0}).detect().gap[0], -3);
}

TEST(DetectionEdges, a_finite_tube_is_felt_from_inside_and_at_its_rim) {
  const auto count = [](double radius, std::vector<double> at, double half) {
    return two(Shape::sphere, Shape::tube, radius, 2, std::move(at), {0, 0, 1, half}).detect().count;
  };
  EXPECT_EQ(count(0.5, {1.6, 0, 0}, 3), 1);
  EXPECT_EQ(count(0.5, {1.0, 0, 0}, 3), 0);
  EXPECT_EQ(count(0.5, {1.6, 0, 3.2}, 3), 1); // leans on the rim
  EXPECT_EQ(count(0.5, {1.6, 0, 3.6}, 3), 0);
  EXPECT_EQ(count(0.5, {2.6, 0, 0}, 3), 0); // clear of its outer side
  EXPECT_EQ(count(0.5, {9, 0, 0}, inf), 1); // outside an endless tube there is nowhere to be
  const std::string message = complaint(two(Shape::sphere, Shape::tube, 2.5, 2, {0, 0, 0}, {0, 0, 1, inf}));
  EXPECT_TRUE(says(message, "wider") && says(message, "body 100") && says(message, "body 101")) << message;
}

TEST(DetectionEdges, one_body_far_away_costs_no_memory) {
  for (int dim : {2, 3})
    for (double far : {1e9, -1e15, 1e300}) {
      std::mt19937_64 random(3);
      DetectionScene scene = random_scene(dim, 4000, dim == 2 ? 0.01 : 0.05, 1.4, random, false);
      InteractionHandler near_handler, far_handler;
      const ContactMap near = by_key(scene, scene.detect(near_handler));
      const double size = scene.contactors.radius.values[0];
      std::vector<double> x(dim, 0.5);
      x[1] = far;
      scene.add(scene.add_body(x), dim == 2 ? Shape::disk : Shape::sphere, size, 0);
      x.assign(dim, far);
      scene.add(scene.add_body(x), dim == 2 ? Shape::disk : Shape::sphere, size, 0);
      const ContactMap found = by_key(scene, scene.detect(far_handler));
      EXPECT_EQ(found.size(), near.size());
      for (const auto& [key, contact] : near) EXPECT_TRUE(found.count(key));
      EXPECT_LT(far_handler.bytes(), 2 * near_handler.bytes() + 4096);
    }
}

// Sizes from 1e-9 to 1e6 in clusters 1e9 apart: cells of the finest are counted to 1e18, and the rows of the grid leave
// 62 bits.
TEST(DetectionEdges, copes_with_all_sizes_and_places_at_once) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int dim : {2, 3}) {
    DetectionScene scene(dim);
    const Shape round = dim == 2 ? Shape::disk : Shape::sphere;
    for (double size : {1e-9, 1e-3, 1.0, 1e6})
      for (int cluster = 0; cluster < 6; ++cluster) {
        std::vector<double> middle(dim);
        for (double& x : middle) x = cluster == 0 ? 0 : 1e9 * u(random);
        for (int i = 0; i < 12; ++i) {
          std::vector<double> x(middle);
          for (double& c : x) c += 3 * size * u(random);
          scene.add(scene.add_body(x), round, size * (1 + 0.3 * u(random)), 0.1 * size);
        }
      }
    const ContactMap found = by_key(scene, scene.detect()), plain = plain_answer(scene, {0, 0, 0});
    EXPECT_GT(plain.size(), 500u);
    EXPECT_EQ(found.size(), plain.size());
    for (const auto& [key, contact] : plain) {
      ASSERT_TRUE(found.count(key)) << key.contactor_a << " " << key.contactor_b;
      EXPECT_NEAR(found.at(key).gap, contact.gap, 1e-15 * (std::abs(contact.gap) + 4e6));
    }
  }
}

// Coordinates so many that even shortened keys would not fit: cells are merged, and the contacts stay the same.
TEST(DetectionEdges, merges_cells_when_the_keys_would_not_fit) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> u(0, 1e12);
  DetectionScene scene(3);
  const std::int64_t n = 290000;
  scene.bodies.count = scene.contactors.count = n;
  scene.bodies.for_each_field([&](auto& field) { field.resize(n); });
  scene.contactors.for_each_field([&](auto& field) { field.resize(n); });
  scene.margin.assign(n, 0.0);
  for (std::int64_t i = 0; i < n; ++i) {
    for (int k = 0; k < 3; ++k) scene.bodies.position[i][k] = i % 2 ? scene.bodies.position[i - 1][k] + 0.5 : u(random);
    scene.bodies.rotation[i][0] = 1;
    for (int k = 0; k < 6; ++k) scene.bodies.inverse_mass[i][k] = 1;
    scene.bodies.id.values[i] = scene.contactors.id.values[i] = i;
    scene.contactors.body.values[i] = std::int32_t(i);
    scene.contactors.shape.values[i] = std::int16_t(Shape::sphere);
    scene.contactors.radius.values[i] = 1;
  }
  EXPECT_EQ(scene.detect().count, n / 2);
}

// The cell of a position must be exact even where few digits remain below the size of a cell.
TEST(DetectionEdges, finds_neighbours_where_positions_have_few_digits) {
  std::mt19937_64 random(6);
  for (int dim : {2, 3})
    for (int power = 36; power <= 53; ++power) {
      DetectionScene scene(dim);
      const double origin = std::ldexp(1.95, power), step = std::max(std::ldexp(1.0, power - 52), 1e-3);
      std::uniform_int_distribution<int> u(0, int(12 / step));
      for (int i = 0; i < 150; ++i) {
        std::vector<double> x(dim);
        for (double& c : x) c = 1.9 * (u(random) % 3); // rows that touch
        x[0] = origin + step * u(random);
        scene.add(scene.add_body(x), dim == 2 ? Shape::disk : Shape::sphere, 0.95, 0);
      }
      const ContactMap found = by_key(scene, scene.detect()), plain = plain_answer(scene, {0, 0, 0});
      EXPECT_EQ(found.size(), plain.size());
      for (const auto& [key, contact] : plain) ASSERT_TRUE(found.count(key)) << power << " " << contact.gap;
    }
}

TEST(DetectionEdges, clusters_far_apart_cost_no_more_than_one) {
  const int side = 45;
  const Threads threads(1, 0); // each would bring memory of its own
  DetectionScene scene(3);
  std::int64_t bytes[2];
  for (int cluster = 0; cluster < 2; ++cluster) {
    for (int i = 0; i < side * side * side; ++i) {
      const double x[3] = {double(i % side), double(i / side % side), double(i / side / side)};
      const double away = 1e12 * cluster;
      scene.add(scene.add_body({x[0] + away, x[1] - away, x[2] + 2 * away}), Shape::sphere, 0.5, 1e-3);
    }
    InteractionHandler handler; // were all of a cluster in one cell, this would not end
    EXPECT_EQ(scene.detect(handler).count, (1 + cluster) * 3 * side * side * (side - 1));
    bytes[cluster] = handler.bytes();
  }
  EXPECT_LT(bytes[1], 2.5 * double(bytes[0]));
}

TEST(DetectionEdges, equal_bodies_meet_once_across_each_boundary) {
  for (double offset : {0.0, 0.5, -7.25}) { // on the boundary, and off it
    DetectionScene scene(3);
    for (int i = 0; i < 64; ++i)
      scene.add(scene.add_body({i % 4 + offset, i / 4 % 4 + offset, i / 16 + offset}), Shape::sphere, 0.5, 0);
    for (int k = 0; k < 3; ++k) {
      scene.cell.periodic[k] = true;
      scene.cell.vectors[4 * k] = 4;
    }
    EXPECT_EQ(scene.detect().count, 3 * 64);
    scene.cell.vectors[3] = scene.cell.vectors[7] = 4; // the same lattice, told with a strong lean
    EXPECT_EQ(scene.detect().count, 3 * 64);
    scene.cell.vectors[6] = 4;
    EXPECT_EQ(scene.detect().count, 3 * 64);
  }
  DetectionScene corner(2); // as far from the boundaries, so that nothing but their numbers tells the two apart
  corner.add(corner.add_body({0.5, 3.5}), Shape::disk, 0.75, 0);
  corner.add(corner.add_body({3.5, 0.5}), Shape::disk, 0.75, 0);
  for (int k = 0; k < 2; ++k) {
    corner.cell.periodic[k] = true;
    corner.cell.vectors[4 * k] = 4;
  }
  EXPECT_EQ(corner.detect().count, 1);
}

TEST(DetectionEdges, a_cell_may_lean_strongly) {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> u(0, 4);
  for (const auto& lean : {std::array{4., 4., 0.}, {-4., 4., 4.}, {7., -3., 2.}, {4., 4., 4.}}) {
    DetectionScene scene(3);
    for (int i = 0; i < 60; ++i) scene.add(scene.add_body({u(random), u(random), u(random)}), Shape::sphere, 0.6, 0);
    for (int k = 0; k < 3; ++k) {
      scene.cell.periodic[k] = true;
      scene.cell.vectors[4 * k] = 4;
    }
    scene.cell.vectors[3] = lean[0]; // of y along x
    scene.cell.vectors[7] = lean[1]; // of z along y
    scene.cell.vectors[6] = lean[2];
    const ContactMap found = by_key(scene, scene.detect()), plain = plain_answer(scene, {9, 5, 3});
    EXPECT_EQ(found.size(), plain.size());
    for (const auto& [key, contact] : plain) ASSERT_TRUE(found.count(key)) << contact.gap;
  }
}

TEST(DetectionEdges, images_in_a_periodic_cell_are_counted_apart_from_contactors) {
  DetectionScene scene(2);
  const std::int64_t first = scene.add(scene.add_body({0.3, 2}), Shape::disk, 0.5, 0),
                     second = scene.add(scene.add_body({3.8, 2}), Shape::disk, 0.5, 0);
  scene.add(scene.add_body({0, 0}), Shape::half_plane, 0, 0, {}, {0, 1, 0});
  InteractionHandler handler;
  EXPECT_EQ(scene.detect(handler).count, 0);
  EXPECT_EQ(handler.counts().owned, 3);
  EXPECT_EQ(handler.counts().ghosts, 0);
  scene.cell.periodic[0] = true;
  scene.cell.vectors[0] = 4;
  const Candidates found = scene.detect(handler);
  EXPECT_EQ(handler.counts().owned, 3);
  EXPECT_EQ(handler.counts().ghosts, 2); // of either disk one, beyond the face that it reaches
  ASSERT_EQ(found.count, 1);             // by their own numbers, across the face
  EXPECT_EQ(found.contactor_a[0], first);
  EXPECT_EQ(found.contactor_b[0], second);
}

TEST(DetectionEdges, a_huge_body_and_its_thousands_of_neighbours_come_in_order) {
  for (bool huge_first : {true, false}) {
    DetectionScene scene(2);
    const int n = 5000;
    if (huge_first) scene.add(scene.add_body({0, 0}), Shape::disk, 1000, 0);
    for (int i = 0; i < n; ++i) {
      const double angle = 6.283185307179586 * ((i * 1913) % n) / n;
      scene.add(scene.add_body({1000.5 * std::cos(angle), 1000.5 * std::sin(angle)}), Shape::disk, 0.6, 0);
    }
    if (!huge_first) scene.add(scene.add_body({0, 0}), Shape::disk, 1000, 0);
    const Candidates found = scene.detect();
    EXPECT_EQ(found.count, n);
    for (std::int64_t i = 1; i < found.count; ++i)
      ASSERT_LT(std::pair(found.contactor_a[i - 1], found.contactor_b[i - 1]),
                std::pair(found.contactor_a[i], found.contactor_b[i]));
  }
}

TEST(DetectionEdges, long_bars_do_not_list_what_they_do_not_touch) {
  const Threads threads(1, 0); // each would bring memory of its own
  std::mt19937_64 random(13);
  DetectionScene scene = random_scene(2, 30000, 0.003, 1.4, random, false);
  InteractionHandler without, with;
  scene.detect(without);
  for (int i = 0; i < 40; ++i)
    scene.add(scene.add_body({0.5, i / 40.}, false), Shape::segment, 1e-3, 0, {}, {0.6, 0.8, 0.5});
  scene.detect(with);
  EXPECT_LT(with.bytes(), 3 * without.bytes());
}

TEST(DetectionEdges, margin_is_one_constant_or_the_sum_of_two) {
  auto scene = two(Shape::disk, Shape::disk, 1, 1, {2.5, 0});
  InteractionHandler handler;
  Candidates found;
  const auto count = [&](const Margin& margin) {
    handler.detect(scene.bodies, scene.contactors, scene.cell, margin, found);
    return found.count;
  };
  EXPECT_EQ(count({0.5, nullptr}), 1);
  EXPECT_EQ(count({std::nextafter(0.5, 0), nullptr}), 0);
  double shares[] = {0.25, 0.25};
  EXPECT_EQ(count({9, shares}), 1);
  shares[1] = 0.2499999;
  EXPECT_EQ(count({9, shares}), 0);
  EXPECT_THROW(count({-1, nullptr}), Error);
  EXPECT_THROW(count({std::nan(""), nullptr}), Error);
}

TEST(DetectionEdges, passes_over_what_cannot_interact) {
  DetectionScene scene(2);
  const auto fixed = scene.add_body({0, 0}, false), also_fixed = scene.add_body({0, 0}, false);
  const auto spins = scene.add_body({0, 0}, false);
  scene.bodies.inverse_mass[spins][2] = 1;
  scene.add(fixed, Shape::disk, 1, 0);
  scene.add(fixed, Shape::disk, 1, 0);
  scene.add(also_fixed, Shape::disk, 1, 0);
  scene.add(also_fixed, Shape::half_plane, 0, 0, {}, {0, 1, 0});
  scene.add(spins, Shape::disk, 1, 0);
  EXPECT_EQ(scene.detect().count, 4); // the body that may spin, with all others
}

TEST(DetectionEdges, rules_keep_materials_apart) {
  DetectionScene scene(2);
  for (std::int32_t material : {0, 1, 2, 0}) {
    const auto i = scene.add(scene.add_body({0.1 * material, 0}), Shape::disk, 1, 0);
    scene.contactors.material.values[i] = material;
  }
  InteractionHandler handler;
  EXPECT_EQ(scene.detect(handler).count, 6);
  LawRules rules(3);
  rules.add(0, 1, false);
  EXPECT_EQ(scene.detect(handler, &rules).count, 4);
  rules.add(1, 0, true);
  EXPECT_EQ(scene.detect(handler, &rules).count, 6);
}

TEST(DetectionEdges, declared_pairs_are_there_whatever_their_gap_and_once) {
  DetectionScene scene(2);
  scene.add(scene.add_body({0, 0}), Shape::disk, 1, 0.01);
  scene.add(scene.add_body({2, 0}), Shape::disk, 1, 0.01);
  scene.add(scene.add_body({9, 0}), Shape::disk, 1, 0.01);
  scene.add(scene.add_body({0, -20}, false), Shape::half_plane, 0, 0, {}, {0, 1, 0});
  InteractionHandler handler;
  EXPECT_EQ(scene.detect(handler).count, 1);
  handler.declared() = {{1, 0}, {2, 0}, {0, 2}, {3, 1}, {0, 77}}; // found too; far; twice; a wall; gone
  const Candidates found = scene.detect(handler);
  const ContactMap map = by_key(scene, found);
  ASSERT_EQ(found.count, 3);
  ASSERT_EQ(map.size(), 3u);
  EXPECT_EQ(map.at({0, 2, 0, own_image}).gap, 7);
  EXPECT_EQ(map.at({1, 3, 0, own_image}).gap, 19);
  EXPECT_EQ(map.at({0, 1, 0, own_image}).gap, 0);

  scene.cell.periodic[0] = true;
  scene.cell.vectors[0] = 10;
  scene.bodies.position[0][0] = 30; // three cells on
  const ContactMap images = by_key(scene, scene.detect(handler));
  EXPECT_EQ(images.size(), 3u);
  EXPECT_NEAR(images.at({0, 2, 0, encode_image(2, 0, 0)}).gap, -1, 1e-14);
  EXPECT_NEAR(images.at({0, 1, 0, encode_image(3, 0, 0)}).gap, 0, 1e-14);

  for (auto& id : scene.contactors.id.values) id *= std::int64_t(1) << 50; // sparse ids
  handler.declared() = {{0, std::int64_t(2) << 50}, {5, 0}};
  EXPECT_EQ(by_key(scene, scene.detect(handler)).count({0, std::int64_t(2) << 50, 0, encode_image(2, 0, 0)}), 1u);

  handler.declared() = {{std::int64_t(3) << 50, std::int64_t(3) << 50}};
  EXPECT_THROW(scene.detect(handler), Error);
}

TEST(DetectionEdges, a_body_is_no_contact_of_itself_through_a_boundary) {
  DetectionScene scene(2);
  scene.add(scene.add_body({0, 0}), Shape::disk, 1, 0);
  scene.cell.periodic[0] = true;
  scene.cell.vectors[0] = 1.9;
  EXPECT_EQ(scene.detect().count, 0);
  scene.add(scene.add_body({1, 0}), Shape::disk, 1, 0); // meets another on both sides, with two keys
  const ContactMap found = by_key(scene, scene.detect());
  EXPECT_EQ(found.size(), 2u);
  EXPECT_NEAR(found.at({0, 1, 0, own_image}).gap, -1, 1e-15);
  EXPECT_NEAR(found.at({0, 1, 0, encode_image(-1, 0, 0)}).gap, 0.9 - 2, 1e-15);
}

TEST(DetectionEdges, images_follow_bodies_that_are_brought_back_and_cells_that_lean_less) {
  const int a[3] = {1, 0, -2}, b[3] = {0, 5, 0};
  const std::int32_t image = encode_image(3, -4, 1);
  EXPECT_EQ(image_after_move(image, a, b), encode_image(4, -9, -1));
  EXPECT_EQ(opposite_image(image), encode_image(-3, 4, -1));
  Cell cell;
  const double vectors[9] = {2, 0, 0, 3, 5, 0, -1, 1, 7};
  std::copy(std::begin(vectors), std::end(vectors), cell.vectors);
  double before[3], after[3];
  image_shift(cell, image, before);
  cell.vectors[3] -= 2 * cell.vectors[0];
  image_shift(cell, image_after_lean(image, 1, 0, 2), after);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(before[k], after[k]);
  cell.velocity_gradient[3] = 0.5; // dv_x/dy
  image_velocity(cell, own_image + 1024, after);
  EXPECT_EQ(after[0], 2.5);
}

TEST(DetectionEdges, bad_input_is_named) {
  for (double bad : {inf, -inf, std::nan("")}) {
    auto scene = two(Shape::disk, Shape::disk, 1, 1, {2, 0});
    scene.bodies.position[1][1] = bad;
    EXPECT_TRUE(says(complaint(scene), "position") && says(complaint(scene), "body 101")) << complaint(scene);
    scene = two(Shape::disk, Shape::disk, 1, 1, {2, 0});
    scene.contactors.radius.values[0] = bad;
    EXPECT_TRUE(says(complaint(scene), "radius") && says(complaint(scene), "body 100")) << complaint(scene);
    scene = two(Shape::sphere, Shape::sphere, 1, 1, {2, 0, 0});
    scene.bodies.rotation[1][2] = bad;
    scene.contactors.offset[1][0] = 1;
    EXPECT_TRUE(says(complaint(scene), "body 101")) << complaint(scene);
  }
  auto scene = two(Shape::disk, Shape::disk, 1, 1, {2, 0});
  scene.cell.periodic[1] = true;
  EXPECT_TRUE(says(complaint(scene), "axis y")) << complaint(scene);
  scene.cell.vectors[4] = 1e-4; // a disk meets 40000 images of the other, which cannot all be numbered
  EXPECT_TRUE(says(complaint(scene), "511 cells")) << complaint(scene);
  scene.cell.vectors[4] = 3;
  EXPECT_EQ(scene.detect().count, 1);
  scene.bodies.position[0][1] = 3 * 512;
  EXPECT_TRUE(says(complaint(scene), "511 cells")) << complaint(scene);
}

TEST(DetectionEdges, scenes_with_little_in_them) {
  InteractionHandler handler;
  DetectionScene scene(2);
  EXPECT_EQ(scene.detect(handler).count, 0);
  scene.add(scene.add_body({0, 0}, false), Shape::half_plane, 0, 0, {}, {0, 1, 0});
  EXPECT_EQ(scene.detect(handler).count, 0);
  scene.add(scene.add_body({0, 0.5}), Shape::disk, 1, 0);
  EXPECT_EQ(scene.detect(handler).count, 1);
  for (int k = 0; k < 1000; ++k) scene.add(scene.add_body({0, 0.5}, false), Shape::half_plane, 0, 0, {}, {0, 1, 0});
  EXPECT_EQ(scene.detect(handler).count, 1001);
}

TEST(SpaceFillingOrder, is_a_permutation_that_steps_to_neighbours) {
  for (int dim : {2, 3}) {
    const int side = dim == 2 ? 64 : 16;
    std::vector<double> x;
    for (int i = 0; i < (dim == 2 ? side * side : side * side * side); ++i) {
      x.push_back(i % side);
      x.push_back(i / side % side);
      if (dim == 3) x.push_back(i / side / side);
    }
    const std::int64_t n = std::int64_t(x.size()) / dim;
    const auto mean_step = [&](const std::vector<std::int32_t>& order) {
      double sum = 0;
      std::int64_t steps = 0;
      for (std::size_t i = 1; i < order.size(); ++i) {
        double d2 = 0;
        for (int k = 0; k < dim; ++k) d2 += std::pow(x[order[i] * dim + k] - x[order[i - 1] * dim + k], 2);
        if (d2 > 1e12) continue; // jumps to and from distant bodies
        sum += std::sqrt(d2);
        ++steps;
      }
      return sum / steps;
    };
    const auto order = space_filling_order(dim, n, x.data());
    auto sorted = order;
    std::sort(sorted.begin(), sorted.end());
    for (std::int64_t i = 0; i < n; ++i) ASSERT_EQ(sorted[i], i);
    EXPECT_LT(mean_step(order), 1.35);

    auto scaled = x;
    for (double& c : scaled) c = std::ldexp(c, -37);
    EXPECT_EQ(order, space_filling_order(dim, n, scaled.data()));

    for (int k = 0; k < 8 * dim; ++k) x.push_back((k % 3 ? 1 : -1) * 1e9 * (1 + k));
    EXPECT_LT(mean_step(space_filling_order(dim, n + 8, x.data())), 1.35);
  }
  const double one[] = {3, 4, 3, 4};
  EXPECT_EQ(space_filling_order(2, 2, one), (std::vector<std::int32_t>{0, 1}));
}
