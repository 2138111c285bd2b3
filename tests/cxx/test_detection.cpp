// Detection against the plain answer, on random scenes of all shapes.
#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <cstring>

#include "base/call.hpp"
#include "detection_scene.hpp"

using namespace cairn;
using namespace cairn::test;

namespace {

// Same keys, but for contacts that lie on the edge of the margin; same gaps, normals and points to `tolerance` times
// `size`.
void expect_plain_answer(const DetectionScene& scene, const Candidates& found, const std::array<std::int32_t, 3>& span,
                         double size, double tolerance = 1e-14) {
  const ContactMap got = by_key(scene, found);
  ASSERT_EQ(std::int64_t(got.size()), found.count) << "a contact stands twice";
  const ContactMap most = plain_answer(scene, span, tolerance * size),
                   least = plain_answer(scene, span, -tolerance * size);
  for (const auto& [key, contact] : least)
    ASSERT_TRUE(got.count(key)) << key.contactor_a << " " << key.contactor_b << " " << key.image << " gap "
                                << contact.gap;
  for (const auto& [key, contact] : got) {
    const auto plain = most.find(key);
    ASSERT_NE(plain, most.end()) << key.contactor_a << " " << key.contactor_b << " " << key.image << " " << contact.gap;
    ASSERT_NEAR(contact.gap, plain->second.gap, tolerance * size);
    // a normal is as exact as its foot is far away
    const ContactKey k = key;
    double room = 0;
    for (std::int64_t i = 0; i < scene.contactors.count; ++i)
      if (scene.contactors.id.values[i] == k.contactor_a) room = scene.contactors.radius.values[i];
    room = std::max(room + contact.gap, 1e-6 * size);
    for (int i = 0; i < scene.dim; ++i) {
      ASSERT_NEAR(contact.normal[i], plain->second.normal[i], tolerance * size / room) << "radius " << room;
      ASSERT_NEAR(contact.point[i], plain->second.point[i], 10 * tolerance * size);
    }
  }
}

void expect_canonical(const DetectionScene& scene, const Candidates& found) {
  const auto rank = [&](std::int64_t i) {
    const auto& c = scene.contactors;
    const auto b = Shape(c.shape.values[found.contactor_b[i]]);
    return std::tuple(int(b), found.contactor_a[i], found.contactor_b[i], found.image[i]);
  };
  for (std::int64_t i = 1; i < found.count; ++i) ASSERT_LT(rank(i - 1), rank(i)) << i;
}

bool same_bits(const Candidates& a, const Candidates& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof x[0]) == 0;
  };
  return a.count == b.count && same(a.contactor_a, b.contactor_a) && same(a.contactor_b, b.contactor_b) &&
         same(a.image, b.image) && same(a.feature, b.feature) && same(a.gap, b.gap) && same(a.normal, b.normal) &&
         same(a.point, b.point);
}

struct Threads {
  int before = omp_get_max_threads();
  explicit Threads(int n) { omp_set_num_threads(n); }
  ~Threads() { omp_set_num_threads(before); }
};

} // namespace

TEST(Detection, finds_what_the_plain_way_finds) {
  std::mt19937_64 random(7);
  InteractionHandler handler; // kept, so that remains of a scene meet the next
  for (int dim : {2, 3})
    for (double ratio : {1.0, 1.4, 30.0, 1000.0})
      for (int repeat = 0; repeat < 6; ++repeat) {
        const auto scene = random_scene(dim, 30 + 40 * repeat, dim == 2 ? 0.1 : 0.15, ratio, random);
        const Candidates found = scene.detect(handler);
        EXPECT_GT(found.count, 5);
        expect_plain_answer(scene, found, {0, 0, 0}, 4);
        expect_canonical(scene, found);
        if (HasFatalFailure()) return;
      }
}

TEST(Detection, finds_all_images_in_a_periodic_cell) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> u(-1, 1);
  InteractionHandler handler;
  for (int dim : {2, 3})
    for (int repeat = 0; repeat < 16; ++repeat) {
      auto scene = random_scene(dim, dim == 2 || repeat < 12 ? 40 : 20, 0.1 + 0.05 * (repeat % 4),
                                repeat % 2 ? 100 : 1.2, random, false);
      const double side = repeat < 12 ? 1.0 : 0.45; // in a small cell one contactor meets several images of another
      for (int k = 0; k < dim; ++k) {
        scene.cell.periodic[k] = (repeat + 1) & (1 << k) || k == repeat % dim;
        if (!scene.cell.periodic[k]) continue;
        for (int i = 0; i < k; ++i) scene.cell.vectors[i + 3 * k] = repeat < 4 ? 0 : side * u(random);
        scene.cell.vectors[k + 3 * k] = side * (1 + 0.1 * u(random));
        scene.cell.corner[k] = u(random);
      }
      for (auto& x : scene.bodies.position.values) x = (repeat < 12 ? 3 : 1.2) * x - 0.3; // not all in the cell
      std::array<std::int32_t, 3> span{0, 0, 0};
      for (int k = 0; k < dim; ++k)
        if (scene.cell.periodic[k]) span[k] = repeat < 12 ? 6 : 9;
      const Candidates found = scene.detect(handler);
      expect_plain_answer(scene, found, span, 20);
      expect_canonical(scene, found);
      if (HasFatalFailure()) return;
    }
}

TEST(Detection, does_not_depend_on_threads_or_earlier_calls) {
  std::mt19937_64 random(9);
  for (int dim : {2, 3})
    for (bool periodic : {false, true}) {
      auto scene = random_scene(dim, 30000, dim == 2 ? 0.01 : 0.03, 20, random, !periodic);
      if (periodic)
        for (int k = 0; k < dim; ++k) {
          scene.cell.periodic[k] = true;
          scene.cell.vectors[4 * k] = 1;
          if (k == 1) scene.cell.vectors[3] = 0.3;
        }
      Candidates one;
      {
        Threads threads(1);
        one = scene.detect();
      }
      EXPECT_GT(one.count, 10000);
      InteractionHandler kept;
      for (int n : {2, 4, 7, 2}) {
        Threads threads(n);
        EXPECT_TRUE(same_bits(one, scene.detect(kept))) << n << " threads";
      }
    }
}

TEST(Detection, keeps_its_bits_when_units_change_by_powers_of_two) {
  std::mt19937_64 random(10);
  for (int dim : {2, 3})
    for (bool periodic : {false, true}) {
      const auto scene = [&] {
        auto s = random_scene(dim, 300, 0.1, 50, random, !periodic);
        if (periodic)
          for (int k = 0; k < dim; ++k) {
            s.cell.periodic[k] = true;
            s.cell.vectors[4 * k] = 1;
          }
        return s;
      }();
      const Candidates first = scene.detect();
      for (int power : {-400, -100, -1, 1, 30, 400}) {
        auto scaled = scene;
        scaled.scale(std::ldexp(1.0, power));
        Candidates found = scaled.detect();
        for (auto* array : {&found.gap, &found.point})
          for (double& x : *array) x = std::ldexp(x, -power);
        EXPECT_TRUE(same_bits(first, found)) << "2^" << power;
      }
    }
}

TEST(Detection, keys_and_gaps_do_not_depend_on_internal_order) {
  std::mt19937_64 random(11);
  for (int dim : {2, 3}) {
    auto scene = random_scene(dim, 500, 0.08, 30, random);
    for (int k = 0; k < dim; ++k) scene.cell.vectors[4 * k] = 1;
    const ContactMap first = by_key(scene, scene.detect());
    scene.shuffle(random);
    const Candidates found = scene.detect();
    const ContactMap second = by_key(scene, found);
    expect_canonical(scene, found);
    ASSERT_EQ(first.size(), second.size());
    for (const auto& [key, contact] : first) {
      ASSERT_TRUE(second.count(key));
      EXPECT_EQ(contact.gap, second.at(key).gap);
      EXPECT_EQ(0, std::memcmp(contact.normal, second.at(key).normal, sizeof contact.normal));
    }
  }
}
