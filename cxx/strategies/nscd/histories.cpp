#include "histories.hpp"

#include <algorithm>

#include "../../networks/network.hpp"

namespace cairn {
namespace {

// Zeroes the histories of driven dofs, whose motion is prescribed.
void forget_driven(Bodies& b, int histories) {
  if (!b.driven.active) return;
  for (std::int64_t i = 0; i < b.count; ++i)
    for (int j = 0; j < b.dofs() && *b.driven[i] != 0; ++j)
      for (int k = 0; k < histories && (*b.driven[i] >> j) % 2 == 1; ++k) b.history(k)[b.dofs() * i + j] = 0;
}

} // namespace

bool Histories::start(Simulation& s, const StepScheme& step) {
  const cairn_scheme& scheme = step.scheme;
  if (scheme.histories == 0) return false;
  Bodies& b = s.scene.bodies;
  const Need needs[] = {Need::acceleration, Need::jerk, Need::snap, Need::crackle};
  for (int k = 0; k < scheme.histories; ++k) s.scene.activate(needs[k]);
  Nodes& nodes = s.scene.nodes;
  forget_driven(b, scheme.histories);
  const auto all = [](Field<std::uint8_t>& of) {
    return std::find(of.values.begin(), of.values.end(), 0) == of.values.end();
  };
  if (all(b.history_known) && all(nodes.history_known)) return false;
  cairn_history_start(s.scene.dim, b.dofs(), b.count, bits(b.history_known), s.scene.gravity.data(),
                      b.mass.values.data(), b.inertia.values.data(), b.velocity.values.data(), b.history(0),
                      b.history(1), b.history(2), b.history(3), pointer(b.force), pointer(b.damping), bits(b.driven));
  if (s.networks && s.networks->thermal) s.networks->thermal->load_meshes(s);
  for (MeshBody& mesh : s.meshes.meshes)
    if (*nodes.history_known[mesh.first_node()] == 0) {
      mesh.loads.time = s.time;
      mesh.start_history(nodes, s.scene.gravity.data(), scheme);
    }
  for (auto* known : {&b.history_known.values, &nodes.history_known.values})
    std::fill(known->begin(), known->end(), std::uint8_t(1));
  return true;
}

void Histories::measure(Simulation& s, const StepScheme& step) {
  const cairn_scheme& scheme = step.scheme;
  if (scheme.histories == 0) return;
  Bodies& b = s.scene.bodies;
  change_.resize(b.velocity.values.size());
  way_.resize(b.velocity.values.size());
  cairn_smooth_change(s.scene.dim, b.dofs(), b.count, &scheme, s.scene.gravity.data(), b.mass.values.data(),
                      b.inertia.values.data(), b.velocity_begin.values.data(), b.velocity.values.data(), change_.data(),
                      b.history(0), b.history(1), b.history(2), b.history(3), pointer(b.force), pointer(b.damping),
                      bits(b.driven));
  cairn_history_way(b.dofs(), b.count, &scheme, b.velocity_begin.values.data(), b.velocity.values.data(),
                    change_.data(), way_.data(), b.history(0), b.history(1), b.history(2), b.history(3));
  Nodes& nodes = s.scene.nodes;
  if (nodes.count == 0) return;
  node_change_.resize(nodes.velocity.values.size());
  node_way_.resize(nodes.velocity.values.size());
  for (MeshBody& mesh : s.meshes.meshes) mesh.smooth_change(nodes, node_change_.data());
  cairn_history_way(nodes.dim, nodes.count, &scheme, nodes.velocity_begin.values.data(), nodes.velocity.values.data(),
                    node_change_.data(), node_way_.data(), nodes.history(0), nodes.history(1), nodes.history(2),
                    nodes.history(3));
  for (MeshBody& mesh : s.meshes.meshes) mesh.turn_way(nodes, node_way_.data());
}

void Histories::update(Simulation& s, const StepScheme& step) {
  const cairn_scheme& scheme = step.scheme;
  if (scheme.histories == 0) return;
  Bodies& b = s.scene.bodies;
  cairn_theta_advance(s.scene.dim, b.dofs(), b.count, 1, way_.data(), b.position.values.data(),
                      s.scene.dim == 2 ? pointer(b.rotation) : nullptr);
  cairn_history_update(s.scene.dim, b.dofs(), b.count, &scheme, change_.data(), b.inertia.values.data(), b.history(0),
                       b.history(1), b.history(2), b.history(3));
  Nodes& nodes = s.scene.nodes;
  cairn_theta_advance(nodes.dim, nodes.dim, nodes.count, 1, node_way_.data(), nodes.position.values.data(), nullptr);
  cairn_history_update(nodes.dim, nodes.dim, nodes.count, &scheme, node_change_.data(), nullptr, nodes.history(0),
                       nodes.history(1), nodes.history(2), nodes.history(3));
}

void forget_histories(Simulation& s) {
  for (auto* known : {&s.scene.bodies.history_known.values, &s.scene.nodes.history_known.values})
    std::fill(known->begin(), known->end(), std::uint8_t(0));
}

} // namespace cairn
