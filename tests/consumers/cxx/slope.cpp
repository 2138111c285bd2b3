// A disk on a half-plane through the C++ classes: what a program outside of the source tree can reach.
#include <cairn/cxx/contactors/shapes.hpp>
#include <cairn/cxx/laws/law_names.hpp>
#include <cairn/cxx/simulation/simulation.hpp>
#include <cairn/cxx/strategies/nscd/nscd_options.hpp>
#include <cmath>
#include <cstdio>
#include <limits>

int main() {
  const double infinite = std::numeric_limits<double>::infinity();
  cairn::Scene scene(2);
  scene.gravity = {0, -9.81, 0};
  const double position[] = {0, 0, 0, 0.5}, mass[] = {infinite, 3}, inertia[] = {infinite, 0.375}, radius[] = {0.5};
  const double normal[] = {0, 1, 0};
  const std::int64_t plane[] = {0}, disk[] = {1};
  const std::int32_t material[] = {0};
  scene.add_bodies({2, position, {}, {}, mass, inertia});
  scene.add_contactors({1, cairn::Shape::half_plane, plane, material, {}, {}, normal});
  scene.add_contactors({1, cairn::Shape::disk, disk, material, radius, {}, {}});
  cairn::LawTable laws({"rock"});
  const double mu[] = {0.5};
  laws.set(0, 0, cairn::Law::signorini_coulomb, mu);
  cairn::NscdOptions strategy;
  strategy.solver = {1e-8, 1, 100, 1};
  cairn::Simulation simulation(scene, laws, strategy);
  for (int step = 0; step < 100; ++step) simulation.step(1e-3);
  double impulse[2];
  if (simulation.interactions.count() != 1) return 1;
  simulation.interactions.views().impulse_space(impulse);
  std::printf("impulse / weight %.15g\n", impulse[1] / (3 * 9.81 * 1e-3));
  return std::abs(impulse[1] / (3 * 9.81 * 1e-3) - 1) < 1e-12 ? 0 : 1;
}
