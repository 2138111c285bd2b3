// Kinds of side: gather and scatter are transposes of each other, and the Delassus block is one after the other.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "solvers/sweeps/contact_system.hpp"
#include "solvers/sweeps/side_names.hpp"

namespace cairn::test {
namespace {

struct Case {
  Side side;
  int dim, c;
};

class Sides : public testing::TestWithParam<Case> {
protected:
  static constexpr int n = 16;
  void SetUp() override {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    const auto [side, dim, c] = GetParam();
    const cairn_side& s = sides()[side];
    v.resize(n * s.width);
    frame.resize(n * (dim == 2 ? 2 : 6));
    lever.resize(n * s.lever);
    for (double& x : v) x = normal(random);
    for (double& x : lever) x = normal(random);
    for (int i = 0; i < n; ++i) {
      double a[3] = {normal(random), normal(random), normal(random)}, t[3];
      if (dim == 2) a[2] = 0;
      const double size = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
      for (double& x : a) x /= size;
      for (int k = 0; k < dim; ++k) frame[k * n + i] = a[k];
      if (dim == 3) {
        t[0] = -a[1], t[1] = a[0], t[2] = 0;
        const double width = std::hypot(t[0], t[1]);
        for (int k = 0; k < 3; ++k) frame[(3 + k) * n + i] = t[k] / width;
      }
      // masses of the kind: isotropic, or per axis with a full inverse inertia, positive definite
      const double m = 0.5 + std::abs(normal(random)), j = 0.5 + std::abs(normal(random));
      if (dim == 2) {
        set(i, {{3, m}, {4, side == rigid2 ? 2 * m : m}, {5, j}});
      } else {
        set(i, {{6, m}, {7, j}});
        if (side == rigid3)
          set(i, {{8, 2 * m}, {9, 0}, {10, 2 + j}, {11, 3}, {12, 4}, {13, 0.5}, {14, -0.3}, {15, 0.2}});
      }
    }
  }
  void set(int i, std::vector<std::pair<int, double>> numbers) {
    for (auto [k, x] : numbers) v[k * n + i] = x;
  }
  std::vector<double> gather(const std::vector<double>& at, double sign) const {
    const auto [side, dim, c] = GetParam();
    std::vector<double> u(n * c, 0.0);
    sides()[side].gather(n, c, sides()[side].width, sign, at.data(), frame.data(), lever.data(), u.data());
    return u;
  }
  std::vector<double> scatter(const std::vector<double>& r, double sign) const {
    const auto [side, dim, c] = GetParam();
    std::vector<double> at = v;
    const int velocities = dim == 2 ? 3 : 6;
    std::fill(at.begin(), at.begin() + n * velocities, 0.0);
    sides()[side].scatter(n, c, sides()[side].width, sign, r.data(), frame.data(), lever.data(), at.data());
    return at;
  }
  std::vector<double> v, frame, lever;
};

TEST_P(Sides, DelassusIsGatherAfterScatter) {
  const auto [side, dim, c] = GetParam();
  const cairn_side& s = sides()[side];
  std::vector<double> w(n * c * c, 0.0);
  s.delassus(n, c, s.width, 2.0, v.data(), frame.data(), lever.data(), w.data());
  for (int l = 0; l < c; ++l) {
    std::vector<double> r(n * c, 0.0);
    std::fill(r.begin() + l * n, r.begin() + (l + 1) * n, 1.0);
    for (double sign : {1.0, -1.0}) {
      const std::vector<double> u = gather(scatter(r, sign), sign);
      for (int k = 0; k < c; ++k)
        for (int i = 0; i < n; ++i) EXPECT_NEAR(2 * u[k * n + i], w[(l * c + k) * n + i], 1e-13) << k << ' ' << l;
    }
  }
}

// power of an impulse in the velocity it gives = twice the kinetic energy of that velocity
TEST_P(Sides, ScatterIsTheTransposeOfGather) {
  const auto [side, dim, c] = GetParam();
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  std::vector<double> r(n * c);
  for (double& x : r) x = normal(random);
  const std::vector<double> at = scatter(r, 1), u = gather(at, 1);
  for (int i = 0; i < n; ++i) {
    double power = 0, twice = 0;
    for (int k = 0; k < c; ++k) power += r[k * n + i] * u[k * n + i];
    const auto x = [&](int k) { return at[k * n + i]; };
    if (dim == 2) {
      twice = x(0) * x(0) / x(3) + x(1) * x(1) / x(4) + x(2) * x(2) / x(5);
      EXPECT_NEAR(power, twice, 1e-12 * std::abs(power));
    } else if (side == radial3) {
      for (int k = 0; k < 3; ++k) twice += x(k) * x(k) / x(6) + x(3 + k) * x(3 + k) / x(7);
      EXPECT_NEAR(power, twice, 1e-12 * std::abs(power));
    } else {
      EXPECT_EQ(x(2), 0) << "a blocked direction does not move";
      EXPECT_GT(power, 0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, Sides,
                         testing::Values(Case{radial2, 2, 2}, Case{radial2, 2, 3}, Case{rigid2, 2, 2},
                                         Case{rigid2, 2, 3}, Case{radial3, 3, 3}, Case{radial3, 3, 6},
                                         Case{rigid3, 3, 3}, Case{rigid3, 3, 6}));

} // namespace
} // namespace cairn::test
