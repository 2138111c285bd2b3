#include "ranked_scale.hpp"

#include <algorithm>
#include <cmath>

#include "../contacts/body_speeds.hpp"
#include "../solvers/sweeps/body_speed.hpp"
#include "../solvers/sweeps/step_error.hpp"
#include "exact_sum.hpp"
#include "ranked_sweeps.hpp"

namespace cairn {

void RankedScale::begin(std::vector<Part>& parts, int mesh_rank, double tolerance, Exchange& exchange) {
  double any[] = {0, 0, 0, 0}; // bonds or joints, growth, contacts on meshes, bodies of other inertia than balls
  for (const Part& part : parts) {
    const ContactSystem& system = part.simulation->interactions.system();
    const bool marks[] = {system.may_hold(), part.simulation->scene.bodies.stretch.active, !system.condensed.empty(),
                          !system.general.empty()};
    for (std::size_t k = 0; k < std::size(any); ++k) any[k] = std::max(any[k], marks[k] ? 1.0 : 0.0);
  }
  exchange.largest(any);
  holds_ = any[0] > 0;
  bends_ = any[2] > 0;
  turns_ = !(any[3] > 0);
  least_ = least_of_scale(holds_, any[1] > 0, tolerance);
  if (!holds_) return;
  ExactSum sums[2]; // by loads, of nodes
  for (Part& part : parts) {
    const Scene& scene = part.simulation->scene;
    for (std::int64_t i = 0; i < scene.bodies.count; ++i)
      if (part.own[std::size_t(i)])
        each_speed(scene.bodies, i, scene.dim, [&](double by_loads, double) { sums[0].add(by_loads); });
    const Nodes& nodes = scene.nodes;
    for (std::int64_t i = 0; i < nodes.count && part.has_meshes && part.rank == mesh_rank; ++i)
      for (int k = 0; k < scene.dim; ++k) {
        const double v = nodes.velocity_free[i][k], change = v - nodes.velocity_begin[i][k], mass = *nodes.mass[i];
        sums[0].add(mass * change * change);
        sums[1].add(mass * v * v);
      }
  }
  add_over_ranks(sums, exchange);
  by_loads_ = sums[0].value();
  of_nodes_ = sums[1].value();
}

double RankedScale::measure(double by_impulses, const std::vector<Part>& parts, Exchange& exchange) {
  if (!holds_) return by_impulses;
  ExactSum sum[1];
  for (const Part& part : parts) {
    const ContactSystem& system = part.simulation->interactions.system();
    for (std::size_t i = 0; i < part.own.size(); ++i) {
      double of_body = 0;
      if (part.own[i]) each_speed(system, std::int64_t(i), turns_, [&](double term) { of_body += term; });
      sum[0].add(of_body);
    }
  }
  add_over_ranks(sum, exchange);
  speed_square_ = std::max(sum[0].value() + of_nodes_, by_loads_);
  return std::clamp(speed_square_, least_ * by_impulses, by_impulses);
}

double RankedScale::of_velocities(double residual, double size) const {
  return speed_square_ > 0 ? std::sqrt(residual) * std::sqrt(size) / speed_square_ : 0;
}

} // namespace cairn
