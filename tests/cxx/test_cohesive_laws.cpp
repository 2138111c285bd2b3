// Cohesive zones on one contact, by a machine a million times as stiff: curves and works against their closed forms.
#include <random>
#include <tuple>

#include "one_contact.hpp"

namespace cairn {
namespace {

// Opened by lengths, by a machine a million times as stiff as the law. Stress [Pa] and works [J/m2] of what the law
// gives.
struct Contact : test::OneContact {
  double stress[3] = {0, 0, 0}, pressure = 0, work = 0, stored = 0, taken = 0, released = 0;
  Contact(const std::string& name, const Values& given, int dim = 2, double h = 1e-5)
      : OneContact(name, given, dim, h) {}
  void step(double normal, double tangent, double second = 0) {
    std::fill_n(w, c, 1e-6 / (area * h * h * params[0]));
    std::vector<double> free = {normal / h - w[0] * pressure * area * h, tangent / h, second / h};
    advance(free);
    for (int k = 0; k < c; ++k) stress[k] = -r[k] / (area * h);
    work = OneContact::work / area;
    stored = OneContact::stored / area;
    taken = OneContact::taken / area;
    released = OneContact::released / area;
  }
  double beta() const { return state[0]; }
};

const std::map<std::string, double> modes = {{"normal_stiffness", 1e12}, {"tangential_stiffness", 5e11},
                                             {"normal_strength", 2e6},   {"tangential_strength", 3e6},
                                             {"normal_work", 10},        {"tangential_work", 30}};
std::map<std::string, double> with(std::map<std::string, double> all, const std::map<std::string, double>& more) {
  for (const auto& [word, value] : more) all[word] = value;
  return all;
}

// sigma = c u to u0 = sqrt(w/c), w^2/(c u^3) behind it; w (1 - 1/(2 n^2)) to n u0.
TEST(Mac, HoldsItsCurve) {
  Contact one("MAC", {{"normal_stiffness", 1e12}, {"tangential_stiffness", 1e12}, {"work", 10}});
  double peak = 0;
  const double u0 = std::sqrt(10 / 1e12), step = 20e-9;
  for (int k = 1; k * step < 12.65 * u0; ++k) {
    one.step(step, 0);
    const double u = one.gap[0], exact = u < u0 ? 1e12 * u : 100 / (1e12 * u * u * u);
    ASSERT_NEAR(one.stress[0], exact, 2e-4 * 3.2e6) << u / u0;
    ASSERT_LE(one.residual, 1e-11 * 3.2e6 * one.area * one.h) << u / u0;
    peak = std::max(peak, one.stress[0]);
  }
  const double n = one.gap[0] / u0;
  EXPECT_NEAR(peak, 3.1622777e6, 2e-3 * peak);
  EXPECT_NEAR(one.released + one.stored, 10 * (1 - 1 / (2 * n * n)), 1e-6);
  EXPECT_NEAR(one.taken, one.released + one.stored, 1e-12 * one.taken);
  EXPECT_NEAR(one.work, 10 * (1 - 1 / (2 * n * n)), 0.02); // of first order in the step
}

// A line of the machine's stress that meets the curve three times: twice where the contact holds, and once where it is
// broken. The solution with the largest adhesion is taken, also by sweeps, whose blocks are those of a small body.
TEST(Mal, HoldsWhereBreakingIsAnAnswerToo) {
  for (const int dim : {2, 3})
    for (const double direction : {0.0, 1.0}) { // mode I, mode II of the same numbers
      Contact one("MAL",
                  {{"normal_stiffness", 1e12},
                   {"tangential_stiffness", 1e12},
                   {"normal_strength", 2e6},
                   {"tangential_strength", 2e6},
                   {"normal_work", 10},
                   {"tangential_work", 10}},
                  dim);
      const double machine = 2.05e6 / 7e-6, far = 9e-6; // Pa/m; beyond 8e-6, where the curve ends
      std::fill_n(one.w, one.c, 1 / (machine * one.area * one.h * one.h));
      std::vector<double> free = {(1 - direction) * far / one.h, direction * far / one.h, 0};
      one.advance(free);
      const double stress = -one.r[direction > 0 ? 1 : 0] / (one.area * one.h), opening = far - stress / machine;
      EXPECT_GT(one.beta(), 0.5);
      EXPECT_NEAR(stress, 2e6 * (1 - std::pow((opening - 2e-6) / 6e-6, 2)), 1e-9 * 2e6);
      EXPECT_LE(one.residual, 1e-12 * 2e6 * one.area * one.h);
    }
}

struct Curve {
  const char* law;
  std::map<std::string, double> params;
  double work[3];           // mode I, 45 degrees, mode II
  double first[3], last[3]; // openings where damage begins and ends
};
const double root = std::sqrt(2.0);
const Curve curves[] = {
    {"MP",
     {{"normal_stiffness", 1e12}, {"tangential_stiffness", 1e12}, {"work", 10}},
     {10, 10, 10},
     {2.406036e-6, 2.406036e-6, 2.406036e-6},
     {3 * 2.406036e-6, 3 * 2.406036e-6, 3 * 2.406036e-6}},
    {"MP3",
     {{"normal_stiffness", 1e12}, {"tangential_stiffness", 1e12}, {"strength", 2e6}, {"work", 10}},
     {10, 10, 10},
     {2e-6, 2e-6, 2e-6},
     {8e-6, 8e-6, 8e-6}},
    {"MAL", modes, {10, 12.857143, 30}, {2e-6, 2.683282e-6, 6e-6}, {8e-6, 10.253969e-6, 16.5e-6}},
    {"TH",
     with(modes, {{"normal_plateau", 4e-6}, {"tangential_plateau", 8e-6}}),
     {10, 12.857143, 30},
     {2e-6, 2.683282e-6, 6e-6},
     {8e-6, 10.401169e-6, 18e-6}},
    {"ABP",
     with(modes, {{"normal_end", 40e-6}, {"tangential_end", 80e-6}, {"first_share", 0.3}}),
     {10, 12.857143, 30},
     {2e-6, 2.683282e-6, 6e-6},
     {40e-6, 0, 80e-6}},
    {"EXPO", with(modes, {{"rest", 1e-3}}), {9.992, 0, 29.979}, {2e-6, 2.683282e-6, 6e-6}, {29.631e-6, 0, 54.354e-6}},
};
class CohesiveCurve : public testing::TestWithParam<Curve> {};

TEST_P(CohesiveCurve, TakesItsWorkInEveryMode) {
  const Curve& given = GetParam();
  for (int mode = 0; mode < 3; ++mode) {
    Contact one(given.law, given.params);
    const double step = 10e-9, along[3][2] = {{1, 0}, {1 / root, 1 / root}, {0, 1}};
    double begun = 0, ended = 0, before = 1, opening = 0;
    for (int k = 1; k < 12000 && one.beta() > 0; ++k) {
      one.step(step * along[mode][0], step * along[mode][1]);
      opening = k * step;
      ASSERT_LE(one.beta(), before);
      ASSERT_LE(one.residual, 1e-10 * 3e6 * one.area * one.h);
      if (one.beta() < 1 && begun <= 0) begun = opening;
      if (!(one.beta() > 0)) ended = opening;
      before = one.beta();
    }
    EXPECT_EQ(one.beta(), 0) << given.law << mode;
    EXPECT_NEAR(begun, given.first[mode], 2 * step) << given.law << mode;
    if (given.last[mode] > 0) { EXPECT_NEAR(ended, given.last[mode], 2 * step) << given.law << mode; }
    if (given.work[mode] > 0) {
      EXPECT_NEAR(one.released, given.work[mode], 1e-3 * given.work[mode]) << given.law << mode;
      EXPECT_NEAR(one.work, given.work[mode], 1e-2 * given.work[mode]) << given.law << mode;
    }
    EXPECT_NEAR(one.taken, one.released, 1e-12 * one.taken);
  }
}

// The secant leads back to the origin, damage does not heal, and coming back to where it was finds the same stress.
TEST_P(CohesiveCurve, UnloadsAlongTheSecant) {
  const Curve& given = GetParam();
  Contact one(given.law, given.params);
  const double step = 10e-9;
  const int far = int(1.5 * given.first[0] / step);
  for (int k = 0; k < far; ++k) one.step(step, 0);
  const double top = one.stress[0], opened = one.gap[0], beta = one.beta(), spent = one.released;
  EXPECT_LT(beta, 1);
  EXPECT_GT(beta, 0);
  for (int k = 0; k < far - 1; ++k) {
    one.step(-step, 0);
    ASSERT_NEAR(one.stress[0], top * one.gap[0] / opened, 1e-5 * top);
    ASSERT_EQ(one.beta(), beta);
  }
  EXPECT_NEAR(one.stored, 0, 1e-4);
  for (int k = 0; k < far - 2; ++k) one.step(step, 0);
  ASSERT_NEAR(one.stress[0], top * one.gap[0] / opened, 1e-5 * top);
  EXPECT_EQ(one.released, spent);
}
INSTANTIATE_TEST_SUITE_P(All, CohesiveCurve, testing::ValuesIn(curves),
                         [](const auto& info) { return std::string(info.param.law); });

// tau = beta c_T d + mu (1 - beta) p; work to 20 micrometres 30.47419.
TEST(Mal, SlidesUnderPressure) {
  Contact one("MAL", with(modes, {{"mu", 0.5}}));
  one.pressure = 1e5;
  const double step = 5e-9;
  for (int k = 0; k < 4000; ++k) {
    const double was = one.beta(), slip = (k + 1) * step;
    one.step(0, step);
    if (was > 0) { ASSERT_NEAR(one.stress[1], one.beta() * 5e11 * slip + 0.5 * (1 - one.beta()) * 1e5, 3e-3 * 3e6); }
  }
  EXPECT_NEAR(one.work, 30.47419, 5e-3 * 30);
  EXPECT_NEAR(one.stress[1], 0.5 * 1e5, 1e-3 * 1e5);
  EXPECT_NEAR(one.released, 30, 1e-3 * 30);
}

// In space the slip turns with its direction: the curve is that of its length.
TEST(Mal, SlidesAnywhereInItsPlane) {
  Contact plane("MAL", modes), space("MAL", modes, 3);
  for (int k = 0; k < 1000; ++k) {
    plane.step(5e-9, 1e-8);
    space.step(5e-9, 0.6e-8, -0.8e-8);
    ASSERT_NEAR(plane.beta(), space.beta(), 1e-9);
    ASSERT_NEAR(plane.stress[1], std::hypot(space.stress[1], space.stress[2]), 1e-6 * 3e6);
  }
  EXPECT_LT(plane.beta(), 0.9);
}

// Full blocks, sound, half broken and broken, pushed and pulled: each local solution satisfies its own residual.
TEST(OwnSolutions, SatisfyTheirLawOnFullBlocks) {
  constexpr int n = 64;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> some(-1, 1);
  for (const LawInfo& law : law_infos())
    for (int dim : {2, 3}) {
      const int c = law.components(dim);
      if (law.plugged() || !law.solve || !law.residual || c == 0) continue;
      const std::size_t own = law.parameters.size(), columns = std::size_t(geometry_columns(law));
      std::vector<double> w(n * c * c), q(n * c), bias(n * c, 0.0), params((own + 1 + columns) * n), r(n * c, 0.0),
          u(n * c), f(n * c), weight(n * c), rho(n), state(std::size_t(std::max(1, law.state_columns(dim)) * n), 0.0),
          gap(n), extra(n * c), mu(n), zero(n * c, 0.0), geometry(columns * n, 1.0);
      if (rolls(law)) std::fill_n(&geometry[4 * n], n, 0.0); // radii of rolling about t t and s s, none about t s
      std::int32_t status[n];
      const double h = 1e-3;
      for (int i = 0; i < n; ++i) {
        double root[6][6];
        for (auto& line : root)
          for (double& x : line) x = some(random);
        for (int k = 0; k < c; ++k)
          for (int l = 0; l < c; ++l) {
            double sum = k == l ? 0.3 : 0;
            for (int m = 0; m < c; ++m) sum += root[k][m] * root[l][m];
            w[n * (l * c + k) + i] = sum;
          }
        for (int k = 0; k < c; ++k) q[k * n + i] = some(random);
        rho[i] = 1 / w[i];
        gap[i] = i % 2 ? 1e-4 * (1 + some(random)) : 0;
        for (std::size_t p = 0; p < own; ++p)
          params[p * n + i] = law.parameters[p].required ? 1 : law.parameters[p].standard;
        for (std::size_t p = 0; p < own; ++p) {
          const std::string& name = law.parameters[p].name;
          if (name.find("stiffness") != std::string::npos) params[p * n + i] = 3e5 * (2 + some(random));
          if (name.find("strength") != std::string::npos) params[p * n + i] = 200;
          if (name == "mu") params[p * n + i] = 0.4;
          if (name == "first_share") params[p * n + i] = 0.4;
          params[p * n + i] = std::min(params[p * n + i], 1e300);
        }
        params[own * n + i] = h;
        for (std::size_t k = 0; k < columns; ++k) params[(own + 1 + k) * n + i] = geometry[k * n + i];
        state[i] = i % 3 ? 1 : 0;
      }
      const cairn_law_context context{h, 0.5, geometry.data(), nullptr, 0};
      law.prepare(n, c, &context, gap.data(), zero.data(), params.data(), state.data(), bias.data(), extra.data(),
                  mu.data());
      for (int k = 0; k < n * c; ++k) q[k] += bias[k];
      law.solve(n, c, w.data(), q.data(), bias.data(), params.data(), state.data(), r.data(), status);
      for (int i = 0; i < n; ++i)
        for (int k = 0; k < c; ++k) {
          u[k * n + i] = q[k * n + i];
          for (int l = 0; l < c; ++l) u[k * n + i] += w[n * (l * c + k) + i] * r[l * n + i];
        }
      law.residual(n, c, &context, rho.data(), w.data(), u.data(), bias.data(), r.data(), params.data(), state.data(),
                   f.data(), weight.data(), status);
      double before = 0;
      for (int k = 0; k < n * c; ++k) EXPECT_NEAR(f[k], 0, 1e-9) << law.name << " " << dim << "D, contact " << k % n;
      // and another velocity does not
      for (int k = 0; k < n * c; ++k) u[k] += 0.1;
      law.residual(n, c, &context, rho.data(), w.data(), u.data(), bias.data(), r.data(), params.data(), state.data(),
                   f.data(), weight.data(), status);
      for (int k = 0; k < n * c; ++k) before = std::max(before, std::abs(f[k]));
      EXPECT_GT(before, 1e-3) << law.name;
    }
}

TEST(Mac, IsTheSameInUnitsOfPowersOfTwo) {
  const auto run = [](double length) {
    Contact one("MAC", {{"normal_stiffness", 1e12 / length},
                        {"tangential_stiffness", 0.7e12 / length},
                        {"work", 10 * length},
                        {"mu", 0.3}});
    one.area *= length * length;
    for (int k = 0; k < 400; ++k) one.step(2e-8 * length, 1e-8 * length);
    return one.beta();
  };
  EXPECT_EQ(run(1), run(1024));
  EXPECT_LT(run(1), 0.5);
}

} // namespace
} // namespace cairn
