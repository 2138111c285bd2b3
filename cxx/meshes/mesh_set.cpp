#include "mesh_set.hpp"

#include "../base/call.hpp"

namespace cairn {

void MeshSet::place(const Nodes& nodes, const Contactors& contactors) {
  std::vector<std::int64_t> first; // node of each number
  for (std::int64_t i = nodes.count - 1; i >= 0; --i) {
    first.resize(std::max(first.size(), std::size_t(*nodes.mesh[i])), -1);
    first[std::size_t(*nodes.mesh[i]) - 1] = i;
  }
  for (MeshBody& mesh : meshes) {
    const std::size_t number = std::size_t(mesh.model.number) - 1;
    if (number >= first.size() || first[number] < 0)
      throw Error("the nodes of the mesh '" + mesh.model.name + "' are not in the scene");
    mesh.place_from(first[number]);
  }
  areas_.clear();
  condensed_.resize(meshes.size());
  seats_.place(meshes, first.size(), nodes, contactors);
  mortars_.begin(meshes);
}

} // namespace cairn
