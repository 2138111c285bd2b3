// This file is compiled without contraction of products and sums, so that its numbers are those of Python, to the bit.
#include "../simulation/held_motions.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "../base/call.hpp"
#include "../simulation/integrators.hpp"
#include "../simulation/simulation.hpp"
#include "options.hpp"

namespace cairn {
namespace {

// Share of the velocity at the end of the step in the displacement of held dofs, by the integrator of the strategy.
double end_share(Strategy& strategy) {
  const std::string row = option_text(strategy, "integrator");
  Integrator made(row);
  const auto& parameters = made.info().parameters;
  for (std::size_t k = 0; k < parameters.size(); ++k)
    made.parameter(row, int(k)) = option_number(strategy, std::string(parameters[k].name));
  const cairn_scheme scheme = made.scheme(1.0);
  return scheme.share + scheme.position[0]; // a driven dof gets an impulse, which has a part in the position, too
}

std::string named(const MeshBody& mesh, std::int32_t dof) {
  const int dim = mesh.model.dim;
  return "node " + std::to_string(dof / dim) + " of the mesh '" + mesh.model.name + "' along " +
         std::string(1, "xyz"[dof % dim]);
}

double checked(const HeldMotion& motion, const MeshBody& mesh, double t) {
  const double value = motion.value(t);
  if (!std::isfinite(value))
    throw Error((motion.displaces ? "the displacement of " : "the velocity of ") + named(mesh, motion.dof.front()) +
                " is " + std::to_string(value) + " at " + std::to_string(t) + " s; give a function that is finite");
  return value;
}

MeshBody* body_of(Simulation& s, const HeldMotion& motion) {
  for (MeshBody& mesh : s.meshes.meshes)
    if (mesh.model.node_ids.front() == motion.mesh) return &mesh;
  return nullptr;
}

} // namespace

std::function<double(double t)> table_of(std::span<const double> time, std::span<const double> value) {
  if (time.empty()) throw Error("rows is 0; a table has at least one row");
  for (std::size_t i = 0; i < time.size(); ++i) {
    if (!std::isfinite(time[i]) || !std::isfinite(value[i]))
      throw Error("row " + std::to_string(i) + " of the table is " + std::to_string(time[i]) + " s, " +
                  std::to_string(value[i]) + "; give finite numbers");
    if (i > 0 && !(time[i] > time[i - 1]))
      throw Error("time[" + std::to_string(i) + "] is " + std::to_string(time[i]) + ", not after " +
                  std::to_string(time[i - 1]) + "; give rising times");
  }
  return [times = std::vector<double>(time.begin(), time.end()),
          values = std::vector<double>(value.begin(), value.end())](double t) {
    const auto after = std::size_t(std::upper_bound(times.begin(), times.end(), t) - times.begin());
    if (after == 0) return values.front();
    const std::size_t j = after - 1;
    if (after == times.size() || !(t > times[j])) return values[j];
    const double slope = (values[after] - values[j]) / (times[after] - times[j]);
    return slope * (t - times[j]) + values[j];
  };
}

void hold_by(Simulation& s, const MeshBody& mesh, HeldMotion motion) {
  for (const std::int32_t dof : motion.dof)
    if (!mesh.model.held[std::size_t(dof)])
      throw Error(named(mesh, dof) + " is not held; hold it before the mesh is added to the scene");
  std::sort(motion.dof.begin(), motion.dof.end());
  motion.dof.erase(std::unique(motion.dof.begin(), motion.dof.end()), motion.dof.end());
  motion.mesh = mesh.model.node_ids.front();
  if (motion.displaces) end_share(s.strategy()); // refuses a strategy that moves no meshes
  auto& all = s.held_motions;
  for (HeldMotion& other : all)
    if (other.mesh == motion.mesh)
      std::erase_if(other.dof,
                    [&](std::int32_t dof) { return std::binary_search(motion.dof.begin(), motion.dof.end(), dof); });
  std::erase_if(all, [](const HeldMotion& m) { return m.dof.empty(); });
  if (!motion.dof.empty()) all.push_back(std::move(motion));
}

void move_held(Simulation& s, double h) {
  std::erase_if(s.held_motions, [&](const HeldMotion& m) { return !body_of(s, m); });
  s.place_meshes();
  const double t = s.time;
  bool displaces = false;
  for (HeldMotion& motion : s.held_motions) {
    const MeshBody& mesh = *body_of(s, motion);
    if (motion.displaces) motion.at = {checked(motion, mesh, t), checked(motion, mesh, t + h / 2), 0};
    motion.at[2] = checked(motion, mesh, t + h);
    displaces = displaces || motion.displaces;
  }
  const double share = displaces ? end_share(s.strategy()) : 1;
  for (const HeldMotion& motion : s.held_motions) {
    MeshBody& mesh = *body_of(s, motion);
    mesh.loads.held_velocity.resize(std::size_t(mesh.model.dofs()), 0.0);
    const auto [begin, half, end] = motion.at;
    const double rate = (3 * end - 4 * half + begin) / h;
    const double* x = s.scene.nodes.position[mesh.first_node()];
    const double* v = s.scene.nodes.velocity[mesh.first_node()];
    for (const std::int32_t dof : motion.dof) {
      double& to = mesh.loads.held_velocity[std::size_t(dof)];
      const double u = x[dof] - mesh.model.reference[std::size_t(dof)];
      to = motion.displaces ? (end - u) / h + (1 - share) * (rate - v[dof]) : end;
    }
  }
}

} // namespace cairn
