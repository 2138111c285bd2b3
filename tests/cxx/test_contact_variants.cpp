// Contacts with more than Signorini and Coulomb say, on one contact, against closed forms.
#include <random>

#include "one_contact.hpp"

namespace cairn {
namespace {

using test::OneContact;

// A static and a kinetic friction: the latter in steps behind one in which it slid.
TEST(UnilateralContact, SlidesByItsKineticFriction) {
  for (int dim : {2, 3}) {
    OneContact one("UnilateralContact", {{"mu", 0.5}, {"kinetic", 0.3}}, dim, 1e-3, 0);
    const auto limit = [&](double normal, double tangent) {
      one.advance({-normal, 0.6 * tangent * (dim == 3 ? 1 : 1 / 0.6), 0.8 * tangent});
      return std::hypot(one.r[1], dim == 3 ? one.r[2] : 0.0);
    };
    EXPECT_NEAR(limit(2, 0.98), 0.98, 1e-15); // held by 0.5
    EXPECT_NEAR(limit(2, 1.2), 1.0, 1e-15);   // slides
    EXPECT_NEAR(limit(2, 0.98), 0.6, 1e-15);  // by 0.3
    EXPECT_NEAR(limit(2, 0.5), 0.5, 1e-15);   // stops
    EXPECT_NEAR(limit(2, 0.98), 0.98, 1e-15); // is held by 0.5 again
    limit(2, 1.2);
    one.advance({1, 0, 0}); // opens
    std::fill_n(one.gap, one.n, 0.0);
    EXPECT_NEAR(limit(2, 0.98), 0.98, 1e-15);
    OneContact same("UnilateralContact", {{"mu", 0.5}}, dim, 1e-3, 0);
    for (int step : {0, 1}) {
      same.advance({-2, 1.2, 0});
      EXPECT_NEAR(same.r[1], -1.0, 1e-15) << step;
    }
  }
}

TEST(UnilateralContact, RebounceAndOverlap) {
  for (int dim : {2, 3}) {
    OneContact one("UnilateralContact", {{"mu", 10}, {"normal", 0.5}, {"tangential", 0.2}}, dim, 1e-3, 0);
    one.begin[0] = -3, one.begin[1] = 0.5;
    one.advance({-3, 0.5, 0});
    EXPECT_NEAR(one.u[0], 1.5, 1e-15);
    EXPECT_NEAR(one.u[1], -0.1, 1e-15);
    OneContact apart("UnilateralContact", {{"mu", 0}, {"closing", 0}}, dim, 1e-3, 0);
    std::fill_n(apart.gap, apart.n, 1e-4);
    apart.advance({-3, 0, 0}); // an open contact is skipped
    EXPECT_EQ(apart.r[0], 0);
    apart.advance({-3, 0, 0});
    EXPECT_NEAR(apart.u[0], 0, 1e-15);
    for (double recovers : {0.0, 1.0}) {
      OneContact deep("UnilateralContact", {{"mu", 0}, {"recovers", recovers}}, dim, 1e-3, 0);
      std::fill_n(deep.gap, deep.n, -1e-4);
      deep.advance({-1, 0, 0});
      EXPECT_NEAR(deep.u[0], 0.1 * recovers, 1e-15);
    }
  }
}

// shift: it touches with a gap of -shift; from_start: with the gap that it began with, an overlap only where it
// recovers.
TEST(UnilateralContact, CountsItsGapFromElsewhere) {
  for (int dim : {2, 3}) {
    OneContact shifted("UnilateralContact", {{"mu", 0}, {"shift", -2e-4}, {"recovers", 1}}, dim, 1e-3, 0);
    shifted.advance({-1, 0, 0});
    EXPECT_NEAR(shifted.gap[0], 2e-4, 1e-18);
    struct Start {
      double gap, first_state, recovers, end;
    };
    for (const Start& s : {Start{3e-4, 1, 0, 3e-4}, Start{3e-4, 0, 0, 0}, Start{-3e-4, 1, 0, -3e-4},
                           Start{3e-4, 1, 1, 3e-4}, Start{-3e-4, 1, 1, -3e-4}, Start{-3e-4, 0, 1, 0}}) {
      OneContact one("UnilateralContact", {{"mu", 0}, {"from_start", 1}, {"recovers", s.recovers}}, dim, 1e-3,
                     s.first_state);
      std::fill_n(one.gap, one.n, s.gap);
      for (int step = 0; step < 3; ++step) one.advance({-1, 0, 0});
      EXPECT_NEAR(one.gap[0], s.end, 1e-17) << s.gap << " " << s.first_state << " " << s.recovers;
    }
    // an initial overlap that has opened in part: without recovery it bears where it is, with recovery at its initial
    // depth
    for (double recovers : {0.0, 1.0}) {
      OneContact one("UnilateralContact", {{"mu", 0}, {"from_start", 1}, {"recovers", recovers}}, dim, 1e-3, 1);
      std::fill_n(one.gap, one.n, -3e-4);
      one.advance({0.1, 0, 0});
      one.advance({-5, 0, 0});
      EXPECT_NEAR(one.gap[0], recovers > 0 ? -3e-4 : -2e-4, 1e-17);
    }
  }
}

// u = (u_free - h k g)/(1 + h (h k + eta)) while it presses; a collision of a mass: half a period, and the damped one.
TEST(ElasticContact, IsASpringAndADashpot) {
  const double k = 1e4, eta = 20, h = 1e-3, g = -1e-3;
  for (int dim : {2, 3}) {
    OneContact one("ElasticContact", {{"stiffness", k}, {"viscosity", eta}, {"mu", 0.4}}, dim, h, 0);
    std::fill_n(one.gap, one.n, g);
    one.advance({-0.2, 5, 0});
    const double u = (-0.2 - h * k * g) / (1 + h * (h * k + eta));
    EXPECT_NEAR(one.u[0], u, 1e-15);
    EXPECT_NEAR(one.r[0], -h * k * (g + h * u) - h * eta * u, 1e-15);
    EXPECT_NEAR(one.r[1], -0.4 * one.r[0], 1e-15);
    const double before = k * g * g / 2, after = k * (g + h * u) * (g + h * u) / 2;
    EXPECT_NEAR(one.stored, after, 1e-15);
    EXPECT_NEAR(one.taken - one.released, after - before, 1e-15);
    EXPECT_NEAR(one.released, eta * u * u * h, 1e-15);
    // leaves faster than the dashpot lets the spring follow: its energy is lost
    OneContact gone("ElasticContact", {{"stiffness", k}, {"viscosity", eta}}, dim, h, 0);
    std::fill_n(gone.gap, gone.n, g);
    gone.advance({0.8, 0, 0});
    EXPECT_EQ(gone.r[0], 0);
    EXPECT_EQ(gone.taken, 0);
    EXPECT_NEAR(gone.released, before - k * 4e-8 / 2, 1e-15);
    for (double closing : {0.0, 1.0}) { // from a gap
      OneContact apart("ElasticContact", {{"stiffness", k}, {"closing", closing}}, dim, h, 0);
      std::fill_n(apart.gap, apart.n, 1e-4);
      apart.advance({-0.3, 0, 0});
      EXPECT_NEAR(apart.u[0], closing > 0 ? (-0.3 - h * k * 1e-4) / (1 + h * h * k) : -0.3, 1e-15);
    }
    OneContact first("ElasticContact", {{"stiffness", k}, {"from_start", 1}}, dim, h, 1);
    std::fill_n(first.gap, first.n, 3e-4);
    first.advance({-0.3, 0, 0});
    EXPECT_NEAR(first.u[0], -0.3 / (1 + h * h * k), 1e-15);
    OneContact rigid("ElasticContact", {{"stiffness", std::numeric_limits<double>::infinity()}, {"viscosity", 1}}, dim,
                     h, 0),
        none("ElasticContact", {{"stiffness", 0}}, dim, h, 0);
    rigid.advance({-1, 0, 0});
    EXPECT_NEAR(rigid.u[0], 0, 1e-15);
    none.advance({-1, 0, 0});
    EXPECT_EQ(none.u[0], -1);
  }
}

TEST(ElasticContact, HasTheRestitutionOfItsDamping) {
  const double k = 1e4, pi = std::acos(-1.0);
  for (double ratio : {0.0, 0.1}) {
    OneContact one("ElasticContact", {{"stiffness", k}, {"viscosity", 2 * ratio * std::sqrt(k)}}, 2, 1e-6, 0);
    double v = -0.1, time = 0;
    do one.advance({v, 0}), v = one.u[0], time += 1e-6;
    while (one.r[0] > 0);
    // without tension it ends where the force does, at tan(w t) = -2 z s/(1 - 2 z^2) (Schwager & Poschel 2007)
    const double s = std::sqrt(1 - ratio * ratio), w = s * 100;
    const double end = ratio > 0 ? (pi - std::atan2(2 * ratio * s, 1 - 2 * ratio * ratio)) / w : pi / w;
    EXPECT_NEAR(time / end, 1, 1e-3);
    EXPECT_NEAR(v / 0.1, std::exp(-ratio * 100 * end), 2e-3);
    EXPECT_NEAR(one.taken, 0.5 * 0.01 - 0.5 * v * v, 2e-3 * 0.005);
    EXPECT_NEAR(one.taken, one.released + one.stored, 1e-12); // the rest goes as the surface comes back
    EXPECT_GE(one.released, 0);
  }
}

TEST(AdhesiveContact, DrawsAsWetDoes) {
  for (int dim : {2, 3}) {
    OneContact one("AdhesiveContact", {{"force", 10}, {"reach", 1e-3}, {"mu", 0.5}}, dim, 1e-4, 0),
        wet("Wet", {{"force", 10}, {"reach", 1e-3}, {"mu", 0.5}}, dim, 1e-4, 0);
    for (const std::vector<double>& free : {std::vector<double>{0.9e-3, 0, 0},
                                            {0, 0.49e-3, 0},
                                            {0, 0.6e-3, 0},
                                            {0.3, 0, 0},
                                            {2, 0, 0},
                                            {-1, 0.2, 0},
                                            {8, 0, 0},
                                            {1, 0, 0}}) {
      one.advance(free);
      wet.advance(free);
      for (int k = 0; k < dim; ++k) EXPECT_EQ(one.r[k], wet.r[k]);
      EXPECT_NEAR(one.taken, wet.taken, 1e-15);
      EXPECT_NEAR(one.stored, wet.stored, 1e-15);
      EXPECT_LE(one.residual, 1e-15);
    }
  }
}

// Kinetic friction on the shifted cone; less once torn; for good where it is made once.
TEST(AdhesiveContact, TearsAndSlides) {
  for (int dim : {2, 3}) {
    const double h = 1e-4;
    OneContact one("AdhesiveContact",
                   {{"force", 10}, {"reach", 1e-3}, {"mu", 0.5}, {"kinetic", 0.2}, {"torn_force", 4}}, dim, h, 0);
    one.advance({0, 0.6e-3, 0});
    EXPECT_NEAR(one.r[1], -0.5 * 10 * h, 1e-17); // slides
    one.advance({0, 0.4e-3, 0});
    EXPECT_NEAR(one.r[1], -0.2 * 10 * h, 1e-17);
    one.advance({1.5e-3, 0, 0}); // torn
    EXPECT_NEAR(one.r[0], -10 * h, 1e-17);
    one.advance({-1e-2, 0, 0});
    one.advance({0.5e-3, 0, 0});
    EXPECT_NEAR(one.r[0], -4 * h, 1e-17);
    for (double once : {0.0, 1.0})
      for (double first : {0.0, 1.0}) {
        OneContact bond("AdhesiveContact", {{"force", 10}, {"reach", 1e-3}, {"once", once}}, dim, h, first);
        bond.advance({0.9e-3, 0, 0});
        EXPECT_NEAR(bond.r[0], once > 0 && first == 0 ? 0 : -0.9e-3, 1e-17);
        std::fill_n(bond.gap, bond.n, 2e-3); // carried beyond its reach and back
        bond.advance({0, 0, 0});
        std::fill_n(bond.gap, bond.n, 0.0);
        bond.advance({0.9e-3, 0, 0});
        EXPECT_NEAR(bond.r[0], once > 0 ? 0 : -0.9e-3, 1e-17);
      }
  }
}

// At rest a spring under attraction is F/k deep, and returns the work of the attraction; rebound against the pull;
// overlap.
TEST(AdhesiveContact, OnASpringOrRebounding) {
  for (int dim : {2, 3}) {
    OneContact one("AdhesiveContact", {{"force", 10}, {"reach", 1e-3}, {"stiffness", 1e4}, {"viscosity", 200}}, dim,
                   1e-3, 0);
    double v = 0;
    for (int step = 0; step < 500; ++step) one.advance({v, 0, 0}), v = one.u[0];
    EXPECT_NEAR(one.gap[0], -10 / 1e4, 1e-12);
    EXPECT_NEAR(one.stored, 1e4 * 1e-6 / 2 - 10 * 2e-3, 1e-12);
    EXPECT_NEAR(one.taken - one.released, one.stored + 10 * 1e-3, 1e-12); // of the energy at the touch
    EXPECT_LE(one.residual, 1e-12 * 10 * 1e-3);
    OneContact bounces("AdhesiveContact", {{"force", 10}, {"reach", 1e-3}, {"normal", 0.5}}, dim, 1e-3, 0);
    bounces.begin[0] = -3;
    bounces.advance({-3, 0, 0});
    EXPECT_NEAR(bounces.u[0], 1.5, 1e-15);
    EXPECT_NEAR(bounces.r[0], 4.5, 1e-15);
    bounces.begin[0] = 0;
    std::fill_n(bounces.gap, bounces.n, 1e-4);
    bounces.advance({0, 0, 0}); // within reach it is drawn alone
    EXPECT_NEAR(bounces.u[0], -10e-3, 1e-15);
    OneContact deep("AdhesiveContact", {{"force", 10}, {"reach", 1e-3}, {"recovers", 1}}, dim, 1e-3, 0);
    std::fill_n(deep.gap, deep.n, -1e-4);
    deep.advance({0, 0, 0});
    EXPECT_NEAR(deep.u[0], 0.1, 1e-15);
  }
}

// An overlap d is gone by u = 2 (2 pi/T)^2 d/h: in one step for T = 2 sqrt(2) pi, in 1 - 1/4 of it for twice that.
TEST(GapRescue, LiftsOverlap) {
  const double h = 1e-3, bound = 2 * std::sqrt(2.0) * std::acos(-1.0);
  for (int dim : {2, 3})
    for (double factor : {1.0, 2.0}) {
      OneContact one("GapRescue", {{"mu", 0.3}, {"period", factor * bound}, {"tolerance", -1e-5}}, dim, h, 0);
      std::fill_n(one.w, dim, 0.5);
      std::fill_n(one.gap, one.n, -1.1e-4);
      one.advance({0, 0.01, 0});
      EXPECT_NEAR(one.u[0], 1e-4 / h / (factor * factor), 1e-14);
      EXPECT_EQ(one.r[1], 0); // what lifts rubs nothing
      EXPECT_LE(one.residual, 1e-16);
      one.advance({-5, 0, 0}); // pressed down again, the lift is least
      EXPECT_GE(one.u[0], -1e-15);
      OneContact shallow("GapRescue", {{"mu", 0.3}, {"period", bound}, {"tolerance", -1e-5}}, dim, h, 0);
      std::fill_n(shallow.gap, shallow.n, -0.9e-5);
      shallow.advance({-1, 0.5, 0});
      EXPECT_NEAR(shallow.u[0], 0, 1e-15);
      EXPECT_NEAR(shallow.r[1], -0.3, 1e-15);
    }
}

TEST(CoupledMotion, HoldsItsComponents) {
  for (int dim : {2, 3})
    for (double normal : {0.0, 1.0})
      for (double tangential : {0.0, 1.0})
        for (double gap : {-1e-3, 0.9e-3, 1.1e-3}) {
          OneContact one("CoupledMotion", {{"normal", normal}, {"tangential", tangential}, {"reach", 1e-3}}, dim, 1e-3,
                         0);
          std::fill_n(one.gap, one.n, gap);
          one.advance({0.7, -0.2, 0.3});
          const double free[] = {0.7, -0.2, 0.3};
          for (int k = 0; k < dim; ++k)
            EXPECT_NEAR(one.u[k], gap <= 1e-3 && (k == 0 ? normal : tangential) > 0 ? 0 : free[k], 1e-15);
          EXPECT_EQ(one.residual, 0);
        }
}

// Coulomb sliding is confined to the limit in both directions; there it is held without a force, and comes back.
TEST(LimitedSlip, StopsAtItsLimit) {
  const double h = 1e-3;
  for (int dim : {2, 3})
    for (double way : {-1.0, 1.0}) {
      OneContact one("LimitedSlip", {{"mu", 0.5}, {"limit", 1e-3}}, dim, h, 0);
      const double share = dim == 3 ? 0.6 : 1.0;
      const auto drawn = [&](double normal, double tangent) {
        one.advance({normal, way * share * tangent, way * 0.8 * tangent});
        return way * (share * one.u[1] + (dim == 3 ? 0.8 * one.u[2] : 0.0));
      };
      EXPECT_NEAR(drawn(-1, 0.9), 0.4, 1e-15);   // slides by 0.4 mm
      EXPECT_NEAR(drawn(-1, 1.05), 0.55, 1e-15); // by 0.95
      EXPECT_NEAR(drawn(-1, 1.5), 0, 1e-15);     // it would by 1.95
      EXPECT_NEAR(one.r[0], 1, 1e-15);
      EXPECT_NEAR(drawn(2, 3.0), 3, 1e-15); // flies off: it slides on nothing
      EXPECT_EQ(one.r[0], 0);
      EXPECT_NEAR(drawn(-3, 1.5), 0, 1e-15);     // back on the floor it has slid by 0.95 still
      EXPECT_NEAR(drawn(-1, -1.0), -0.5, 1e-15); // back it may
      EXPECT_LE(one.residual, 1e-15);
    }
  for (double recovers : {0.0, 1.0}) {
    OneContact deep("LimitedSlip", {{"mu", 0.5}, {"limit", 1e-3}, {"recovers", recovers}}, 2, h, 0);
    std::fill_n(deep.gap, deep.n, -1e-4);
    deep.advance({-1, 0});
    EXPECT_NEAR(deep.u[0], 0.1 * recovers, 1e-15);
  }
}

// r_N = h k (g0 - g) while it draws; gone from k (g - g0) = strength on, there again below it; beside it the contact
// presses.
TEST(BrittleCoating, IsASpringUpToItsStrength) {
  const double k = 1e4, h = 1e-3, rest = 1e-4;
  for (int dim : {2, 3}) {
    OneContact one("BrittleCoating", {{"mu", 0.5}, {"stiffness", k}, {"strength", 5}, {"rest", rest}, {"reach", 1}},
                   dim, h, 0);
    std::fill_n(one.gap, one.n, 3e-4);
    one.advance({0.05, 0.1, 0});
    const double u = (0.05 + h * k * (rest - 3e-4)) / (1 + h * h * k);
    EXPECT_NEAR(one.u[0], u, 1e-16);
    EXPECT_NEAR(one.r[0], h * k * (rest - 3e-4 - h * u), 1e-17);
    EXPECT_EQ(one.r[1], 0);
    EXPECT_NEAR(one.stored, k * (2e-4 + h * u) * (2e-4 + h * u) / 2, 1e-18);
    EXPECT_NEAR(one.taken - one.released, one.stored, 1e-18); // it came with 2e-4 of stretch
    for (double gap : {5.9e-4, 6.1e-4}) {
      OneContact far("BrittleCoating", {{"stiffness", k}, {"strength", 5}, {"rest", rest}, {"reach", 1}}, dim, h, 0);
      std::fill_n(far.gap, far.n, gap);
      far.advance({0, 0, 0});
      EXPECT_EQ(far.r[0] < 0, gap < 6e-4);
      EXPECT_EQ(far.r[0] == 0, gap > 6e-4);
    }
    OneContact beyond("BrittleCoating", {{"stiffness", k}, {"strength", 5}, {"rest", rest}, {"reach", 2e-4}}, dim, h,
                      0);
    std::fill_n(beyond.gap, beyond.n, 3e-4);
    beyond.advance({0, 0, 0});
    EXPECT_EQ(beyond.r[0], 0);
    // pressed at the touch: the spring bears h k g0, the contact the rest, which alone gives friction
    OneContact pressed("BrittleCoating", {{"mu", 0.5}, {"stiffness", k}, {"strength", 5}, {"rest", rest}, {"reach", 1}},
                       dim, h, 0);
    pressed.advance({-0.01, 1, 0});
    EXPECT_NEAR(pressed.u[0], 0, 1e-17);
    EXPECT_NEAR(pressed.r[0], 0.01, 1e-17);
    EXPECT_NEAR(pressed.r[1], -0.5 * (0.01 - h * k * rest), 1e-17);
    EXPECT_LE(pressed.residual, 1e-17);
  }
}

// On full blocks: held contacts do not move, and a coating is its spring beside a contact on the cone.
TEST(OwnSolutions, OnFullBlocks) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const double h = 1e-2;
  for (int c : {2, 3})
    for (int round = 0; round < 200; ++round) {
      double w[9], q[3], r[3] = {}, u[3], m[3][3];
      for (auto& row : m)
        for (double& x : row) x = normal(random);
      for (int k = 0; k < c; ++k) {
        q[k] = normal(random);
        for (int l = 0; l < c; ++l) {
          w[l * c + k] = k == l ? 2.0 : 0.0; // near enough to its diagonal that friction has one answer
          for (int p = 0; p < c; ++p) w[l * c + k] += 0.3 * m[k][p] * m[l][p];
        }
      }
      const auto left = [&] {
        for (int k = 0; k < c; ++k) {
          u[k] = q[k];
          for (int l = 0; l < c; ++l) u[k] += w[l * c + k] * r[l];
        }
      };
      const double coupled[] = {1, 1, 1, std::numeric_limits<double>::max(), 0, h, 0, 0, 0}, yes[] = {1, 0};
      test::law_called("CoupledMotion").solve(1, c, w, q, q, coupled, yes, r, nullptr);
      left();
      for (int k = 0; k < c; ++k) EXPECT_NEAR(u[k], 0, 1e-13);
      const double pulls = 0.2, yields[] = {1, 1, 1, pulls, 0, h, 0, 0, 0};
      test::law_called("CoupledMotion").solve(1, c, w, q, q, yields, yes, r, nullptr);
      left();
      EXPECT_GE(r[0], -pulls);
      if (r[0] > -pulls) { EXPECT_NEAR(u[0], 0, 1e-13); }
      EXPECT_GE(u[0], -1e-13);
      for (int k = 1; k < c; ++k) EXPECT_NEAR(u[k], 0, 1e-13);
      const double k = 300, rest = 0.01 * normal(random), mu = 0.4;
      const double coating[] = {mu, k, 1, rest, 1, h, 0, 0, 0}, acts[] = {1, 0};
      test::law_called("BrittleCoating").solve(1, c, w, q, q, coating, acts, r, nullptr);
      left();
      const double contact = r[0] - h * k * (rest - h * u[0]), tangent = std::hypot(r[1], c == 3 ? r[2] : 0.0);
      const double slip = std::hypot(u[1], c == 3 ? u[2] : 0.0);
      EXPECT_GE(contact, -1e-12);
      EXPECT_GE(u[0], -1e-12);
      EXPECT_NEAR(contact * u[0], 0, 1e-12);
      EXPECT_LE(tangent, mu * contact + 1e-12);
      EXPECT_NEAR(u[1] * r[1] + (c == 3 ? u[2] * r[2] : 0.0), -mu * contact * slip, 1e-11);
    }
}

} // namespace
} // namespace cairn
