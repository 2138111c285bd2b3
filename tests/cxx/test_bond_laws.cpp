// Bonds, rods, attractions, rolling friction and wear on one contact, against closed forms.
#include "one_contact.hpp"

namespace cairn {
namespace {

using test::OneContact;

// Between -tension and the cone a bond holds whatever pulls; a touch more and it is gone.
TEST(MohrCoulomb, HoldsToItsLimits) {
  const OneContact::Values values = {{"tension", 1e5}, {"cohesion", 2e5}, {"friction", 0.5}, {"mu", 0.3}, {"cap", 1e6}};
  struct Pull {
    double normal, tangent; // stresses that the bodies would have to be held against
    bool holds;
  };
  for (const Pull& pull : {Pull{0.99e5, 0, true}, Pull{1.01e5, 0, false}, Pull{0, 1.99e5, true}, Pull{0, 2.01e5, false},
                           Pull{-2e5, 2.99e5, true}, Pull{-2e5, 3.01e5, false}, Pull{0.5e5, 1.74e5, true},
                           Pull{0.5e5, 1.76e5, false}, Pull{-0.99e6, 0, true}, Pull{-1.01e6, 0, false}})
    for (int dim : {2, 3}) {
      OneContact one("MohrCoulomb", values, dim);
      const double impulse = one.area * one.h;
      const std::vector<double> free = {pull.normal * impulse, 0.6 * pull.tangent * impulse * (dim == 3 ? 1 : 1 / 0.6),
                                        0.8 * pull.tangent * impulse};
      one.advance(free);
      EXPECT_EQ(one.state[0] > 0, pull.holds) << pull.normal << " " << pull.tangent;
      EXPECT_LE(one.residual, 1e-13 * 1e6 * impulse);
      if (!pull.holds) continue;
      EXPECT_NEAR(one.r[0], -pull.normal * impulse, 1e-12 * 1e6 * impulse);
      for (int k = 0; k < dim; ++k) EXPECT_NEAR(one.u[k], 0, 1e-12 * 1e6 * impulse);
    }
}

TEST(MohrCoulomb, BrokenIsCoulombForGood) {
  OneContact one("MohrCoulomb", {{"tension", 1e5}, {"cohesion", 2e5}, {"mu", 0.3}});
  one.advance({1, 0});
  one.advance({-1, 0});
  one.advance({0.5, 0});
  EXPECT_EQ(one.r[0], 0);
  std::fill_n(one.gap, 8, 0);
  one.advance({-1, 10});
  EXPECT_DOUBLE_EQ(one.r[0], 1);
  EXPECT_DOUBLE_EQ(one.r[1], -0.3);
}

// Pressure beyond the threshold makes a bond once its integral over time reaches the dose; a broken bond forms anew.
TEST(Sintering, MakesABondByPressureAndTime) {
  for (int dim : {2, 3}) {
    const double h = 1e-3;
    OneContact one(
        "Sintering",
        {{"tension", 1e5}, {"cohesion", 2e5}, {"friction", 0.5}, {"mu", 0.3}, {"pressure", 1e5}, {"dose", 2.5e5 * h}},
        dim, h, 0);
    const double impulse = one.area * h;
    for (int round = 0; round < 2; ++round) {
      one.advance({-0.9e5 * impulse, 0, 0}); // below the threshold
      for (int k = 0; k < 3; ++k) {
        EXPECT_FALSE(one.state[0] > 0) << k;
        one.advance({-2e5 * impulse, 0, 0}); // 1e5 h beyond it
        EXPECT_NEAR(one.r[0], 2e5 * impulse, 1e-12 * 1e6 * impulse);
      }
      EXPECT_TRUE(one.state[0] > 0);
      one.advance({0.99e5 * impulse, 0, 0});
      EXPECT_NEAR(one.u[0], 0, 1e-12 * 1e6 * impulse);
      one.advance({0, 1.99e5 * impulse, 0});
      EXPECT_NEAR(one.u[1], 0, 1e-12 * 1e6 * impulse);
      EXPECT_LE(one.residual, 1e-13 * 1e6 * impulse);
      EXPECT_TRUE(one.state[0] > 0);
      one.advance({1.01e5 * impulse, 0, 0});
      EXPECT_FALSE(one.state[0] > 0);
      std::fill_n(one.gap, 8, 0);
    }
    one.advance({0.5 * impulse, 0, 0});
    EXPECT_EQ(one.r[0], 0) << "loose";
    EXPECT_EQ(one.stored, 0);
  }
}

// Within reach a constant force, the cone shifted by it; F times the reach to part.
TEST(Wet, DrawsWithinItsReach) {
  for (int dim : {2, 3}) {
    OneContact one("Wet", {{"force", 10}, {"reach", 1e-3}, {"mu", 0.5}}, dim, 1e-4, 0);
    one.advance({0.9e-3, 0, 0}); // 9 N pull it apart
    EXPECT_NEAR(one.u[0], 0, 1e-15);
    one.advance({0, 0.49e-3 * 1.0, 0}); // no load: mu F holds 5 N
    EXPECT_NEAR(one.u[1], 0, 1e-15);
    one.advance({0, 0.6e-3, 0});
    EXPECT_NEAR(one.u[1], 0.1e-3, 1e-15);
    one.advance({1.5e-3, 0, 0}); // 15 N: leaves with 5
    EXPECT_NEAR(one.u[0], 0.5e-3, 1e-15);
    EXPECT_LE(one.residual, 1e-16);
    // launched: v^2 loses 2 F reach/m
    OneContact flies("Wet", {{"force", 10}, {"reach", 1e-3}}, dim, 1e-6, 0);
    double v = 0.2;
    while (flies.gap[0] < 1.2e-3) flies.advance({v, 0, 0}), v = flies.u[0];
    EXPECT_NEAR(v, std::sqrt(0.04 - 2 * 10 * 1e-3), 2e-4);
    EXPECT_NEAR(flies.taken, 10e-3, 1e-4 * 10e-3);
    EXPECT_EQ(flies.stored, 0);
  }
}

TEST(Rolling, LimitsEachMomentByTheNormalImpulse) {
  OneContact plane("Rolling", {{"mu", 0.4}, {"rolling", 0.1}}, 2);
  plane.radius = 0.5;
  plane.advance({-2, 0.1, 0.05}); // M <= 0.1 x 0.5 x 2
  EXPECT_NEAR(plane.r[0], 2, 1e-14);
  EXPECT_NEAR(plane.u[2], 0, 1e-15);
  plane.advance({-2, 5, 1});
  EXPECT_NEAR(plane.r[1], -0.8, 1e-14);
  EXPECT_NEAR(plane.r[2], -0.1, 1e-14);
  EXPECT_LE(plane.residual, 1e-14);
  OneContact space("Rolling", {{"mu", 0.4}, {"rolling", 0.1}, {"twisting", 0.2}}, 3);
  space.radius = 0.5;
  space.advance({-2, 3, 4, 7, 0.6, 0.8});
  EXPECT_NEAR(space.r[1], -0.8 * 0.6, 1e-14);
  EXPECT_NEAR(space.r[2], -0.8 * 0.8, 1e-14);
  EXPECT_NEAR(space.r[3], -0.2, 1e-14);
  EXPECT_NEAR(space.r[4], -0.06, 1e-14);
  EXPECT_NEAR(space.r[5], -0.08, 1e-14);
  EXPECT_LE(space.residual, 1e-14);
}

// About t it rolls by 0.5, about s by 2: of moments in the ellipse with these axes the one of most power acts.
TEST(Rolling, BearsMomentsByTheRadiiOfItsSurfaces) {
  OneContact space("Rolling", {{"mu", 0.4}, {"rolling", 0.1}}, 3);
  space.radius = 0.5;
  space.across = 2;
  space.advance({-2, 0, 0, 0, 3, 4});
  const double t = 0.5 * space.u[4], s = 2 * space.u[5], size = std::hypot(t, s);
  EXPECT_GT(size, 1);
  EXPECT_NEAR(space.r[4], -0.2 * 0.5 * t / size, 1e-13);
  EXPECT_NEAR(space.r[5], -0.2 * 2 * s / size, 1e-13);
  EXPECT_LE(space.residual, 1e-13);
  space.advance({-2, 0, 0, 0, 0.02, 0.3}); // held about both
  EXPECT_NEAR(space.u[4], 0, 1e-14);
  EXPECT_NEAR(space.u[5], 0, 1e-14);
}

// Springs of a disk of radius b: k A, k pi b^4/4 for bending, k pi b^4/2 for twist; strength at its rim.
TEST(ParallelBond, HasTheSpringsOfADisk) {
  const double kn = 1e9, kt = 4e8, b = 0.5, pi = std::acos(-1.0);
  const double k[6] = {kn * pi * b * b,
                       kt * pi * b * b,
                       kt * pi * b * b,
                       kt * pi * b * b * b * b / 2,
                       kn * pi * b * b * b * b / 4,
                       kn * pi * b * b * b * b / 4};
  for (int which = 0; which < 6; ++which) {
    OneContact one("ParallelBond", {{"normal_stiffness", kn}, {"tangential_stiffness", kt}, {"radius", 0.25}}, 3);
    for (double& w : one.w) w = 1e-9 / (one.h * one.h * k[0]);
    std::vector<double> free(6, 0.0);
    free[which] = 0.1;
    for (int step = 0; step < 100; ++step) one.advance(free);
    const double far = 0.1 * 100 * one.h;
    EXPECT_NEAR(one.r[which], -k[which] * far * one.h, 1e-6 * k[which] * far * one.h) << which;
    EXPECT_NEAR(one.stored, k[which] * far * far / 2, 1e-6 * k[which] * far * far) << which;
    EXPECT_NEAR(one.taken, one.stored, 1e-12 * one.stored);
    EXPECT_LE(one.residual, 1e-9 * k[which] * far * one.h);
  }
  // opened by 0.1 m/s and 0.1 rad/s of these components, until it breaks [m]
  const auto break_at = [&](int dim, const std::vector<int>& which, const OneContact::Values& strength) {
    OneContact::Values all = {{"normal_stiffness", kn}, {"tangential_stiffness", kt}, {"radius", 0.25}};
    all.insert(strength.begin(), strength.end());
    OneContact one("ParallelBond", all, dim);
    for (double& w : one.w) w = 1e-9 / (one.h * one.h * k[0]);
    std::vector<double> free(6, 0.0);
    for (int l : which) free[l] = 0.1;
    int step = 0;
    while (one.state[0] > 0 && step < 100000) one.advance(free), ++step;
    EXPECT_NEAR(one.released, one.taken, 1e-12 * one.taken);
    return step * 0.1 * one.h;
  };
  EXPECT_NEAR(break_at(3, {0}, {{"tension", 1e6}}), 1e6 / kn, 2e-6);
  EXPECT_NEAR(break_at(3, {1}, {{"shear", 1e6}}), 1e6 / kt, 2e-6);
  EXPECT_NEAR(break_at(3, {3}, {{"shear", 1e6}}), 1e6 / kt / b, 2e-6);
  EXPECT_NEAR(break_at(3, {5}, {{"tension", 1e6}}), 1e6 / kn / b, 2e-6);
  // together, at the rim: what opens and bends, about both axes, what slides and twists
  EXPECT_NEAR(break_at(3, {0, 5}, {{"tension", 1e6}}), 1e6 / kn / (1 + b), 2e-6);
  EXPECT_NEAR(break_at(3, {4, 5}, {{"tension", 1e6}}), 1e6 / kn / (std::sqrt(2.0) * b), 2e-6);
  EXPECT_NEAR(break_at(3, {1, 2, 3}, {{"shear", 1e6}}), 1e6 / kt / (std::sqrt(2.0) + b), 2e-6);
  EXPECT_NEAR(break_at(2, {0, 2}, {{"tension", 1e6}}), 1e6 / kn / (1 + b), 2e-6);
  EXPECT_NEAR(break_at(2, {0, 1}, {{"tension", 2e6}, {"shear", 1e6}}), 2e6 / kn, 2e-6);
}

// m x'' = -E A/L x - eta/L x': period and decrement of an oscillator; a wire lets go where it is slack.
TEST(Rods, SwingAndPull) {
  for (const double viscosity : {0.0, 2.0}) {
    OneContact one("Rod", {{"stiffness", 1e3}, {"viscosity", viscosity}, {"within", 1}}, 2, 1e-5);
    std::fill_n(one.gap, 8, 0.5); // E A/L = 2000, eta/L = 4, m = 1
    double v = 1, energy = 0;
    const double omega = std::sqrt(2000 - viscosity * viscosity * 4 / 4);
    const int half = int(std::acos(-1.0) / omega / one.h);
    for (int k = 0; k < half; ++k) one.advance({v, 0}), v = one.u[0], energy = std::max(energy, one.stored);
    EXPECT_NEAR(v, -std::exp(-2 * viscosity / 2 * half * one.h), 2e-3);
    EXPECT_NEAR(one.gap[0], 0.5, 2e-4);
    if (viscosity > 0) continue;
    EXPECT_NEAR(energy, 0.5, 5e-3);
  }
  OneContact wire("Wire", {{"stiffness", 1e3}, {"within", 1}, {"strength", 100}}, 2, 1e-5);
  std::fill_n(wire.gap, 8, 0.5);
  wire.advance({-1, 0});
  EXPECT_EQ(wire.r[0], 0); // slack
  double v = 3;
  while (wire.state[0] > 0 && wire.gap[0] < 1) wire.advance({v, 0}), v = wire.u[0];
  EXPECT_NEAR(wire.gap[0], 0.5 + 100.0 / 2000, 1e-4); // broke at 100 N
  EXPECT_NEAR(wire.released, 100.0 * 100 / 2000 / 2, 1e-2);
  OneContact rigid("Wire", {{"within", 1}}, 2, 1e-5);
  std::fill_n(rigid.gap, 8, 0.5);
  rigid.advance({3, 1});
  EXPECT_NEAR(rigid.u[0], 0, 1e-12);
  EXPECT_EQ(rigid.r[1], 0);
  EXPECT_LE(rigid.residual, 1e-12);
}

// F = 4 pi R g cos t (1 - D/sqrt(D^2 + V/(pi R))); it ends at (1 + t/2) V^(1/3).
TEST(Capillary, DrawsAndEnds) {
  const double R = 1e-3, g = 0.072, V = 1e-11, t = 0.3, pi = std::acos(-1.0);
  OneContact one("Capillary", {{"tension", g}, {"volume", V}, {"angle", t}}, 3, 1e-6);
  one.radius = R;
  const double top = 4 * pi * R * g * std::cos(t), length = (1 + t / 2) * std::cbrt(V);
  double far = 0;
  while (one.state[0] > 0) {
    const double D = one.gap[0];
    one.w[0] = 1e-9;
    one.advance({0.01, 0, 0});
    ASSERT_NEAR(-one.r[0] / one.h, top * (1 - D / std::sqrt(D * D + V / (pi * R))), 1e-9 * top);
    far = one.gap[0];
  }
  EXPECT_NEAR(far, length, 1e-6 * 0.02 + 1e-8);
  const double well = top * (std::sqrt(length * length + V / (pi * R)) - length - std::sqrt(V / (pi * R)));
  EXPECT_NEAR(one.taken, -well, 1e-3 * std::abs(well));
  EXPECT_NEAR(one.work, one.taken, 2e-2 * one.taken * 1e0 + 1e-12);
  one.advance({0.01, 0, 0});
  EXPECT_EQ(one.r[0], 0);
}

// Archard: depth k F s/A.
TEST(Wear, GrowsWithForceAndWay) {
  OneContact one("Wear", {{"mu", 0.2}, {"wear", 1e-9}}, 2, 1e-3, 0);
  for (int k = 0; k < 1000; ++k) one.advance({-5e-3, 0.5 + 0.2 * 5e-3}); // 5 N, 0.5 m/s
  EXPECT_NEAR(one.state[8], 1e-9 * 5 * 0.5, 1e-2 * 1e-9 * 5 * 0.5);      // its gap gives way as it wears
  EXPECT_NEAR(one.state[0], one.state[8] / one.area, 1e-12 * one.state[0]);
}

} // namespace
} // namespace cairn
