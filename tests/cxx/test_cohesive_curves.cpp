// Cohesive zones against closed forms written down a second time, as papers and LMGC90 have them: stress along the
// whole curve in every mode, the work of every part of it, any path, friction beside damage, viscosity.
#include <functional>
#include <random>
#include <tuple>

#include "one_contact.hpp"

namespace cairn {
namespace {

using Values = test::OneContact::Values;

const double c_n = 1e12, c_t = 5e11;
const Values springs = {{"normal_stiffness", c_n}, {"tangential_stiffness", c_t}};
const double s_1 = 2e6, s_2 = 3e6, g_1 = 10, g_2 = 30;
Values modes(Values more) {
  more.insert(springs.begin(), springs.end());
  for (const auto& [word, value] :
       Values{{"normal_strength", s_1}, {"tangential_strength", s_2}, {"normal_work", g_1}, {"tangential_work", g_2}})
    more[word] = value;
  return more;
}
Values one_work(Values more) {
  more.insert(springs.begin(), springs.end());
  more["work"] = 10;
  return more;
}

// Mixed-mode value at t = d_T/d_N from those of both modes: openings at the onset of damage and, for TH and ABP, at the
// end of a line; stiffness; work.
double mixed(double t, double one, double two) {
  return one * two * std::sqrt((1 + t * t) / (two * two + t * t * one * one));
}
double stiffness(double t) { return (c_n + c_t * t * t) / (1 + t * t); }
double first(double t) { return mixed(t, s_1 / c_n, s_2 / c_t); }
double g_hat(double t) { return (g_2 * c_n + g_1 * c_t * t * t) / (1 + t * t); }
double work_of(double t) { return g_1 * g_2 * stiffness(t) / g_hat(t); }

struct Law {
  const char* name;
  Values params;
  bool square;                                // whether springs go with beta^2
  std::function<double(double, double)> beta; // of t and an opening, for proportional opening
  double far;                                 // an opening behind most of its work [m]
};
void PrintTo(const Law& law, std::ostream* out) { *out << law.name; }
const Law laws[] = {
    {"MAC", one_work({}), true, [](double t, double d) { return 10 / (stiffness(t) * d * d); }, 30e-6},
    {"MP", one_work({}), false,
     [](double t, double d) {
       const double i = std::sqrt(20 / stiffness(t) / (9 - 4 * std::log(4)));
       return (3 * i - d) / (i + d);
     },
     12e-6},
    {"MP3", one_work({{"strength", 2e6}}), false,
     [](double t, double d) {
       const double i = 2e6 / stiffness(t), k = 1.5 * (10 / 2e6 - i / 2);
       return i / d * (1 - std::pow((d - i) / k, 2));
     },
     12e-6},
    {"MAL", modes({}), false,
     [](double t, double d) {
       const double i = first(t), k = 1.5 * (g_1 * g_2 - i * i * g_hat(t) / 2) / (i * g_hat(t));
       return i / d * (1 - std::pow((d - i) / k, 2));
     },
     20e-6},
    {"TH", modes({{"normal_plateau", 4e-6}, {"tangential_plateau", 8e-6}}), false,
     [](double t, double d) {
       const double i = first(t), p = mixed(t, 4e-6, 8e-6), all = c_n * g_2 + t * t * c_t * g_1;
       const double u = (2 * g_1 * g_2 * (1 + t * t) - i * (p - i) * all) / (i * all);
       return i / d * (d < p ? 1 : (u - d) / (u - p));
     },
     20e-6},
    {"ABP", modes({{"normal_end", 40e-6}, {"tangential_end", 80e-6}, {"first_share", 0.3}}), false,
     [](double t, double d) {
       const double i = first(t), s = stiffness(t) * i, end = mixed(t, 40e-6, 80e-6);
       const double knee = 2 * work_of(t) * 0.7 / end, at = (2 * work_of(t) * 0.3 + knee * i) / s;
       return (d < at ? s - (s - knee) * (d - i) / (at - i) : knee * (end - d) / (end - at)) / (stiffness(t) * d);
     },
     90e-6},
    {"EXPO", modes({{"rest", 1e-3}}), false,
     [](double t, double d) {
       const double i = first(t), rate = stiffness(t) * i / (work_of(t) - stiffness(t) * i * i / 2);
       return d > i - std::log(1e-3) / rate ? 0 : i / d * std::exp(rate * (i - d));
     },
     60e-6},
    {"PlasticEXPO", modes({{"rest", 1e-3}}), false,
     [](double t, double d) {
       const double i = first(t), rate = stiffness(t) * i / (work_of(t) - stiffness(t) * i * i / 2);
       return d > i - std::log(1e-3) / rate ? 0 : i / d * std::exp(rate * (i - d));
     },
     60e-6},
    {"MACContact", one_work({}), true, [](double t, double d) { return 10 / (stiffness(t) * d * d); }, 30e-6},
};
double beta_at(const Law& law, double t, double d) { return d > 0 ? std::clamp(law.beta(t, d), 0.0, 1.0) : 1.0; }

// Opened by lengths, by a machine a million times as stiff as the zone. Stress [Pa], opening [m], energies [J/m2].
struct Zone : test::OneContact {
  double stress[3] = {0, 0, 0}, open[3] = {0, 0, 0}, pressure = 0;
  Zone(const Law& law, Values more = {}, int dim = 2, double h = 1e-5)
      : OneContact(law.name, both(law, more), dim, h) {}
  static Values both(const Law& law, Values more) {
    more.insert(law.params.begin(), law.params.end());
    return more;
  }
  void step(double normal, double tangent, double second = 0) {
    std::fill_n(w, c, 1e-6 / (area * h * h * c_n));
    advance({normal / h - w[0] * pressure * area * h, tangent / h, second / h});
    for (int k = 0; k < c; ++k) stress[k] = -r[k] / (area * h), open[k] += h * u[k];
  }
  void go_to(double normal, double tangent, double second = 0) {
    step(normal - open[0], tangent - open[1], second - open[2]);
  }
  double beta() const { return state[0]; }
  double spent() const { return released / area; }
};

class Curves : public testing::TestWithParam<Law> {};

// Stress and spent work along the curve from mode I to mode II; work by the trapezoidal rule over the closed form.
TEST_P(Curves, HaveTheirStressAndWorkInEveryMode) {
  const Law& law = GetParam();
  const double peak = 3.2e6;
  for (const double degrees : {0.0, 20.0, 45.0, 70.0, 90.0})
    for (const int dim : {2, 3}) {
      Zone one(law, {}, dim);
      const double angle = degrees / 180 * std::acos(-1.0), t = std::tan(angle), turn = dim == 3 ? 0.6 : 1;
      double due = 0, before = 0, at = 0;
      for (int k = 1; k <= 1500; ++k) {
        const double d = law.far * k / 1500;
        one.go_to(d * std::cos(angle), d * std::sin(angle) * turn, -d * std::sin(angle) * 0.8);
        const double now = std::hypot(one.open[0], std::hypot(one.open[1], one.open[2])),
                     mode = degrees > 89 ? 1e12 : t;
        const double beta = beta_at(law, mode, now), by = law.square ? beta * beta : beta;
        ASSERT_NEAR(one.beta(), beta, 1e-6) << law.name << degrees << " " << now;
        ASSERT_NEAR(one.stress[0], by * c_n * one.open[0], 2e-5 * peak) << law.name << degrees << " " << now;
        ASSERT_NEAR(std::hypot(one.stress[1], one.stress[2]), by * c_t * std::hypot(one.open[1], one.open[2]),
                    2e-5 * peak)
            << law.name << degrees << " " << now;
        for (int part = 1; part <= 8; ++part) { // finer than its steps
          const double next = at + (now - at) * part / 8, b = beta_at(law, mode, next);
          const double stress = (law.square ? b * b : b) * stiffness(mode) * next;
          due += (stress + before) / 2 * (now - at) / 8;
          before = stress;
        }
        at = now;
        const double stored = by * stiffness(mode) * now * now / 2;
        ASSERT_NEAR(one.stored / one.area, stored, 1e-4 * g_2) << law.name << degrees << " " << now;
        ASSERT_NEAR(one.spent(), due - stored, 1e-4 * g_2) << law.name << degrees << " " << now;
      }
      EXPECT_LT(one.beta(), 0.1) << law.name << degrees;
    }
}

// Opened, closed, turned and opened again: beta is the least that any opening allowed, damage dissipates irreversibly,
// and the work along the path is stored or dissipated.
TEST_P(Curves, KeepTheirDamageOnAnyPath) {
  const Law& law = GetParam();
  for (const int dim : {2, 3})
    for (unsigned seed : {1u, 2u, 3u}) {
      std::mt19937 random(seed);
      std::uniform_real_distribution<double> some(-1, 1);
      Zone one(law, {}, dim);
      double least = 1, spent = 0, to[3] = {0, 0, 0};
      int held = 0, fell = 0;
      for (int leg = 0; leg < 60; ++leg) {
        const double from[3] = {one.open[0], one.open[1], one.open[2]}, far = law.far * (leg + 1) / 100;
        for (double& x : to) x = far * some(random);
        to[0] = std::max(to[0], 0.0);
        for (int k = 1; k <= 20; ++k) {
          double x[3];
          for (int l = 0; l < 3; ++l) x[l] = from[l] + (to[l] - from[l]) * k / 20;
          one.go_to(x[0], x[1], dim == 3 ? x[2] : 0);
          const double opening = std::max(one.open[0], 0.0), slip = std::hypot(one.open[1], dim == 3 ? one.open[2] : 0);
          const double allowed = beta_at(law, slip / std::max(opening, 1e-12 * slip), std::hypot(opening, slip));
          ++(allowed < least ? fell : held);
          least = std::min(least, allowed);
          ASSERT_NEAR(one.beta(), least, 1e-6) << law.name;
          const double by = law.square ? least * least : least;
          ASSERT_NEAR(one.stress[0], by * c_n * opening, 3e-5 * 3.2e6) << law.name;
          ASSERT_NEAR(one.stress[1], by * c_t * one.open[1], 3e-5 * 3.2e6) << law.name;
          ASSERT_GE(one.spent(), spent) << law.name;
          if (allowed > least + 1e-6) { ASSERT_EQ(one.spent(), spent) << law.name; }
          spent = one.spent();
          ASSERT_NEAR(one.taken, one.stored + one.released, 1e-11 * std::max(one.taken, one.area)) << law.name;
        }
      }
      EXPECT_GT(held, 500) << law.name;
      EXPECT_GT(fell, 20) << law.name;
      EXPECT_LT(least, 0.5) << law.name;
      EXPECT_LE(spent, g_2 * (1 + 1e-9)) << law.name;
    }
}

// tau = phi c_T d + mu (1 - beta)^p of the pressure; p = 0: all of mu at once.
TEST_P(Curves, RubAsTheirDamageGrows) {
  const Law& law = GetParam();
  for (const double power : {0.0, 1.0, 2.5}) {
    Zone one(law, {{"mu", 0.5}, {"power", power}});
    one.pressure = 1e6;
    for (int k = 1; k <= 1000; ++k) {
      one.go_to(0, law.far * k / 1000);
      const double beta = one.beta(), by = law.square ? beta * beta : beta;
      const double rubs = 0.5 * 1e6 * (power > 0 ? std::pow(1 - beta, power) : 1);
      ASSERT_NEAR(one.stress[1], by * c_t * one.open[1] + rubs, 3e-5 * 3.2e6) << law.name << power << " " << k;
      ASSERT_NEAR(beta, beta_at(law, 1e12, one.open[1]), 1e-6) << law.name << power << " " << k;
      ASSERT_NEAR(one.stress[0], -1e6, 1e-6 * 1e6);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, Curves, testing::ValuesIn(laws),
                         [](const auto& info) { return std::string(info.param.name); });

// Peak [Pa] and work [J/m2] of the whole curve by time steps that go to nothing: extrapolated from two steps to second
// order; the tail beyond a hundred u0 takes 5e-5 of w. With equal stiffnesses both modes agree.
TEST(ViscousMac, HasItsPeakAndItsWork) {
  for (const auto& [viscosity, speed, peak_due, work_due] :
       {std::tuple{1e-3, 1e-3, 3.1745e6, 10.244}, std::tuple{1e-3, 0.1, 3.984e6, 22.13},
        std::tuple{1e-2, 1e-3, 3.286e6, 12.017}, std::tuple{1e-2, 0.1, 6.444e6, 69.25}})
    for (const int along : {0, 1}) {
      double peak[2] = {0, 0}, work[2] = {0, 0};
      for (const int k : {0, 1}) {
        const double u0 = std::sqrt(10 / c_n);
        Law law = laws[0];
        law.params = {{"normal_stiffness", c_n}, {"tangential_stiffness", c_n}, {"work", 10}, {"viscosity", viscosity}};
        Zone one(law);
        while (one.open[along] < 100 * u0) {
          const double step = std::max(u0, one.open[along]) / 300 / (k + 1);
          one.h = step / speed;
          one.step(along == 0 ? step : 0, along == 1 ? step : 0);
          peak[k] = std::max(peak[k], one.stress[along]);
          ASSERT_NEAR(one.taken, one.stored + one.released, 1e-11 * one.taken);
        }
        work[k] = one.work / one.area;
      }
      EXPECT_NEAR(2 * peak[1] - peak[0], peak_due, 1e-3 * peak_due) << viscosity << " " << speed << " " << along;
      EXPECT_NEAR(2 * work[1] - work[0], work_due, 1e-3 * work_due) << viscosity << " " << speed << " " << along;
    }
}

} // namespace
} // namespace cairn
