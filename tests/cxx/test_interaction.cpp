// Interactions against plain mechanics: velocities are what the impulses give, impulses obey their laws.
#include <gtest/gtest.h>

#include "cairn/core.h"
#include "contact_scene.hpp"

namespace cairn::test {
namespace {

struct Solution {
  std::vector<double> local, space, moment, velocity, dissipated;
  std::vector<std::int32_t> status;
};

Solution read(const Interactions& i, int dim) {
  Solution s;
  const std::size_t n = i.count();
  s.local.resize(dim * n);
  s.space.resize(dim * n);
  s.moment.resize((dim == 2 ? 1 : 3) * n);
  s.velocity.resize(dim * n);
  s.dissipated.resize(n);
  s.status.resize(n);
  i.impulse_local(s.local.data());
  i.impulse_space(s.space.data());
  i.moment_space(s.moment.data());
  i.relative_velocity(s.velocity.data());
  i.dissipated(s.dissipated.data());
  i.status(s.status.data());
  return s;
}

// largest difference between the velocity of bodies and what impulses at the contact points give them, / largest velocity
double velocity_defect(const ContactScene& s, const Solution& x) {
  const int nd = s.bodies.dofs(), rotations = s.dim == 2 ? 1 : 3;
  std::vector<double> v = {s.bodies.velocity_free.values.begin(), s.bodies.velocity_free.values.end()};
  for (std::int64_t c = 0; c < s.candidates.count; ++c) {
    const double* p = &s.candidates.point[s.dim * c];
    for (int side = 0; side < 2; ++side) {
      const std::int64_t b = *s.contactors.body[side ? s.candidates.contactor_b[c] : s.candidates.contactor_a[c]];
      const auto dv = s.inverse(b, s.torsor(b, p, &x.space[s.dim * c], &x.moment[rotations * c]));
      for (int k = 0; k < nd; ++k) v[nd * b + k] += (side ? -1 : 1) * dv[k];
    }
  }
  double worst = 0, size = 0;
  for (std::size_t k = 0; k < v.size(); ++k) {
    worst = std::max(worst, std::abs(v[k] - s.bodies.velocity.values[k]));
    size = std::max(size, std::abs(v[k]));
  }
  return worst / size;
}

// largest violation of Signorini-Coulomb, velocities over the largest velocity, impulses over the largest impulse
double law_defect(const ContactScene& s, const Solution& x, double mu) {
  double worst = 0, largest_r = 0;
  for (double r : x.local) largest_r = std::max(largest_r, std::abs(r));
  const int d = s.dim;
  for (std::int64_t c = 0; c < s.candidates.count; ++c) {
    const double* p = &s.candidates.point[d * c];
    const auto va = s.velocity_at(s.bodies.velocity, *s.contactors.body[s.candidates.contactor_a[c]], p);
    const auto vb = s.velocity_at(s.bodies.velocity, *s.contactors.body[s.candidates.contactor_b[c]], p);
    double un = std::max(s.candidates.gap[c], 0.0) / s.h, rn = 0, ut[3], rt[3], slip = 0, pull = 0, work = 0;
    for (int k = 0; k < d; ++k) {
      const double n = s.candidates.normal[d * c + k];
      rn += n * x.space[d * c + k];
    }
    double u_normal = 0;
    for (int k = 0; k < d; ++k) u_normal += s.candidates.normal[d * c + k] * (va[k] - vb[k]);
    un += u_normal;
    for (int k = 0; k < d; ++k) {
      const double n = s.candidates.normal[d * c + k];
      ut[k] = va[k] - vb[k] - n * u_normal;
      rt[k] = x.space[d * c + k] - n * rn;
      slip += ut[k] * ut[k];
      pull += rt[k] * rt[k];
      work += ut[k] * rt[k];
    }
    slip = std::sqrt(slip);
    pull = std::sqrt(pull);
    worst = std::max({worst, -un, -rn / largest_r, rn / largest_r * std::abs(un), (pull - mu * rn) / largest_r,
                      (slip * pull + work) / largest_r, (mu * rn - pull) / largest_r * slip});
  }
  return worst;
}

LawTable coulomb(double mu) {
  LawTable laws({"rock"});
  laws.set(0, 0, Law::signorini_coulomb, {&mu, 1});
  return laws;
}

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

} // namespace
} // namespace cairn::test
