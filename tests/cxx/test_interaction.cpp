// Interactions against plain mechanics: velocities are what the impulses give, impulses obey their laws.
#include <gtest/gtest.h>

#include <limits>

#include "cairn/core.h"
#include "contact_scene.hpp"

namespace cairn::test {
namespace {

class Heap : public testing::TestWithParam<int> {};

TEST_P(Heap, ObeysTheLaw) {
  const int dim = GetParam();
  ContactScene s = heap(dim, dim == 2 ? 20 : 8);
  Interactions i(dim);
  const SolveReport report = s.step(i, coulomb(0.4), {1e-11, 1, 20000, 1});
  const Solution x = read(i, dim);
  EXPECT_EQ(report.status, SolveStatus::converged) << report.hint;
  EXPECT_LT(report.error, 1e-11);
  EXPECT_LT(velocity_defect(s, x), 1e-13);
  EXPECT_LT(law_defect(s, x, 0.4), 1e-8);
  EXPECT_GT(law_defect(s, x, 0.3), 1e-3); // the check can fail
  int open = 0, stick = 0, slip = 0;
  for (auto st : x.status) ++(st == cairn_open ? open : st == cairn_stick ? stick : slip);
  EXPECT_GT(open, 0);
  EXPECT_GT(stick, 0);
  EXPECT_GT(slip, 0);
}

INSTANTIATE_TEST_SUITE_P(Interactions, Heap, testing::Values(2, 3));

// Bodies of two round contactors each, off their centres, some of their directions blocked; in 3D with full inverse
// inertias.
ContactScene clumps(int dim) {
  ContactScene s = heap(dim, dim == 2 ? 14 : 6);
  const std::int64_t round = s.bodies.count - 1;
  s.contactors.offset.activate(s.contactors.count);
  s.bodies.inverse_inertia.components = 6;
  if (dim == 3) s.bodies.inverse_inertia.activate(s.bodies.count);
  for (std::int64_t b = 0; b < round; ++b) {
    for (int k = 0; k < dim; ++k) s.contactors.offset[b][k] = s.uniform(-0.04, 0.04);
    double* m = s.bodies.inverse_mass[b];
    if (b % 7 == 0) m[0] = 0;
    if (b % 11 == 0) m[s.bodies.dofs() - 1] = 0;
    if (dim == 3) {
      double* j = s.bodies.inverse_inertia[b];
      for (int k = 0; k < 3; ++k) j[k] = m[3 + k] * s.uniform(0.7, 1.3);
      if (m[5] > 0)
        for (int k = 3; k < 6; ++k) j[k] = 0.2 * m[3] * s.uniform(-1, 1);
    }
  }
  for (std::int64_t b = 0; b + 1 < round; b += 2) s.contactors.body.values[b + 1] = s.contactors.body.values[b];
  for (std::int64_t b = 0; b + 1 < round; b += 2)
    for (int k = 0; k < dim; ++k)
      s.contactors.offset[b + 1][k] += s.bodies.position[b + 1][k] - s.bodies.position[b][k];
  s.candidates = Candidates();
  s.detect_round(0.1);
  s.detect_floor(std::int32_t(round), 0.1);
  return s;
}

class Clumps : public testing::TestWithParam<int> {};

TEST_P(Clumps, ObeyTheLaw) {
  const int dim = GetParam();
  ContactScene s = clumps(dim);
  Interactions i(dim);
  const SolveReport report = s.step(i, coulomb(0.4), {1e-11, 1, 50000, 1});
  const Solution x = read(i, dim);
  EXPECT_EQ(report.status, SolveStatus::converged) << report.hint;
  EXPECT_LT(velocity_defect(s, x), 1e-12);
  EXPECT_LT(law_defect(s, x, 0.4), 1e-8);
}
INSTANTIATE_TEST_SUITE_P(Interactions, Clumps, testing::Values(2, 3));

// Energy taken by contacts is what the bodies lose beside the work of the free motion.
TEST_P(Heap, EnergyIsWhatBodiesLose) {
  const int dim = GetParam();
  ContactScene s = heap(dim, dim == 2 ? 15 : 6);
  Interactions i(dim);
  s.step(i, coulomb(0.4), {1e-8, 1, 20000, 1});
  const ContactEnergy energy = i.commit();
  const Solution x = read(i, dim);
  double lost = 0, per_contact = 0, size = 0;
  for (std::int64_t b = 0; b < s.bodies.count; ++b)
    for (int k = 0; k < s.bodies.dofs(); ++k) {
      const double m = s.bodies.inverse_mass[b][k], v0 = s.bodies.velocity_begin[b][k], v1 = s.bodies.velocity[b][k];
      if (m > 0) lost -= (v1 - s.bodies.velocity_free[b][k]) / m * (v0 + v1) / 2;
      if (m > 0) size += v0 * v0 / m;
    }
  for (double d : x.dissipated) per_contact += d;
  EXPECT_NEAR(energy.normal + energy.tangential, lost, 1e-13 * size);
  EXPECT_NEAR(per_contact, lost, 1e-13 * size);
  EXPECT_GT(energy.normal, 0);
  double created = 0, turned = 0;
  for (double d : x.dissipated) created += std::max(0.0, -d), turned += std::abs(d);
  EXPECT_NEAR(energy.created, created, 1e-14 * turned);
  EXPECT_NEAR(energy.turned_over, turned, 1e-14 * turned);
  EXPECT_GT(energy.tangential, 0);
}

// A disk and a wall under every law of the list.
struct Drop {
  explicit Drop(double gap, double vx, double vy) : s(2) {
    const std::int32_t b = s.add_body({0, 1 + gap}, 0.5, 1.0), w = s.add_body({0, 0}, 0, 0);
    const std::int32_t disk = s.add_contactor(b, Shape::disk, 1), wall = s.add_contactor(w, Shape::half_plane, 0);
    s.bodies.velocity[b][0] = s.bodies.velocity_free[b][0] = vx;
    s.bodies.velocity[b][1] = s.bodies.velocity_free[b][1] = vy;
    s.bodies.velocity[b][2] = s.bodies.velocity_free[b][2] = 0;
    s.detect_floor(wall, 1);
    EXPECT_EQ(s.candidates.contactor_a[0], disk);
  }
  const double* solve(Law law, std::vector<double> params) {
    LawTable laws({"rock"});
    laws.set(0, 0, law, params);
    report = s.step(i, laws, {1e-12, 1, 100, 1});
    return s.bodies.velocity[0];
  }
  ContactScene s;
  Interactions i{2};
  SolveReport report;
};

TEST(OneDisk, BouncesAsItsLawSays) {
  EXPECT_DOUBLE_EQ(Drop(0, 0, -3).solve(Law::newton_restitution, {0, 0.5, 0, 1})[1], 1.5);
  EXPECT_DOUBLE_EQ(Drop(0, 0, -3).solve(Law::signorini_coulomb, {0.3})[1], 0);
  EXPECT_DOUBLE_EQ(Drop(0.01, 0, -3).solve(Law::signorini_coulomb, {0.3})[1], -1) << "reaches the wall, no further";
  EXPECT_DOUBLE_EQ(Drop(0.01, 0, -3).solve(Law::newton_restitution, {0.3, 1, 0, 1})[1], -3) << "not touching: open";
  EXPECT_DOUBLE_EQ(Drop(0.01, 0, -3).solve(Law::newton_restitution, {0.3, 0, 0, 1})[1], -1) << "nothing would rebound";
  EXPECT_DOUBLE_EQ(Drop(0.01, 0, -3).solve(Law::newton_restitution, {0.3, 0, 0, 0})[1], -3) << "as in LMGC90";
  EXPECT_DOUBLE_EQ(Drop(-0.01, 0, -3).solve(Law::signorini_coulomb, {0.3})[1], 0) << "overlap is not thrown out";
  EXPECT_DOUBLE_EQ(Drop(-0.01, 0, -3).solve(Law::gap_coulomb, {0.3})[1], 1) << "overlap is pushed back";
}

// h c = 2 N s/m: an impulse gives way by half its size.
void give_way(std::int32_t n, std::int32_t c, const cairn_law_context*, const double*, const double*, const double*,
              double*, double* bias, double* compliance, double* mu) {
  std::fill_n(bias, n * c, 0.0);
  std::fill_n(compliance, n * c, 0.0);
  std::fill_n(compliance, n, 0.5);
  std::fill_n(mu, n, 0.0);
}

// Compliance of a row of the list, not of a law from a library. The mass is 2: r = 2 (v_free - v) = -2 v.
TEST(OneDisk, SinksWhereItsLawHasACompliance) {
  LawInfo law;
  law.name = law.python_name = "gives_way_in_a_test";
  law.components2 = 2;
  law.has_prepare = law.yields = true;
  law.prepare = give_way;
  const Law row = register_law(law, true);
  Drop sinks(0, 2, -3);
  const double* v = sinks.solve(row, {});
  EXPECT_DOUBLE_EQ(v[1], -1.5);
  EXPECT_DOUBLE_EQ(v[0], 2);
  EXPECT_EQ(sinks.report.status, SolveStatus::converged);
  // on a disk that moves as well: 1/2 + 1/2 between bodies, 1/2 of the law
  Drop hits(0, 0, -3);
  hits.s.candidates = Candidates();
  const std::int32_t other = hits.s.add_body({0, -1}, 0.5, 1.0);
  hits.s.add_contactor(other, Shape::disk, 1);
  std::fill_n(hits.s.bodies.velocity[other], 3, 0.0);
  std::fill_n(hits.s.bodies.velocity_free[other], 3, 0.0);
  hits.s.detect_round(1);
  ASSERT_EQ(hits.s.candidates.count, 1);
  EXPECT_DOUBLE_EQ(hits.solve(row, {})[1], -2);
  EXPECT_DOUBLE_EQ(hits.s.bodies.velocity[other][1], -1);
}

TEST(OneDisk, RubsAsItsLawSays) {
  Drop slides(0, 2, -3);
  EXPECT_EQ(slides.solve(Law::frictionless, {})[0], 2);
  // sliding: impulse mu 2 3 on a mass 2
  EXPECT_DOUBLE_EQ(Drop(0, 2, -3).solve(Law::signorini_coulomb, {0.1})[0], 2 - 0.1 * 3);
  // rolling: v + w r = 0 at the contact
  Drop rolls(0, 2, -3);
  const double* v = rolls.solve(Law::signorini_coulomb, {std::numeric_limits<double>::infinity()});
  EXPECT_NEAR(v[0] + v[2], 0, 1e-15);
  EXPECT_DOUBLE_EQ(v[0], 2 * 2.0 / 3);
  std::int32_t status = -1;
  rolls.i.views().status(&status);
  EXPECT_EQ(status, cairn_stick);
}

TEST(OneDisk, BondHoldsThreeDirections) {
  Drop bonds(-0.001, 2, 1);
  const double* v = bonds.solve(Law::bonded, {0.5});
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(v[k], 0, 1e-14);
  bonds.i.commit();
  ASSERT_EQ(bonds.i.kept().size(), 1u);
  // it pulled apart meanwhile, and is drawn back
  bonds.s.candidates.gap[0] = 0.004;
  EXPECT_NEAR(bonds.solve(Law::bonded, {0.5})[1], -0.5, 1e-13);
  Drop free(0.001, 2, 1);
  EXPECT_DOUBLE_EQ(free.solve(Law::bonded, {0.5})[1], 1) << "did not touch when first seen";
  free.i.commit();
  free.s.candidates.gap[0] = -0.001;
  EXPECT_DOUBLE_EQ(free.solve(Law::bonded, {0.5})[1], 1) << "touches later: no bond";
}

TEST(Materials, WithoutALawAreNamed) {
  ContactScene s = heap(2, 3);
  LawTable laws({"rock", "steel"});
  laws.set(1, 1, Law::frictionless, {});
  Interactions i(2);
  try {
    i.assemble(s.bodies, s.contactors, s.candidates, laws, s.cell, s.h, s.theta);
    FAIL();
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("'rock' and 'rock'"), std::string::npos) << e.what();
  }
}

// A sheared cell: two disks that move with it do not rub, two that do not are dragged by their images.
TEST(PeriodicCell, ImagesLendTheirVelocity) {
  ContactScene s(2);
  s.cell.periodic[0] = s.cell.periodic[1] = true;
  s.cell.vectors[0] = 10, s.cell.vectors[4] = 2, s.cell.vectors[8] = 1;
  s.cell.velocity_gradient[3] = 0.5; // dvx/dy
  const std::int32_t b = s.add_body({5, 1}, 1, 2);
  s.add_contactor(b, Shape::disk, 1);
  const std::int32_t c = s.add_body({5, 1}, 1, 2);
  s.add_contactor(c, Shape::disk, 1);
  for (std::int32_t k : {b, c})
    std::fill_n(s.bodies.velocity[k], 3, 0.0), std::fill_n(s.bodies.velocity_free[k], 3, 0.0);
  s.add_candidate(0, 1, 0, {0, -1}, {5, 2});
  s.candidates.image[0] = encode_image(0, 1, 0);
  s.bodies.velocity_free[b][1] = 1; // pressed on the image above, which moves to the right
  Interactions i(2);
  s.step(i, coulomb(10), {1e-12, 1, 100, 1});
  double r[2], u[2];
  i.views().impulse_space(r);
  i.views().relative_velocity(u);
  EXPECT_DOUBLE_EQ(r[1], -0.5);
  EXPECT_GT(r[0], 0);
  EXPECT_NEAR(u[1], 0, 1e-15);
  const ContactEnergy energy = i.commit();
  EXPECT_NEAR(energy.jump_work, r[0] * 1.0, 1e-15);
}

} // namespace
} // namespace cairn::test
