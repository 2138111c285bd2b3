// Newton's method of a body whose stresses are a material's, by itself: impulses are given in the place of contacts.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/call.hpp"
#include "bodies/nodes.hpp"
#include "fe/bulk_model.hpp"
#include "meshes/mesh_body.hpp"
#include "scheme.hpp"

namespace {

using cairn::MeshBody;

constexpr int across = 3, nodes = (across + 1) * (across + 1);
constexpr double gravity[] = {0.0, -10.0}, density = 1000, thickness = 1;

// A unit square of quadrilaterals, its mass lumped.
cairn::MeshModel square(const char* material, std::vector<double> params, cairn::Kinematics kinematics) {
  cairn::MeshModel m;
  m.dim = 2;
  m.name = "square";
  cairn::BulkCells cells;
  cells.element = nullptr;
  for (const cairn::ElementInfo& e : cairn::element_infos())
    if (std::string(e.name) == "q4") cells.element = &e;
  cells.material = &cairn::bulk_material_named(material);
  cells.params = std::move(params);
  cells.kinematics = kinematics;
  cells.thickness = thickness;
  std::vector<std::int64_t> start{0};
  std::vector<std::int32_t> unknown;
  std::vector<double> mass(nodes, 0.0);
  for (int i = 0; i <= across; ++i)
    for (int j = 0; j <= across; ++j) {
      m.reference.push_back(double(i) / across);
      m.reference.push_back(double(j) / across);
    }
  for (int i = 0; i < across; ++i)
    for (int j = 0; j < across; ++j) {
      const int a = i * (across + 1) + j;
      for (const int node : {a, a + across + 1, a + across + 2, a + 1}) {
        cells.node.push_back(node);
        mass[std::size_t(node)] += density / (4.0 * across * across);
        for (int k = 0; k < 2; ++k) unknown.push_back(2 * node + k);
      }
      start.push_back(std::int64_t(unknown.size()));
    }
  m.mass = cairn::lower_pattern(2 * nodes, start, unknown);
  m.stiffness = m.damping = m.mass;
  for (int i = 0; i < 2 * nodes; ++i) m.mass.value[std::size_t(m.mass.start[i])] = mass[std::size_t(i / 2)];
  m.held.assign(2 * nodes, 0);
  const auto bulk = std::make_shared<cairn::BulkModel>(2, m.reference, std::vector<cairn::BulkCells>{cells});
  bulk->fit(m.mass);
  std::vector<double> none(2 * nodes, 0.0), force(2 * nodes);
  EXPECT_TRUE(bulk->evaluate(none.data(), 1, 1, force.data(), m.stiffness.value.data()).ok());
  m.bulk = bulk;
  return m;
}

struct World {
  cairn::Nodes points{2};
  MeshBody mesh;
  double h, theta;
  int most = 0;
  std::vector<double> given = std::vector<double>(2 * nodes, 0.0); // impulses of each step
  explicit World(cairn::MeshModel model, double step, double of_theta)
      : mesh(std::move(model)), h(step), theta(of_theta) {
    points.count = nodes;
    points.for_each_field([](auto& field) { field.values.assign(std::size_t(field.components) * nodes, 0); });
    for (int i = 0; i < nodes; ++i)
      for (int k = 0; k < 2; ++k) points.position[i][k] = mesh.model.reference[std::size_t(2 * i + k)];
  }
  void step() {
    points.position_begin.values = points.position.values;
    points.velocity_begin.values = points.velocity.values;
    mesh.free_velocity(points, gravity, scheme_of(h, theta), true);
    int pass = 1;
    for (;; ++pass) {
      std::copy(given.begin(), given.end(), mesh.impulse.begin());
      const cairn::NewtonError found = mesh.judge();
      ASSERT_TRUE(found.fault.ok());
      if (found.whole && found.error < 1e-10) break;
      ASSERT_LT(pass, 12) << found.error;
      mesh.linearise(points);
    }
    most = std::max(most, pass);
    mesh.push(points);
    mesh.account(points, gravity);
    mesh.commit();
    for (int i = 0; i < nodes; ++i)
      for (int k = 0; k < 2; ++k)
        points.position[i][k] += h * (theta * points.velocity[i][k] + (1 - theta) * points.velocity_begin[i][k]);
  }
  double momentum(int k) const {
    double sum = 0;
    for (int i = 0; i < nodes; ++i) {
      const auto& m = mesh.model.mass;
      sum += m.value[std::size_t(m.start[2 * i])] * points.velocity.values[std::size_t(2 * i + k)];
    }
    return sum;
  }
  double energy() const { // of motion, weight and stresses
    double sum = mesh.work.stored;
    for (int i = 0; i < nodes; ++i) {
      const double m = mesh.model.mass.value[std::size_t(mesh.model.mass.start[2 * i])];
      const double *v = &points.velocity.values[std::size_t(2 * i)], *x = &points.position.values[std::size_t(2 * i)];
      sum += m * (0.5 * (v[0] * v[0] + v[1] * v[1]) - gravity[1] * x[1]);
    }
    return sum;
  }
};

void stretch(World& w, double speed) {
  for (int i = 0; i < nodes; ++i) {
    w.points.velocity[i][0] = speed * (w.points.position[i][0] - 0.5);
    w.points.velocity[i][1] = -0.5 * speed * w.points.position[i][0];
  }
}

TEST(MeshNewton, MomentumIsThatOfWeightAndImpulses) {
  World w(square("neo_hookean", {1e5, 0.3}, cairn::Kinematics::total_lagrangian), 2e-3, 0.5);
  stretch(w, 8.0);
  w.given[2 * 5] = 0.7;
  w.given[2 * 9 + 1] = 1.1;
  const double x = w.momentum(0), y = w.momentum(1);
  for (int k = 0; k < 50; ++k) w.step();
  EXPECT_NEAR(w.momentum(0), x + 50 * 0.7, 1e-9 * density);
  EXPECT_NEAR(w.momentum(1), y + 50 * 1.1 - density * 10 * 50 * 2e-3, 1e-9 * density);
  EXPECT_GT(w.most, 1);
  EXPECT_LE(w.most, 6);
}

TEST(MeshNewton, EnergyIsKeptToSecondOrder) {
  double lost[2];
  for (int k = 0; k < 2; ++k) {
    World w(square("neo_hookean", {1e5, 0.3}, cairn::Kinematics::total_lagrangian), 2e-3 / (k + 1), 0.5);
    stretch(w, 8.0);
    w.step();
    const double start = w.energy();
    for (int s = 1; s < 40 * (k + 1); ++s) w.step();
    lost[k] = std::abs(w.energy() - start);
  }
  EXPECT_LT(lost[1], 0.4 * lost[0]);
  EXPECT_LT(lost[0], 20.0); // of some 3,000 J of stretch
}

TEST(MeshNewton, OnePassWhereStressesAreLinear) {
  World w(square("isotropic_elastic", {1e5, 0.3}, cairn::Kinematics::small), 2e-3, 0.5);
  stretch(w, 8.0);
  w.step();
  const double start = w.energy();
  for (int k = 0; k < 50; ++k) w.step();
  EXPECT_EQ(w.most, 1);
  EXPECT_NEAR(w.energy(), start, 1e-9 * start);
}

TEST(MeshNewton, PlasticWorkIsToldAndLessThanWhatWasThere) {
  World w(square("finite_j2", {1e6, 0.3, 2e4, 1e4, 0, 1, 0}, cairn::Kinematics::total_lagrangian), 5e-4, 0.5);
  stretch(w, 20.0);
  double dissipated = 0, by_theta = 0, first = 0;
  for (int k = 0; k < 200; ++k) {
    w.step();
    dissipated += w.mesh.work.material;
    by_theta += w.mesh.work.elastic - w.mesh.work.stored_change - w.mesh.work.material;
    if (k == 0) first = w.energy() + dissipated + by_theta;
  }
  EXPECT_GT(dissipated, 1000.0);
  EXPECT_NEAR(w.energy() + dissipated + by_theta, first, 1e-9 * first);
  EXPECT_LT(std::abs(by_theta), 0.02 * dissipated);
}

TEST(MeshNewton, ARestartGoesOnToTheSameBits) {
  const auto made = [] {
    return square("finite_j2", {1e6, 0.3, 2e4, 1e4, 0, 1, 0}, cairn::Kinematics::total_lagrangian);
  };
  World w(made(), 5e-4, 0.5), other(made(), 5e-4, 0.5);
  stretch(w, 20.0);
  for (int k = 0; k < 20; ++k) w.step();
  other.points.position.values = w.points.position.values;
  other.points.velocity.values = w.points.velocity.values;
  other.mesh.restore(w.mesh.model.bulk->history(), w.mesh.memory());
  EXPECT_THROW(other.mesh.restore({}, {}), cairn::Error);
  for (int k = 0; k < 20; ++k) w.step(), other.step();
  EXPECT_EQ(w.points.position.values, other.points.position.values);
  EXPECT_EQ(w.points.velocity.values, other.points.velocity.values);
}

TEST(MeshNewton, ACellThatIsTurnedInsideOutIsNamed) {
  World w(square("neo_hookean", {1e2, 0.3}, cairn::Kinematics::total_lagrangian), 1e-2, 0.5);
  w.given[0] = 1e5; // the corner goes through the other side
  w.given[1] = 1e5;
  w.points.position_begin.values = w.points.position.values;
  w.mesh.free_velocity(w.points, gravity, scheme_of(w.h, w.theta), true);
  bool broke = false;
  for (int pass = 0; pass < 20 && !broke; ++pass) {
    std::copy(w.given.begin(), w.given.end(), w.mesh.impulse.begin());
    const cairn::NewtonError found = w.mesh.judge();
    broke = !found.fault.ok() || !found.whole;
    if (!found.fault.ok()) {
      const std::string told = w.mesh.describe(found.fault);
      EXPECT_NE(told.find("mesh 'square': quad cell 0"), std::string::npos) << told;
      break;
    }
    w.mesh.linearise(w.points);
  }
  EXPECT_TRUE(broke);
}

// A floor under the lower nodes, its impulses found by Gauss and Seidel on the compliance of each pass: the block falls
// on it and comes to rest under its weight.
TEST(MeshNewton, EachPassHasAComplianceOfItsOwn) {
  cairn::MeshModel model = square("neo_hookean", {2e5, 0.3}, cairn::Kinematics::total_lagrangian);
  for (std::size_t e = 0; e < model.damping.value.size(); ++e)
    model.damping.value[e] = 20 * model.mass.value[e] + 2e-3 * model.stiffness.value[e];
  World w(std::move(model), 1e-3, 0.5);
  std::vector<std::int32_t> low;
  for (std::int32_t i = 0; i < nodes; ++i)
    if (!(w.points.position[i][1] > 0)) low.push_back(i);
  for (int i = 0; i < nodes; ++i) w.points.velocity[i][1] = -1.5;
  const std::size_t m = low.size();
  std::vector<double> r(m, 0.0);
  double pushed = 0;
  int most = 0;
  for (int step = 0; step < 1200; ++step) {
    w.points.position_begin.values = w.points.position.values;
    w.points.velocity_begin.values = w.points.velocity.values;
    w.mesh.free_velocity(w.points, gravity, scheme_of(w.h, w.theta), true);
    for (int pass = 1;; ++pass) {
      w.mesh.touch(low);
      const std::int64_t leading = w.mesh.leading();
      const double* s_of = w.mesh.compliance();
      const auto compliance = [&](std::size_t a, std::size_t b) {
        const std::int64_t i = 2 * w.mesh.place(low[a]) + 1, j = 2 * w.mesh.place(low[b]) + 1;
        return s_of[leading * j + i];
      };
      for (int sweep = 0; sweep < 200; ++sweep)
        for (std::size_t a = 0; a < m; ++a) {
          const double gap = w.points.position_begin[low[a]][1] + 0.5 * w.h * w.points.velocity_begin[low[a]][1];
          double u = w.points.velocity_free[low[a]][1] + gap / w.h;
          for (std::size_t b = 0; b < m; ++b) u += compliance(a, b) * r[b];
          r[a] = std::max(0.0, r[a] - u / compliance(a, a));
        }
      std::fill(w.mesh.impulse.begin(), w.mesh.impulse.end(), 0.0);
      for (std::size_t a = 0; a < m; ++a) w.mesh.impulse[std::size_t(2 * low[a] + 1)] = r[a];
      const cairn::NewtonError found = w.mesh.judge();
      ASSERT_TRUE(found.fault.ok());
      most = std::max(most, pass);
      if (found.whole && found.error < 1e-8) break;
      ASSERT_LT(pass, 15) << found.error;
      w.mesh.linearise(w.points);
    }
    w.mesh.push(w.points);
    for (std::size_t a = 0; a < m; ++a) // the condition holds at the velocities that are taken
      if (r[a] > 0) {
        const double gap = w.points.position_begin[low[a]][1] + 0.5 * w.h * w.points.velocity_begin[low[a]][1];
        ASSERT_NEAR(w.points.velocity[low[a]][1] + gap / w.h, 0, 1e-5);
      }
    w.mesh.account(w.points, gravity);
    w.mesh.commit();
    for (int i = 0; i < nodes; ++i)
      for (int k = 0; k < 2; ++k)
        w.points.position[i][k] += 0.5 * w.h * (w.points.velocity[i][k] + w.points.velocity_begin[i][k]);
    pushed = 0;
    for (const double one : r) pushed += one;
  }
  EXPECT_NEAR(pushed / w.h, density * 10, 0.01 * density * 10);
  EXPECT_GT(most, 1);
  EXPECT_LE(most, 8);
}

} // namespace
