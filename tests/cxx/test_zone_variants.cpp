// Zones with more than a curve beside: friction that slides and sticks apart, an attraction once broken, springs under
// pressure and in series, an opening that stays; bonds and couplings with two frictions or a limit. Closed forms.
#include <functional>

#include "one_contact.hpp"

namespace cairn {
namespace {

using test::OneContact;
using Values = OneContact::Values;

// By lengths, by a machine a million times as stiff as c. Stress [Pa], opening from the start [m].
struct Pulled : OneContact {
  double stiff, stress[3] = {0, 0, 0}, open[3] = {0, 0, 0};
  Pulled(const std::string& name, const Values& given, int dim, double h = 1e-5)
      : OneContact(name, given, dim, h), stiff(given.at("normal_stiffness")) {}
  void go_to(double normal, double tangent = 0, double second = 0) {
    std::fill_n(w, c, 1e-6 / (area * h * h * stiff));
    advance({(normal - open[0]) / h, (tangent - open[1]) / h, (second - open[2]) / h});
    for (int k = 0; k < c; ++k) stress[k] = -r[k] / (area * h), open[k] += h * u[k];
    EXPECT_LE(residual, 1e-9 * stiff * 1e-5 * area * h);
  }
};

const Values zone = {{"normal_stiffness", 1e12}, {"tangential_stiffness", 5e11},
                     {"normal_strength", 2e6},   {"tangential_strength", 3e6},
                     {"normal_work", 10},        {"tangential_work", 30}};
Values with(Values all, const Values& more) {
  for (const auto& [word, value] : more) all[word] = value;
  return all;
}

// A broken contact slides with kinetic friction in steps after one in which it slid.
void slides_by_its_kinetic_friction(OneContact& one, double unit) {
  const auto limit = [&](double normal, double tangent) {
    std::fill_n(one.gap, one.n, 0.0);
    one.advance({-normal * unit, 0.6 * tangent * unit * (one.dim == 3 ? 1 : 1 / 0.6), 0.8 * tangent * unit});
    return std::hypot(one.r[1], one.dim == 3 ? one.r[2] : 0.0) / unit;
  };
  for (int round = 0; round < 2; ++round) {
    EXPECT_NEAR(limit(2, 0.98), 0.98, 1e-13); // held by 0.5
    EXPECT_NEAR(limit(2, 1.2), 1.0, 1e-13);   // slides
    EXPECT_NEAR(limit(2, 0.98), 0.6, 1e-13);  // by 0.3
    EXPECT_NEAR(limit(2, 0.5), 0.5, 1e-13);   // stops
  }
  limit(2, 1.2);
  one.advance({unit, 0, 0}); // opens
  EXPECT_NEAR(limit(2, 0.98), 0.98, 1e-13);
}

TEST(MohrCoulomb, SlidesByItsKineticFrictionOnceBroken) {
  for (int dim : {2, 3}) {
    const Values bond = {{"tension", 1e5}, {"cohesion", 2e5}, {"friction", 0.7}, {"mu", 0.5}, {"kinetic", 0.3}};
    const double unit = 1e5 * 1e-4 * 1e-5;
    OneContact torn("MohrCoulomb", bond, dim);
    torn.advance({2 * unit, 0, 0});
    ASSERT_EQ(torn.state[0], 0);
    slides_by_its_kinetic_friction(torn, unit);
    OneContact sheared("MohrCoulomb", bond, dim);
    sheared.advance({-unit, 4 * unit, 0}); // more than 2 + 0.7
    ASSERT_EQ(sheared.state[0], 0);
    EXPECT_NEAR(sheared.r[1], -2.7 * unit, 1e-13 * unit);
    sheared.advance({-unit, 4 * unit, 0}); // it slides already
    EXPECT_NEAR(sheared.r[1], -0.3 * unit, 1e-13 * unit);
  }
}

TEST(Zones, SlideByTheirKineticFrictionOnceBroken) {
  const Values one_work = {{"normal_stiffness", 1e12}, {"tangential_stiffness", 5e11}, {"work", 10}};
  for (const auto& [name, values] : std::map<std::string, Values>{
           {"MAC", one_work},
           {"MACContact", one_work},
           {"MP", one_work},
           {"MP3", with(one_work, {{"strength", 2e6}})},
           {"MAL", zone},
           {"TH", with(zone, {{"normal_plateau", 4e-6}, {"tangential_plateau", 8e-6}})},
           {"ABP", with(zone, {{"normal_end", 4e-5}, {"tangential_end", 8e-5}, {"first_share", 0.3}})},
           {"EXPO", zone},
           {"PlasticEXPO", zone}})
    for (int dim : {2, 3}) {
      SCOPED_TRACE(name);
      OneContact one(name, with(values, {{"mu", 0.5}, {"kinetic", 0.3}}), dim);
      one.advance({1e12 / one.h, 0, 0}); // the tail of MAC, too
      ASSERT_EQ(one.state[0], 0);
      slides_by_its_kinetic_friction(one, 1e-4);
    }
}

// The attraction ends at the touch, where the spring and the dashpot begin; F times the reach to part.
TEST(AdhesiveContact, DrawsUpToTheTouchAlone) {
  const double k = 1e4, eta = 20, h = 1e-3;
  const Values values = {{"force", 10},    {"reach", 1e-3},    {"mu", 0.5},
                         {"stiffness", k}, {"viscosity", eta}, {"touching", 0}};
  for (int dim : {2, 3}) {
    OneContact pressed("AdhesiveContact", values, dim, h, 0);
    std::fill_n(pressed.gap, pressed.n, -1e-4);
    pressed.advance({-0.2, 5, 0});
    const double u = (-0.2 + h * k * 1e-4) / (1 + h * (h * k + eta));
    EXPECT_NEAR(pressed.u[0], u, 1e-15);
    EXPECT_NEAR(pressed.r[1], -0.5 * pressed.r[0], 1e-15);
    OneContact drawn("AdhesiveContact", values, dim, h, 0);
    std::fill_n(drawn.gap, drawn.n, 5e-4);
    drawn.advance({0.3, 0, 0});
    EXPECT_NEAR(drawn.u[0], 0.3 - 10 * h, 1e-15);
    drawn.advance({-1.5, 0, 0}); // stops where it touches
    EXPECT_NEAR(drawn.gap[0], 0, 1e-17);
    OneContact away("AdhesiveContact", with(values, {{"closing", 0}}), dim, h, 0);
    std::fill_n(away.gap, away.n, 2e-3);
    away.advance({-3, 0, 0}); // beyond its reach
    EXPECT_EQ(away.r[0], 0);
    OneContact flies("AdhesiveContact", with(values, {{"viscosity", 0}, {"stiffness", 1e6}}), dim, 1e-7, 0);
    std::fill_n(flies.gap, flies.n, 1e-12);
    double v = 0.2;
    while (flies.gap[0] < 1.2e-3) flies.advance({v, 0, 0}), v = flies.u[0];
    EXPECT_NEAR(v, std::sqrt(0.04 - 2 * 10 * 1e-3), 1e-5);
    EXPECT_NEAR(flies.taken, 10e-3, 1e-5 * 10e-3);
  }
}

// Energy of an attraction of unlimited reach counts from the touch.
TEST(AdhesiveContact, HasAnEnergyWhateverItsReach) {
  for (int dim : {2, 3}) {
    OneContact one("AdhesiveContact", {{"force", 10}, {"reach", std::numeric_limits<double>::infinity()}}, dim, 1e-3,
                   0);
    for (int step = 0; step < 5; ++step) {
      one.advance({0.03, 0, 0});
      EXPECT_NEAR(one.u[0], 0.02, 1e-15);
      EXPECT_NEAR(one.stored, 10 * one.gap[0], 1e-15);
      EXPECT_NEAR(one.taken, one.stored, 1e-15);
    }
  }
}

// It yields by pulling with its limit, the tangents held; or breaks behind a step in which it pushed with more.
TEST(CoupledMotion, YieldsOrBreaks) {
  for (int dim : {2, 3}) {
    OneContact yields("CoupledMotion", {{"reach", 1e-2}, {"impulse", 2}}, dim, 1e-3, 0);
    yields.advance({1.9, 3, 0});
    EXPECT_NEAR(yields.u[0], 0, 1e-15);
    yields.advance({2.5, 3, -1});
    EXPECT_NEAR(yields.r[0], -2, 1e-15);
    EXPECT_NEAR(yields.u[0], 0.5, 1e-15);
    EXPECT_NEAR(yields.u[1], 0, 1e-15);
    EXPECT_LE(yields.residual, 1e-14);
    yields.advance({-5, 0, 0}); // compression has no limit
    EXPECT_NEAR(yields.r[0], 5, 1e-14);
    OneContact breaks("CoupledMotion", {{"reach", 1e-2}, {"impulse", 2}, {"breaks", 1}}, dim, 1e-3, 0);
    for (double free : {5.0, -1.9}) {
      breaks.advance({free, 3, 0});
      EXPECT_NEAR(breaks.r[0], -free, 1e-14);
    }
    breaks.advance({-2.1, 0, 0});
    EXPECT_NEAR(breaks.r[0], 2.1, 1e-14);
    breaks.advance({-1, 1, 0});
    EXPECT_EQ(breaks.r[0], 0);
    EXPECT_EQ(breaks.u[1], 1);
  }
}

// The curve of MAC as far as its break, then a force to the reach: w and F times the remaining distance.
TEST(MACContact, DrawsOnceItIsBroken) {
  for (int dim : {2, 3}) {
    const double force = 3, reach = 1e-3, break_at = 10e-6;
    Pulled one("MACContact",
               {{"normal_stiffness", 1e12},
                {"tangential_stiffness", 1e12},
                {"work", 10},
                {"mu", 0.5},
                {"force", force},
                {"reach", reach}},
               dim);
    double at = 0;
    for (int k = 1; k <= 500; ++k) {
      one.go_to(at = k * break_at / 500);
      const double u = one.open[0], exact = u < std::sqrt(1e-11) ? 1e12 * u : 100 / (1e12 * u * u * u);
      ASSERT_NEAR(one.stress[0], exact, 2e-3 * 3.2e6);
    }
    one.go_to(at = 1e3); // nothing is left of beta
    std::fill_n(one.gap, one.n, at = 5e-4);
    ASSERT_EQ(one.state[0], 0);
    EXPECT_EQ(one.stored, 0); // a kilometre away
    const double taken = one.taken;
    for (int k = 1; k <= 10; ++k) {
      one.open[0] = at;
      one.go_to(at += 1e-5);
      EXPECT_NEAR(one.stress[0], force / one.area, 1e-12 * force / one.area);
    }
    EXPECT_NEAR(one.gap[0], 6e-4, 1e-8 * reach); // the machine gives way
    EXPECT_NEAR(one.taken - taken, force * (one.gap[0] - 5e-4), 1e-12 * force * reach);
    EXPECT_NEAR(one.stored, -force * (reach - one.gap[0]), 1e-12 * force * reach);
    // mu F holds without a load
    one.open[0] = 6e-4, std::fill_n(one.gap, one.n, 0.0), std::fill_n(one.w, one.c, 1.0);
    one.advance({0, 0.49 * force * one.h, 0});
    EXPECT_NEAR(one.u[1], 0, 1e-15);
    one.advance({0, 0.6 * force * one.h, 0});
    EXPECT_NEAR(one.u[1], 0.1 * force * one.h, 1e-12 * force * one.h);
  }
}

// Under pressure a spring, hard from a limit on; drawn apart the curve of MAC.
TEST(MACContact, IsPressedOnASpring) {
  const double k = 1e4, h = 1e-3, g = -1e-3;
  for (int dim : {2, 3}) {
    const Values values = {
        {"normal_stiffness", 1e9}, {"tangential_stiffness", 1e9}, {"work", 1}, {"stiffness", k}, {"limit", 2e-3}};
    OneContact one("MACContact", values, dim, h);
    one.advance({0, 0, 0});
    std::fill_n(one.gap, one.n, g);
    one.advance({-0.2, 0, 0});
    const double u = (-0.2 - h * k * g) / (1 + h * h * k);
    EXPECT_NEAR(one.u[0], u, 1e-15);
    EXPECT_NEAR(one.r[0], -h * k * (g + h * u), 1e-15);
    const double before = k * g * g / 2, after = k * (g + h * u) * (g + h * u) / 2;
    EXPECT_NEAR(one.stored, after, 1e-14);
    EXPECT_NEAR(one.taken, after - before, 1e-14);
    EXPECT_NEAR(one.residual, 0, 1e-14);
    EXPECT_EQ(one.state[0], 1);
    std::fill_n(one.gap, one.n, -2e-3);
    one.advance({-0.2, 0, 0});
    EXPECT_NEAR(one.u[0], 0, 1e-15);
    Pulled apart("MACContact", values, dim),
        same("MAC", {{"normal_stiffness", 1e9}, {"tangential_stiffness", 1e9}, {"work", 1}}, dim);
    for (int step = 1; step <= 50; ++step) {
      apart.go_to(4e-6 * step), same.go_to(4e-6 * step);
      ASSERT_NEAR(apart.stress[0], same.stress[0], 1e-13 * 3e4);
    }
  }
}

// Broken sides close by what breaking took from them, and half of it is gone with half of the adhesion.
TEST(MACContact, LosesAGapByDamage) {
  const double c = 1e9, loss = 1e-9;
  for (int dim : {2, 3}) {
    Pulled one("MACContact", {{"normal_stiffness", c}, {"tangential_stiffness", c}, {"work", 1}, {"loss", loss}}, dim);
    const double u0 = std::sqrt(1 / c);
    for (int step = 1; step <= 20; ++step) {
      const double before = one.state[0];
      one.go_to(0.1 * u0 * step);
      const double beta = one.state[0], counted = one.open[0] + loss * (1 - before);
      EXPECT_NEAR(one.stress[0], beta * beta * c * counted, 1e-9 * c * u0) << step;
    }
    EXPECT_NEAR(one.taken, one.stored + one.released, 1e-12 * one.taken);
    one.go_to(1e6);
    ASSERT_EQ(one.state[0], 0);
    std::fill_n(one.gap, one.n, 0.0);
    std::fill_n(one.w, one.c, 1.0);
    one.advance({-1, 0, 0});
    EXPECT_NEAR(one.gap[0], -loss, 1e-12 * loss);
  }
}

struct Mode {
  double k, first, work;
  explicit Mode(double t) {
    const double d1 = 2e-6, d2 = 6e-6;
    k = (1e12 + 5e11 * t * t) / (1 + t * t);
    first = d1 * d2 * std::sqrt((1 + t * t) / (d2 * d2 + t * t * d1 * d1));
    work = 300 * k / ((30e12 + 5e12 * t * t) / (1 + t * t));
  }
  double rate(double share) const { return k * first / (work / share - k * first * first / 2); }
};

// On the way apart the curve of a zone of the work w/share; let go, a straight line to what stays; along any mode.
TEST(PlasticEXPO, KeepsAnOpening) {
  for (const double degrees : {0.0, 30.0, 90.0})
    for (const double share : {0.3, 0.8})
      for (int dim : {2, 3}) {
        const double angle = degrees / 180 * std::acos(-1.0), turn = dim == 3 ? 0.6 : 1;
        const Mode mode(degrees > 89 ? 1e9 : std::tan(angle));
        Pulled one("PlasticEXPO", with(zone, {{"damage_share", share}, {"rest", 1e-4}}), dim);
        const auto to = [&](double d) {
          one.go_to(d * std::cos(angle), d * std::sin(angle) * turn, dim == 3 ? -d * std::sin(angle) * 0.8 : 0);
        };
        const auto along = [&] {
          return one.stress[0] * std::cos(angle) +
                 std::sin(angle) * (turn * one.stress[1] - (dim == 3 ? 0.8 * one.stress[2] : 0));
        };
        const double slow = mode.rate(share), kept = slow / mode.rate(1);
        double d = 0, due = 0, before = 0;
        for (int k = 1; k <= 2000; ++k) {
          const double next = 20e-6 * k / 2000,
                       s = mode.k * std::min(next, mode.first * std::exp(slow * (mode.first - next)));
          to(next);
          const double load =
              next < mode.first ? mode.k * next : mode.k * mode.first * std::exp(slow * (mode.first - next));
          ASSERT_NEAR(along(), load, 1e-4 * 3e6) << degrees << " " << share << " " << next << " " << s;
          due += (load + before) / 2 * (next - d);
          before = load;
          d = next;
        }
        EXPECT_NEAR(one.stored + one.released, due * one.area, 1e-4 * due * one.area);
        EXPECT_NEAR(one.taken, one.stored + one.released, 1e-11 * one.taken);
        const double stays = (1 - kept) * (d - mode.first), elastic = d - stays, peak = along(), spent = one.released;
        EXPECT_NEAR(one.stored, peak * elastic / 2 * one.area, 1e-4 * due * one.area);
        for (const double part : {0.75, 0.5, 0.25, 0.0, 0.6}) { // and back
          to(stays + part * elastic);
          EXPECT_NEAR(along(), part * peak, 1e-3 * peak) << degrees << " " << share << " " << part;
        }
        EXPECT_EQ(one.released, spent);
        to(d), to(1.5 * d); // the curve goes on
        EXPECT_NEAR(along(), mode.k * mode.first * std::exp(slow * (mode.first - 1.5 * d)), 1e-3 * 3e6);
        to(1e-2);
        EXPECT_EQ(one.state[0], 0);
        EXPECT_EQ(one.stored, 0);
      }
  // closed beyond its plastic opening it pushes by its springs, and stops at its sides
  Pulled closed("PlasticEXPO", with(zone, {{"damage_share", 0.3}}), 2);
  for (int k = 1; k <= 100; ++k) closed.go_to(1e-7 * k);
  const double beta = closed.state[0], stays = closed.open[0] - closed.state[closed.n];
  ASSERT_GT(stays, 1e-6);
  closed.go_to(stays / 2);
  EXPECT_NEAR(closed.stress[0], -beta * 1e12 * stays / 2, 1e-4 * 2e6);
  closed.go_to(-1e-6);
  EXPECT_NEAR(closed.open[0], 0, 1e-3 * stays);
  EXPECT_LT(closed.stress[0], -beta * 1e12 * stays);
  EXPECT_NEAR(closed.taken, closed.stored + closed.released, 1e-11 * closed.taken);
  // sheared to its end while its springs push: their energy is dissipated, too
  Pulled sheared("PlasticEXPO", with(zone, {{"damage_share", 0.3}}), 2);
  for (int k = 1; k <= 100; ++k) sheared.go_to(1e-7 * k);
  const double half = (sheared.open[0] - sheared.state[sheared.n]) / 2;
  sheared.go_to(half);
  const double work = sheared.work, taken = sheared.taken,
               held = sheared.state[0] * 1e12 * half * half / 2 * sheared.area;
  for (int k = 1; k <= 20000; ++k) sheared.go_to(half, 1e-8 * k);
  ASSERT_EQ(sheared.state[0] < 0.01, true);
  EXPECT_GT(held, 0.02 * (sheared.work - work));
  EXPECT_NEAR(sheared.taken - taken, sheared.work - work, 0.003 * (sheared.work - work));
}

// A spring in series adds stress/K to the opening, under pressure too; broken, it is without force. It stores s^2/(2
// K).
TEST(PlasticEXPO, HasASpringInSeries) {
  const double stiff = 2e12, soft = 1e12, unit = 2e6;
  for (const bool tangential : {false, true})
    for (const double share : {1.0, 0.5})
      for (int dim : {2, 3}) {
        const Mode mode(tangential ? 1e9 : 0);
        const double K = tangential ? soft : stiff, slow = mode.rate(share);
        Pulled one("PlasticEXPO",
                   with(zone, {{"damage_share", share}, {"normal_spring", stiff}, {"tangential_spring", soft}}), dim);
        double stress = 0;
        for (int k = 1; k <= 3000; ++k) { // by what the zone opens: no snap-back, the spring is stiff enough
          const double d = 15e-6 * k / 3000;
          stress = d < mode.first ? mode.k * d : mode.k * mode.first * std::exp(slow * (mode.first - d));
          const double all = d + stress / K;
          one.go_to(tangential ? 0 : all, tangential ? 0.6 * all * (dim == 3 ? 1 : 1 / 0.6) : 0,
                    tangential ? 0.8 * all : 0);
          const double found = tangential ? std::hypot(one.stress[1], dim == 3 ? one.stress[2] : 0) : one.stress[0];
          ASSERT_NEAR(found, stress, 1e-3 * unit) << tangential << share << " " << k;
        }
        EXPECT_NEAR(one.taken, one.stored + one.released, 1e-11 * one.taken);
        const double elastic = stress * stress / K / 2 + one.state[0] * 0;
        EXPECT_GT(one.stored, elastic * one.area);
        const double zone_stores = stress * stress / (2 * one.state[0] * mode.k);
        EXPECT_NEAR(one.stored, (elastic + zone_stores) * one.area, 2e-3 * (elastic + zone_stores) * one.area);
        one.go_to(tangential ? 0 : 1e-2, tangential ? 1e-2 : 0);
        EXPECT_EQ(one.state[0], 0);
        EXPECT_EQ(one.stored, 0);
      }
  for (int dim : {2, 3}) {
    Pulled pressed("PlasticEXPO", with(zone, {{"normal_spring", stiff}}), dim);
    pressed.go_to(-1e-6);
    EXPECT_NEAR(pressed.open[0], -1e-6, 1e-11);
    EXPECT_NEAR(pressed.stress[0], -stiff * 1e-6, 1e-5 * unit);
    EXPECT_NEAR(pressed.stored, stiff * 1e-12 / 2 * pressed.area, 1e-5 * pressed.stored);
    pressed.go_to(0);
    EXPECT_NEAR(pressed.stress[0], 0, 1e-5 * unit);
  }
}

// r = -h (k x + eta u) of both springs behind three steps of impact, k = 2 m (2 pi/(T h))^2, eta = 2 v k T h/(2 pi).
TEST(CriticalVoigt, TakesBackAnOverlap) {
  const double h = 1e-3, period = 6, damping = 1.5, ratio = 0.4, m = 1, w = 2 * std::acos(-1.0) / (period * h);
  const double k = 2 * m * w * w, eta = 2 * damping * k / w;
  for (int dim : {2, 3}) {
    OneContact one("CriticalVoigt", {{"mu", 0.5}, {"period", period}, {"damping", damping}, {"ratio", ratio}}, dim, h,
                   0);
    std::fill_n(one.gap, one.n, -1e-4);
    for (int step = 0; step < 3; ++step) {
      one.advance({-0.1, 0.02, 0});
      EXPECT_NEAR(one.u[0], 0, 1e-15) << step;
      EXPECT_NEAR(one.u[1], 0, 1e-15) << step;
    }
    double lag = 0;
    for (int step = 0; step < 40; ++step) {
      const double g = one.gap[0], free = -1e-2, along = step < 20 ? 1e-3 : -2e-2;
      one.advance({free, along, 0});
      const double un = (free - h * k * g / m) / (1 + h * (h * k + eta) / m);
      ASSERT_NEAR(one.u[0], un, 1e-14) << step;
      ASSERT_NEAR(one.r[0], -h * (k * (g + h * un) + eta * un), 1e-13) << step;
      const double ut = (along - h * ratio * k * lag / m) / (1 + h * ratio * (h * k + eta) / m), rt = m * (ut - along);
      if (std::abs(rt) <= 0.5 * one.r[0]) {
        ASSERT_NEAR(one.r[1], rt, 1e-14) << step;
        lag += h * ut;
      } else {
        ASSERT_NEAR(one.r[1], std::copysign(0.5 * one.r[0], rt), 1e-14) << step;
        lag = (eta * lag - one.r[1] / ratio) / (k * h + eta);
      }
    }
    EXPECT_GT(one.gap[0], -1e-4);                                    // less than its initial overlap
    EXPECT_NEAR(one.r[0], -one.h * k * one.gap[0], 1e-2 * one.r[0]); // at rest on its spring
    one.advance({1, 0, 0});
    EXPECT_EQ(one.r[0], 0);
    std::fill_n(one.gap, one.n, -1e-4);
    one.advance({-1, 0, 0});
    EXPECT_NEAR(one.u[0], 0, 1e-15); // an impact again
  }
}

} // namespace
} // namespace cairn
