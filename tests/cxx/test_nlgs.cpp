// The solver: the textbook's sweep has the same solution, and irrelevant choices do not change it.
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "cairn/core.h"
#include "contact_scene.hpp"
#include "contacts/interaction.hpp"
#include "solvers/sweeps/batch.hpp"

namespace cairn::test {
namespace {

// Velocities after many sweeps in the order of the candidates.
std::vector<double> plain_solution(const ContactScene& s, double mu, int sweeps) {
  const int dim = s.dim, nd = s.bodies.dofs();
  const std::int64_t n = s.candidates.count;
  std::vector<std::int32_t> body;
  std::vector<double> frame, lever, friction(n, mu), bias, m, j, r(dim * n, 0.0);
  std::vector<double> v(s.bodies.velocity_free.values.begin(), s.bodies.velocity_free.values.end());
  for (std::int64_t b = 0; b < s.bodies.count; ++b) {
    m.push_back(s.bodies.inverse_mass[b][0]);
    j.push_back(s.bodies.inverse_mass[b][nd - 1]);
  }
  for (std::int64_t i = 0; i < n; ++i) {
    const std::int32_t a = s.candidates.contactor_a[i], b = s.candidates.contactor_b[i];
    const double gap = s.candidates.gap[i], *f = &s.candidates.normal[dim * i];
    body.push_back(*s.contactors.body[a]);
    body.push_back(*s.contactors.body[b]);
    frame.insert(frame.end(), f, f + dim);
    if (dim == 3) { // any tangent
      const int k = std::abs(f[0]) < 0.5 ? 0 : 1;
      double t[3] = {0, 0, 0}, size = 0;
      t[k] = 1;
      for (int c = 0; c < 3; ++c) t[c] -= f[k] * f[c], size += t[c] * t[c];
      for (double& x : t) x /= std::sqrt(size);
      frame.insert(frame.end(), t, t + 3);
    }
    lever.push_back(-(*s.contactors.radius[a] + gap / 2));
    lever.push_back(*s.contactors.radius[b] + gap / 2);
    bias.push_back(std::max(gap, 0.0) / s.h);
  }
  const auto sweep = dim == 2 ? cairn_plain_sweep2 : cairn_plain_sweep3;
  for (int k = 0; k < sweeps; ++k)
    sweep(n, body.data(), frame.data(), lever.data(), friction.data(), bias.data(), m.data(), j.data(), v.data(),
          r.data());
  return v;
}

class Solver : public testing::TestWithParam<int> {
protected:
  int dim = GetParam();
  ContactScene scene(unsigned seed = 1) const { return heap(dim, dim == 2 ? 12 : 6, seed); }
};

TEST_P(Solver, FindsWhatTheTextbookFinds) {
  ContactScene s = scene();
  const std::vector<double> v = plain_solution(s, 0.4, 20000);
  Interactions i(dim);
  s.step(i, coulomb(0.4), {1e-12, 1, 50000, 1});
  double size = 0, worst = 0;
  for (std::size_t k = 0; k < v.size(); ++k) {
    size = std::max(size, std::abs(v[k]));
    worst = std::max(worst, std::abs(v[k] - s.bodies.velocity.values[k]));
  }
  EXPECT_LT(worst, 1e-9 * size);
}

// Sweeps of associated friction: impulses in the cone, velocities in its dual, nothing done by one on the other.
// Contacts that are not packed keep Coulomb's law, whose velocities are in the dual with mu |u_T| added to the normal.
TEST_P(Solver, SweepsOfAssociatedFrictionEndInTheDualCone) {
  const double mu = 0.4;
  ContactScene s = scene();
  Interactions i(dim);
  s.step(i, coulomb(mu), {1e-20, 1, 1, 1});
  ContactSystem& system = i.system();
  system.load(s.bodies.velocity_free);
  cairn_schedule schedule = system.schedule(1);
  cairn_add_impulses(&schedule);
  schedule.associated = 1;
  cairn_nlgs_sweep(20000, &schedule, system.change.data());
  double u[6 * 128], fastest = 0, outside = 0, done = 0, most_done = 0;
  int opened = 0, packed = 0;
  for (std::size_t k = 0; k < system.batches.size(); ++k) {
    const cairn_batch& b = system.batches[k];
    cairn_relative_velocities(&schedule, std::int32_t(k), 0, u);
    for (int lane = 0; lane < b.contacts; ++lane) {
      double slip = 0, push = 0, work = 0;
      const double r_n = at(b, b.r, lane, 0);
      for (int c = 1; c < dim; ++c) {
        const double u_t = u[c * b.count + lane], r_t = at(b, b.r, lane, c);
        slip += u_t * u_t;
        push += r_t * r_t;
        work += u_t * r_t;
      }
      slip = std::sqrt(slip);
      double normal = u[lane] + at(b, b.bias, lane, 0);
      if (!b.pack) normal += mu * slip;
      work += normal * r_n;
      EXPECT_LE(std::sqrt(push), mu * r_n * (1 + 1e-12));
      fastest = std::max({fastest, std::abs(normal), slip});
      outside = std::max(outside, mu * slip - normal);
      done = std::max(done, std::abs(work));
      most_done = std::max(most_done, r_n * fastest);
      packed += b.pack != 0;
      opened += b.pack != 0 && r_n > 0 && slip > 1e-6 * fastest;
    }
  }
  EXPECT_LT(outside, 1e-9 * fastest);
  EXPECT_LT(done, 1e-9 * most_done);
  EXPECT_GT(packed, 50);
  EXPECT_GT(opened, 3) << "some slip, and open by that";
}

TEST_P(Solver, GivesTheSameBitsFromAnyThreads) {
  std::vector<double> first;
  for (int threads : {1, 2, 3}) {
    ContactScene s = heap(dim, dim == 2 ? 60 : 12);
    Interactions i(dim);
    s.step(i, coulomb(0.4), {1e-20, 1, 50, threads});
    std::vector<double> v(s.bodies.velocity.values.begin(), s.bodies.velocity.values.end());
    if (first.empty()) first = v;
    EXPECT_GT(i.system().first_batch.size(), 2u) << "more than one task";
    EXPECT_EQ(std::memcmp(first.data(), v.data(), v.size() * sizeof(double)), 0) << threads;
  }
}

TEST_P(Solver, DoesNotSeeTheMargin) {
  double error[2];
  std::vector<double> v[2];
  ContactMemory given; // one set of impulses, far from the solution
  for (int k = 0; k < 2; ++k) {
    ContactScene s = scene();
    s.candidates = Candidates();
    s.detect_round(k ? 0.3 : 0.1);
    s.detect_floor(std::int32_t(s.contactors.count - 1), k ? 0.3 : 0.1);
    Interactions i(dim);
    if (k == 0) {
      s.step(i, coulomb(0.4), {1e-20, 1, 3, 1});
      i.commit();
      given = i.memory();
    }
    ContactScene r = scene();
    r.candidates = s.candidates;
    Interactions measured(dim);
    measured.restore(given);
    error[k] = r.step(measured, coulomb(0.4), {1e-20, 0, 0, 1}).error;
    Interactions j(dim);
    ContactScene t = scene();
    t.candidates = s.candidates;
    t.step(j, coulomb(0.4), {1e-10, 1, 20000, 1});
    v[k].assign(t.bodies.velocity.values.begin(), t.bodies.velocity.values.end());
  }
  EXPECT_GT(error[0], 1e-6);
  EXPECT_NEAR(error[1], error[0], 0.1 * error[0]);
  for (std::size_t k = 0; k < v[0].size(); ++k) EXPECT_NEAR(v[0][k], v[1][k], 1e-7);
}

// A contact whose own impulses and free velocity are rounding beside the others' is not the worst of all.
TEST_P(Solver, NamesNoContactOfNoWeightTheWorst) {
  ContactScene s = scene();
  Interactions i(dim);
  const SolveReport report = s.step(i, coulomb(0.4), {1e-12, 1, 50000, 1});
  EXPECT_LE(report.error, 1e-12);
  EXPECT_LT(report.worst_error, 1e-4) << "on the scale of the mean at least";
}

TEST_P(Solver, GoesOnFromItsMemoryWithTheSameBits) {
  ContactScene s = scene(), t = scene();
  Interactions i(dim), j(dim);
  for (auto* p : {&i, &j}) {
    ContactScene& x = p == &i ? s : t;
    x.step(*p, coulomb(0.4), {1e-4, 1, 1000, 1});
    p->commit();
  }
  Interactions restarted(dim);
  restarted.restore(j.memory());
  const SolveReport a = s.step(i, coulomb(0.4), {1e-6, 1, 1000, 1});
  const SolveReport b = t.step(restarted, coulomb(0.4), {1e-6, 1, 1000, 1});
  EXPECT_EQ(a.iterations, b.iterations);
  EXPECT_EQ(a.error, b.error);
  EXPECT_EQ(std::memcmp(s.bodies.velocity.values.data(), t.bodies.velocity.values.data(),
                        s.bodies.velocity.values.size() * sizeof(double)),
            0);
}

TEST_P(Solver, WarmStartSavesIterations) {
  ContactScene s = scene();
  Interactions i(dim);
  const std::vector<double> v(s.bodies.velocity.values.begin(), s.bodies.velocity.values.end());
  const int cold = s.step(i, coulomb(0.4), {1e-6, 1, 10000, 1}).iterations;
  i.commit();
  std::copy(v.begin(), v.end(), s.bodies.velocity.values.begin());
  EXPECT_LT(s.step(i, coulomb(0.4), {1e-6, 1, 10000, 1}).iterations, cold / 4);
}

TEST_P(Solver, SaysWhenItDidNotFinish) {
  ContactScene s = scene();
  Interactions i(dim);
  const SolveReport report = s.step(i, coulomb(0.4), {1e-12, 1, 3, 1});
  EXPECT_EQ(report.status, SolveStatus::iteration_limit);
  EXPECT_EQ(report.iterations, 3);
  EXPECT_GT(report.error, 1e-12);
  EXPECT_GE(report.worst_error, report.error);
  EXPECT_GE(report.worst_contact, 0);
  EXPECT_NE(report.hint.find("after 3 iterations"), std::string::npos) << report.hint;
}

TEST_P(Solver, SaysWhenNumbersAreNone) {
  ContactScene s = scene();
  s.bodies.velocity_free[0][0] = std::numeric_limits<double>::quiet_NaN();
  Interactions i(dim);
  EXPECT_EQ(s.step(i, coulomb(0.4), {1e-6, 1, 100, 1}).status, SolveStatus::diverged);
}

TEST_P(Solver, RescalesWithItsUnits) {
  // mass 2^20, length 2^-7, time 2^4: every number of the solution is the same but for its power of two
  const double mass = 1048576, length = 1.0 / 128, time = 16;
  ContactScene s = scene(), t = scene();
  t.h *= time;
  for (std::int64_t b = 0; b < t.bodies.count; ++b)
    for (int k = 0; k < t.bodies.dofs(); ++k) {
      const double v = k < dim ? length / time : 1 / time;
      t.bodies.velocity[b][k] *= v;
      t.bodies.velocity_free[b][k] *= v;
      t.bodies.inverse_mass[b][k] /= k < dim ? mass : mass * length * length;
    }
  for (double& x : t.bodies.position.values) x *= length;
  for (double& x : t.contactors.radius.values) x *= length;
  for (double& x : t.candidates.gap) x *= length;
  for (double& x : t.candidates.point) x *= length;
  Interactions i(dim), j(dim);
  const SolveReport a = s.step(i, coulomb(0.4), {1e-8, 1, 1000, 1}), b = t.step(j, coulomb(0.4), {1e-8, 1, 1000, 1});
  EXPECT_EQ(a.iterations, b.iterations);
  EXPECT_EQ(a.error, b.error);
  EXPECT_EQ(a.worst_error, b.worst_error);
  const Solution x = read(i, dim), y = read(j, dim);
  for (std::size_t k = 0; k < x.local.size(); ++k) EXPECT_EQ(x.local[k] * (mass * length / time), y.local[k]);
}

// A lid that only moves down, on many grains: a hub on side A or B.
class Lid : public testing::TestWithParam<double> {};

TEST_P(Lid, IsCarried) {
  for (int dim : {2, 3}) {
    ContactScene s = heap(dim, dim == 2 ? 40 : 8);
    const double top = dim == 2 ? 40 - 0.45 : 8 - 0.5;
    std::vector<double> at(dim, 0.0);
    at[dim - 1] = top;
    const std::int32_t lid = s.add_body(at, 0, 0);
    s.bodies.inverse_mass[lid][dim - 1] = 1 / GetParam();
    s.bodies.velocity_free[lid][dim - 1] = -1;
    const std::int32_t wall = s.add_contactor(lid, dim == 2 ? Shape::half_plane : Shape::plane, 0);
    s.candidates = Candidates();
    s.detect_round(0.05);
    s.detect_floor(wall - 1, 0.05);
    int under = 0;
    for (std::int32_t c = 0; c < wall - 1; ++c) {
      const auto x = s.place(c);
      const double gap = std::max(top - x[dim - 1] - *s.contactors.radius[c], 0.0);
      if (gap > 0.2) continue;
      ++under;
      std::vector<double> n(dim, 0.0), p(x.begin(), x.begin() + dim);
      n[dim - 1] = c % 2 ? 1 : -1; // as either side
      p[dim - 1] += *s.contactors.radius[c] + gap / 2;
      if (c % 2)
        s.add_candidate(wall, c, gap, n, p);
      else
        s.add_candidate(c, wall, gap, n, p);
    }
    EXPECT_GT(under, 32);
    Interactions i(dim);
    const SolveReport report = s.step(i, coulomb(0.4), {1e-9, 1, 50000, 1});
    EXPECT_EQ(report.status, SolveStatus::converged) << report.hint;
    int hubs = 0;
    for (const cairn_batch& b : i.system().batches) hubs += b.hub != 0;
    EXPECT_GT(hubs, 0);
    const Solution x = read(i, dim);
    EXPECT_LT(velocity_defect(s, x), 1e-11);
    EXPECT_LT(law_defect(s, x, 0.4), 1e-5);
  }
}

INSTANTIATE_TEST_SUITE_P(Mass, Lid, testing::Values(0.1, 10.0, 1e4));
INSTANTIATE_TEST_SUITE_P(Dimension, Solver, testing::Values(2, 3));

} // namespace
} // namespace cairn::test
