// Local solutions of one contact against the law itself, on random blocks and at the ends of the range of friction.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "cairn/core.h"
#include "cairn/rows.h"
#include "contacts/interaction.hpp"
#include "laws/law_names.hpp"

namespace cairn::test {
namespace {

constexpr int n = 64;

struct Blocks {
  explicit Blocks(int c, double coupling, unsigned seed = 3) : c(c), w(n * c * c), q(n * c), zero(n * c, 0.0) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    for (int i = 0; i < n; ++i) {
      double m[6][6];
      for (int k = 0; k < c; ++k)
        for (int l = 0; l < c; ++l) m[k][l] = (k == l ? 1 : coupling) * normal(random);
      for (int k = 0; k < c; ++k)
        for (int l = 0; l < c; ++l) {
          double sum = k == l ? 0.01 : 0;
          for (int p = 0; p < c; ++p) sum += m[k][p] * m[l][p];
          at(k, l, i) = sum;
        }
      for (int k = 0; k < c; ++k) q[k * n + i] = normal(random);
    }
  }
  double& at(int k, int l, int i) { return w[(l * c + k) * n + i]; }
  int c;
  std::vector<double> w, q, zero;
};

// r in the cone, u_n >= 0, r_n u_n = 0, and slip against friction where friction is spent; relative to the sizes of the
// contact
double violation(Blocks& b, int axes, const std::vector<double>& r, int i, double mu) {
  double u[3] = {0, 0, 0}, size_q = 0, size_w = 0;
  for (int k = 0; k < axes; ++k) {
    u[k] = b.q[k * n + i];
    for (int l = 0; l < axes; ++l) {
      u[k] += b.at(k, l, i) * r[l * n + i];
      size_w += b.at(k, l, i) * b.at(k, l, i);
    }
    size_q += b.q[k * n + i] * b.q[k * n + i];
  }
  size_q = std::sqrt(size_q);
  const double rn = r[i], size_r = std::max(size_q / std::sqrt(size_w), std::abs(rn) * std::min(mu, 1.0));
  double rt = 0, ut = 0, work = 0;
  for (int k = 1; k < axes; ++k) {
    rt += r[k * n + i] * r[k * n + i];
    ut += u[k] * u[k];
    work += u[k] * r[k * n + i];
  }
  rt = std::sqrt(rt);
  ut = std::sqrt(ut);
  const double full = std::max(rt, size_r), limit = std::min(mu * rn, 1e300);
  double worst = std::max(-u[0] / size_q, -rn / full);
  if (rn > 0) worst = std::max(worst, std::abs(u[0]) / (size_q + std::sqrt(size_w) * full));
  worst = std::max(worst, (rt - limit) / full);
  if (rn > 0) {
    const double speed = size_q + std::sqrt(size_w) * full;
    worst = std::max(worst, (ut * rt + work) / (speed * full));       // against the slip
    if (rt < limit * (1 - 1e-9)) worst = std::max(worst, ut / speed); // sticks
  }
  return worst;
}

class Cone : public testing::TestWithParam<double> {};

TEST_P(Cone, FullBlocksObeyTheLaw) {
  const double mu = GetParam();
  const std::vector<double> friction(n, mu);
  for (int axes : {2, 3})
    for (double coupling : {0.0, 0.3, 1.0})
      for (unsigned seed = 1; seed < 20; ++seed) {
        Blocks b(axes, coupling, seed);
        std::vector<double> r(n * axes, 0.0);
        (axes == 2 ? cairn_cone_full2 : cairn_cone_full3)(n, axes, b.w.data(), b.q.data(), b.zero.data(),
                                                          friction.data(), nullptr, r.data(), nullptr);
        for (int i = 0; i < n; ++i)
          ASSERT_LT(violation(b, axes, r, i, mu), 1e-9) << axes << ' ' << coupling << ' ' << seed << ' ' << i;
      }
}

TEST_P(Cone, DiagonalBlocksAgreeWithFullOnes) {
  const double mu = GetParam();
  const std::vector<double> friction(n, mu);
  for (int axes : {2, 3}) {
    Blocks b(axes, 0);
    std::vector<double> w(2 * n), r(n * axes, 0.0), full(n * axes, 0.0);
    for (int i = 0; i < n; ++i) {
      w[i] = b.at(0, 0, i);
      w[n + i] = b.at(1, 1, i);
      if (axes == 3) b.at(2, 2, i) = b.at(1, 1, i);
    }
    (axes == 2 ? cairn_cone_full2 : cairn_cone_full3)(n, axes, b.w.data(), b.q.data(), b.zero.data(), friction.data(),
                                                      nullptr, full.data(), nullptr);
    (axes == 2 ? cairn_cone_isotropic2 : cairn_cone_isotropic3)(n, axes, w.data(), b.q.data(), b.zero.data(),
                                                                friction.data(), nullptr, r.data(), nullptr);
    for (std::size_t k = 0; k < r.size(); ++k) EXPECT_NEAR(r[k], full[k], 1e-12 * (1 + std::abs(r[k])));
  }
}

INSTANTIATE_TEST_SUITE_P(Friction, Cone,
                         testing::Values(0.0, 1e-6, 0.4, 1.0, 1e3, 1e12, std::numeric_limits<double>::max()));

TEST(Cone, TheCheckCanFail) {
  Blocks b(3, 0.3);
  const std::vector<double> friction(n, 0.4);
  std::vector<double> r(3 * n, 0.0);
  cairn_cone_full3(n, 3, b.w.data(), b.q.data(), b.zero.data(), friction.data(), nullptr, r.data(), nullptr);
  double worst = 0;
  for (int i = 0; i < n; ++i) worst = std::max(worst, violation(b, 3, r, i, 0.3));
  EXPECT_GT(worst, 1e-3);
}

TEST(Bonded, HoldsBondsAndLeavesTheOthersToTheCone) {
  for (int c : {3, 6}) {
    Blocks b(c, 0.3);
    const std::vector<double> mu(n, 0.4);
    std::vector<double> r(n * c, 0.0), state(2 * n, 0.0);
    for (int i = 0; i < n; ++i) state[i] = i % 2 ? 2 : 0;
    std::vector<std::int32_t> status(n);
    cairn_law_bonded_solve(n, c, b.w.data(), b.q.data(), b.zero.data(), mu.data(), state.data(), r.data(),
                           status.data());
    for (int i = 0; i < n; ++i) {
      if (i % 2) {
        EXPECT_EQ(status[i], cairn_bonded);
        for (int k = 0; k < c; ++k) {
          double u = b.q[k * n + i];
          for (int l = 0; l < c; ++l) u += b.at(k, l, i) * r[l * n + i];
          EXPECT_NEAR(u, 0, 1e-9);
        }
      } else {
        EXPECT_LT(violation(b, c == 3 ? 2 : 3, r, i, 0.4), 1e-9);
        for (int k = c == 3 ? 2 : 3; k < c; ++k) EXPECT_EQ(r[k * n + i], 0);
      }
    }
  }
}

// A contact whose row does not say so has no room for a compliance, and drops it.
TEST(LawTable, OnlyRowsThatSayItYield) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  constexpr int most = 32;
  for (const LawInfo& law : law_infos())
    for (int dim : {2, 3}) {
      const int c = law.components(dim);
      if (!law.prepare || law.yields || c == 0) continue;
      std::vector<double> gap(n), u(n * c), params(most * n), state(most * n), bias(n * c), compliance(n * c, 7.0),
          mu(n), geometry(3 * n, 1e-3);
      for (int i = 0; i < n; ++i) {
        gap[i] = 0.1 * uniform(random);
        for (int k = 0; k < c; ++k) u[k * n + i] = uniform(random);
        for (std::size_t p = 0; p < law.parameters.size(); ++p)
          params[p * n + i] =
              std::clamp(0.5 + 0.4 * uniform(random), law.parameters[p].smallest, law.parameters[p].largest);
        for (int p = 0; p < law.state_columns(dim); ++p) state[p * n + i] = i % 2 ? 1 : 0;
      }
      const cairn_law_context context{0.01, 0.5, geometry.data(), nullptr, 0};
      law.prepare(n, c, &context, gap.data(), u.data(), params.data(), state.data(), bias.data(), compliance.data(),
                  mu.data());
      for (double e : compliance) ASSERT_EQ(e, 0) << law.name << " in " << dim << "D: its row shall say YIELDS";
    }
}

TEST(LawTable, RefusesWhatIsOutOfRange) {
  LawTable laws({"rock", "steel"});
  const double mu = -0.1, three[] = {0.3, 1.5, 0.0};
  EXPECT_THROW(laws.set(0, 1, Law::signorini_coulomb, {&mu, 1}), std::invalid_argument);
  EXPECT_THROW(laws.set(0, 2, Law::frictionless, {}), std::invalid_argument);
  EXPECT_THROW(laws.set(0, 1, Law::newton_restitution, three), std::invalid_argument);
  EXPECT_THROW(laws.set(0, 1, Law::frictionless, {&mu, 1}), std::invalid_argument);
  EXPECT_EQ(laws.find(0, 1), -1);
  laws.set(0, 1, Law::frictionless, {});
  EXPECT_EQ(laws.find(1, 0), laws.find(0, 1));
  EXPECT_EQ(laws.find(1, 1), -1);
}

} // namespace
} // namespace cairn::test
