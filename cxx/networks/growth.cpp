// Rigid bodies that grow with their temperature: all lengths of their contactors by one factor.
#include <algorithm>
#include <cmath>

#include "../strategies/simulation.hpp"
#include "network.hpp"

namespace cairn {

// Contactors that grow have a hull of their own each.
void Network::separate_hulls(Scene& scene) {
  Contactors& k = scene.contactors;
  if (!k.hull.active) return;
  std::vector<std::int32_t> uses(std::size_t(k.hulls.count()), 0);
  for (std::int64_t c = 0; c < k.count; ++c)
    if (*k.hull[c] >= 0) ++uses[*k.hull[c]];
  for (std::int64_t c = 0; c < k.count; ++c) {
    const std::int32_t hull = *k.hull[c];
    if (hull < 0 || uses[hull] < 2 || !grows(scene, c)) continue;
    --uses[hull];
    *k.hull[c] = k.hulls.copy(hull);
  }
}

bool Network::grows(const Scene& scene, std::int64_t contactor) const {
  const Contactors& k = scene.contactors;
  const double expansion = materials[*k.material[contactor]].expansion;
  return (expansion < 0 || expansion > 0) && info(Shape(*k.shape[contactor])).bounded && *k.radius[contactor] > 0;
}

// From begin_ to now_.
void Network::grow(Simulation& s) {
  if (!s.scene.bodies.stretch.active) return;
  Contactors& k = s.scene.contactors;
  const int dim = s.scene.dim;
  std::fill(s.scene.bodies.stretch.values.begin(), s.scene.bodies.stretch.values.end(), 0.0);
  for (std::int64_t c = 0; c < k.count; ++c) {
    if (!grows(s.scene, c)) continue;
    const std::int32_t body = *k.body[c];
    const double expansion = materials[*k.material[c]].expansion;
    const double now = value_at(s, now_.data(), std::int32_t(c)), begin = value_at(s, begin_.data(), std::int32_t(c));
    const double factor = (1 + expansion * (now - reference)) / (1 + expansion * (begin - reference));
    if (!(factor < 1 || factor > 1)) continue;
    if (body >= 0) *s.scene.bodies.stretch[body] = factor - 1;
    *k.radius[c] *= factor;
    if (k.offset.active)
      for (int d = 0; d < dim; ++d) k.offset[c][d] *= factor;
    if (k.direction.active) k.direction[c][dim] *= factor;
    if (k.hull.active && *k.hull[c] >= 0) k.hulls.scale(*k.hull[c], factor);
  }
}

double Network::coupling(const Simulation& s) const {
  double come = 0, all = 0;
  for (const ThermalStress& from : stresses) {
    const MeshBody& mesh = s.meshes.meshes[from.mesh];
    for (std::size_t dof = 0; dof + 1 < from.start.size(); ++dof) {
      double change = 0, load = 0;
      for (std::int64_t e = from.start[dof]; e < from.start[dof + 1]; ++e) {
        const std::int32_t node = mesh.nodes[from.node[e]];
        change += from.value[e] * (now_[node] - begin_[node]);
        load += from.value[e] * (now_[node] - reference);
      }
      come += change * change;
      all += load * load;
    }
  }
  return all > 0 ? std::sqrt(come / all) : 0;
}

// Forces of thermal stress on the nodes of meshes, from temperatures as they are.
void Network::load_meshes(Simulation& s) const {
  const double* t = s.scene.bodies.temperature.values.data();
  for (const ThermalStress& from : stresses) {
    MeshBody& mesh = s.meshes.meshes[from.mesh];
    mesh.thermal_load.assign(std::size_t(mesh.model.dofs()), 0.0);
    for (std::size_t dof = 0; dof + 1 < from.start.size(); ++dof)
      for (std::int64_t e = from.start[dof]; e < from.start[dof + 1]; ++e)
        mesh.thermal_load[dof] += from.value[e] * (t[mesh.nodes[from.node[e]]] - reference);
  }
}

} // namespace cairn
