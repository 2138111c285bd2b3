// A step allocates nothing once the sizes of its scene are settled.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "contactors/shapes.hpp"
#include "fe/frame_model.hpp"
#include "laws/law_names.hpp"
#include "strategies/nscd/nscd.hpp"

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
namespace {
std::atomic<std::int64_t> allocations{0};
}
// Entry points of glibc for replacements of malloc.
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void* malloc(std::size_t n) { return ++allocations, __libc_malloc(n); }
void* calloc(std::size_t n, std::size_t size) { return ++allocations, __libc_calloc(n, size); }
void* realloc(void* p, std::size_t n) { return ++allocations, __libc_realloc(p, n); }
void* aligned_alloc(std::size_t a, std::size_t n) { return ++allocations, __libc_memalign(a, n); }
}

namespace cairn::test {
namespace {

// Disks or spheres on a lattice that settles on a floor, at will under a heavy plate that all of the upper row touch.
Simulation pile(int dim, int per_side, bool lid, Law law, bool project) {
  Scene scene(dim);
  scene.gravity[dim - 1] = -9.81;
  std::vector<double> x, mass, inertia, radius;
  std::vector<std::int64_t> id;
  const int layers = dim == 3 ? per_side : 1;
  for (int z = 0; z < layers; ++z)
    for (int y = 0; y < per_side; ++y)
      for (int k = 0; k < per_side; ++k) {
        x.push_back(2.0 * k);
        if (dim == 3) x.push_back(2.0 * z);
        x.push_back(1 + 2.0 * y);
        mass.push_back(1);
        for (int c = 0; c < (dim == 2 ? 1 : 3); ++c) inertia.push_back(0.4);
        radius.push_back(1);
        id.push_back(std::int64_t(id.size()));
      }
  const std::int32_t material = 0;
  scene.add_bodies({std::int64_t(id.size()), x, {}, {}, mass, inertia});
  scene.add_contactors(
      {std::int64_t(id.size()), dim == 2 ? Shape::disk : Shape::sphere, id, {&material, 1}, radius, {}, {}});
  const auto plane = [&](double height, double up, double weight) {
    std::vector<double> at(dim, 0.0), normal(dim + 1, 0.0), moments(dim == 2 ? 1 : 3, weight * 1e4);
    at[dim - 1] = height;
    normal[dim - 1] = up;
    const std::int64_t body = scene.add_bodies({1, at, {}, {}, {&weight, 1}, moments});
    scene.add_contactors({1, dim == 2 ? Shape::half_plane : Shape::plane, {&body, 1}, {&material, 1}, {}, {}, normal});
  };
  plane(0, 1, std::numeric_limits<double>::infinity());
  if (lid) plane(2.0 * per_side, -1, 1000);
  LawTable laws({"rock"});
  const double mu = 0.4;
  laws.set_default(law, {&mu, 1});
  NscdOptions nscd;
  nscd.solver = {1e-4, 1, 500, 1};
  nscd.project_positions = project;
  return Simulation(std::move(scene), std::move(laws), nscd);
}

struct Case {
  const char* name;
  int dim, per_side;
  bool lid;
  Law law = Law::signorini_coulomb;
  bool project = false;
};
class Step : public testing::TestWithParam<Case> {};

TEST_P(Step, AllocatesNothing) {
  const Case& c = GetParam();
  Simulation s = pile(c.dim, c.per_side, c.lid, c.law, c.project);
  for (int k = 0; k < 80; ++k) s.step(1e-3);
  EXPECT_GT(s.report.contacts, c.per_side);
  for (int k = 0; k < 20; ++k) {
    const std::int64_t before = allocations;
    s.step(1e-3);
    // a solve that did not converge reports by a single string
    const bool said =
        !s.report.solve.hint.empty() || s.report.projection_error > stages_of(s, "the test").settings.solver.tolerance;
    EXPECT_LE(allocations - before, said ? 1 : 0) << "step " << s.report.step;
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, Step,
                         testing::Values(Case{"disks", 2, 40, false}, Case{"spheres", 3, 10, false},
                                         Case{"disks_lid", 2, 40, true}, Case{"spheres_lid", 3, 8, true},
                                         Case{"bonded_disks", 2, 20, false, Law::bonded},
                                         Case{"bonded_spheres", 3, 6, false, Law::bonded},
                                         Case{"projected_disks", 2, 40, false, Law::signorini_coulomb, true},
                                         Case{"projected_spheres", 3, 10, false, Law::signorini_coulomb, true}),
                         [](const auto& info) { return std::string(info.param.name); });

// Every slot of every law that a step of NSCD calls, sound contacts and others.
// A chain that bends and turns.
TEST(Frames, AllocateNothing) {
  for (const bool beams : {false, true})
    for (const int dim : {2, 3}) {
      constexpr int n = 12;
      FrameCells of;
      of.dim = dim;
      of.beams = beams;
      for (int i = 0; i <= n; ++i)
        for (int k = 0; k < dim; ++k) of.reference.push_back(k == 0 ? i : 0);
      for (std::int32_t i = 0; i < n; ++i) of.node.insert(of.node.end(), {i, i + 1});
      of.young.assign(n, 1e7);
      of.area.assign(n, 1e-3);
      of.shear.assign(n, 4e6);
      of.pull = of.shear_area = std::vector<double>(n, 0.0);
      of.torsion.assign(n, 2e-7);
      of.inertia.assign(2 * n, 1e-7);
      of.clamped = {0};
      FrameModel model(std::move(of));
      const SparseMatrix lower = model.lower();
      model.fit(lower);
      std::vector<double> u((n + 1) * std::size_t(dim)), force(u.size()), tangent(lower.row.size(), 0.0);
      for (int step = 0; step < 4; ++step) {
        for (int i = 0; i <= n; ++i)
          for (int k = 1; k < dim; ++k) u[std::size_t(dim * i + k)] = 0.1 * step * std::sin(0.5 * i * k + step);
        const std::int64_t before = allocations;
        ASSERT_TRUE(model.evaluate({u.data(), u.data()}, force.data(), tangent.data()).ok());
        model.commit();
        const std::int64_t made = step > 0 ? allocations - before : 0;
        EXPECT_EQ(made, 0) << dim << (beams ? " beams" : " bars");
      }
    }
}

TEST(Laws, AllocateNothing) {
  constexpr int n = 8;
  for (const LawInfo& law : law_infos())
    for (int dim : {2, 3}) {
      const int c = law.components(dim);
      if (c == 0 || !law.prepare) continue;
      std::vector<double> w(n * c * c), u(n * c), bias(n * c), compliance(n * c), mu(n), r(n * c), rho(n, 1.0),
          f(n * c), weight(n * c), params(n * (law.parameters.size() + 4), 1e-3), state(std::size_t(16 * n), 0.0),
          energy(4 * n), gap(n), geometry(3 * n, 1.0);
      for (std::size_t p = 0; p < law.parameters.size(); ++p) {
        const LawParameter& one = law.parameters[p];
        const double value = one.required ? std::clamp(0.5, one.smallest, one.largest) : one.standard;
        std::fill_n(&params[p * n], n,
                    std::clamp(value, -std::numeric_limits<double>::max(), std::numeric_limits<double>::max()));
      }
      for (int i = 0; i < n; ++i) {
        state[i] = i % 2, gap[i] = 1e-4 * (i - 3);
        for (int k = 0; k < c; ++k) w[n * (k * c + k) + i] = 1, u[k * n + i] = (k + 1) * (0.3 * i - 1);
      }
      const cairn_law_context context{1e-3, 0.5, geometry.data(), nullptr, 0};
      const std::int64_t before = allocations;
      law.prepare(n, c, &context, gap.data(), u.data(), params.data(), state.data(), bias.data(), compliance.data(),
                  mu.data());
      if (law.solve) {
        law.solve(n, c, w.data(), u.data(), bias.data(), params.data(), state.data(), r.data(), nullptr);
        std::int32_t status[n];
        law.residual(n, c, &context, rho.data(), w.data(), u.data(), bias.data(), r.data(), params.data(), state.data(),
                     f.data(), weight.data(), status);
      }
      const std::vector<double>& begun = state;
      if (law.commit) law.commit(n, c, &context, gap.data(), u.data(), r.data(), params.data(), state.data());
      if (law.energy)
        law.energy(n, c, &context, gap.data(), u.data(), r.data(), params.data(), begun.data(), state.data(),
                   energy.data());
      EXPECT_EQ(allocations - before, 0) << law.name << " in " << dim << "D";
    }
}

} // namespace
} // namespace cairn::test
#endif
