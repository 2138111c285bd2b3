#include "../networks/thermal_loads.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "../fe/internal_forces.hpp"
#include "../networks/unknowns.hpp"
#include "../simulation/simulation.hpp"

namespace cairn {

// Against the temperatures that mechanics saw; of several meshes the worst.
double ThermalLoads::coupling(const Simulation& s, const NetworkInput& in, const std::vector<double>& begin,
                              const std::vector<double>& end) const {
  const double* saw = expected_.empty() ? begin.data() : expected_.data();
  double worst = 0;
  const auto share = [&worst](double unseen, double all) {
    if (unseen > 0)
      worst = std::max(worst, all > 0 ? std::sqrt(unseen / all) : std::numeric_limits<double>::infinity());
  };
  for (const ThermalStress& from : in.stresses) {
    const MeshBody& mesh = s.meshes.meshes[from.mesh];
    const std::int64_t first = unknown_of_node(s.scene, mesh.first_node()), nodes = mesh.model.nodes();
    double unseen = 0, all = 0;
    for (std::size_t dof = 0; dof + 1 < from.start.size(); ++dof) {
      double change = 0, load = 0;
      for (std::int64_t e = from.start[dof]; e < from.start[dof + 1]; ++e) {
        const std::int64_t node = first + from.node[e];
        change += from.value[e] * (end[node] - saw[node]);
        load += from.value[e] * (end[node] - in.reference);
      }
      unseen += change * change;
      all += load * load;
    }
    for (std::int64_t n = first; n < first + nodes && !mesh.linear(); ++n) {
      const double change = end[n] - saw[n], load = end[n] - in.reference;
      unseen += change * change;
      all += load * load;
    }
    share(unseen, all);
  }
  double unseen = 0, all = 0;
  for (std::size_t i = 0; i < end.size() && in.stresses.empty(); ++i) {
    unseen += (end[i] - saw[i]) * (end[i] - saw[i]);
    all += (end[i] - in.reference) * (end[i] - in.reference);
  }
  share(unseen, all);
  return worst;
}

// Thermal stress of meshes: forces on their nodes, or free strains that their materials see.
void ThermalLoads::load_meshes(Simulation& s, const NetworkInput& in) {
  const double* all = seen(values_of(s.scene.bodies.temperature, s.scene.nodes.temperature, room_));
  for (const ThermalStress& from : in.stresses) {
    MeshBody& mesh = s.meshes.meshes[from.mesh];
    const double* t = all + unknown_of_node(s.scene, mesh.first_node());
    if (!mesh.linear()) {
      if (!mesh.model.bulk->solid())
        throw Error("the mesh '" + mesh.model.name +
                    "' is of a code that is not told of its temperature: give it a material without expansion");
      std::vector<double>& swelling = mesh.model.bulk->swelling;
      swelling.resize(std::size_t(mesh.model.nodes()));
      for (std::size_t n = 0; n < swelling.size(); ++n) swelling[n] = from.expansion * (t[n] - in.reference);
      continue;
    }
    mesh.loads.thermal.assign(std::size_t(mesh.model.dofs()), 0.0);
    for (std::size_t dof = 0; dof + 1 < from.start.size(); ++dof)
      for (std::int64_t e = from.start[dof]; e < from.start[dof + 1]; ++e)
        mesh.loads.thermal[dof] += from.value[e] * (t[from.node[e]] - in.reference);
  }
}

} // namespace cairn
