// Meshes condensed on the nodes that contacts rest on, as solvers see them.
#pragma once
#include <cstdint>
#include <vector>

#include "../bodies/condensed_body.hpp"
#include "mesh_list.hpp"
#include "mortar_contacts.hpp"

namespace cairn {

class CondensedMeshes {
public:
  void resize(std::size_t meshes);
  // Before nodes are wanted for the contacts of a step.
  void begin(const NodeMeans& means) { mean_row_.assign(means.count(), -1); }
  void want(const MeshList& meshes, const NodeMeans& means, const Mapping& mapping, const MeshBody::Bytes& bytes);
  void condense(MeshList& meshes, const NodeMeans& means, const MeshBody::Bytes& bytes, std::vector<CondensedBody>& out,
                Array<double>& velocity, bool keep_nodes);
  void condense_again(MeshList& meshes, const NodeMeans& means, std::vector<CondensedBody>& out,
                      Array<double>& velocity);
  // Row of a mapping's mean in the body that was condensed last.
  std::int32_t row_of_mean(std::int32_t mean) const { return mean_row_[std::size_t(mean)]; }

private:
  void take_rows(MeshList& meshes, const NodeMeans& means, std::size_t mesh, CondensedBody& body, bool keep_nodes);
  void mix(MeshBody& mesh, CondensedBody& body);
  void make_room(MeshList& meshes, std::vector<CondensedBody>& out, Array<double>& velocity);

  std::vector<std::vector<std::int32_t>> wanted_;                // nodes of each mesh
  std::vector<std::vector<std::int32_t>> wanted_means_, direct_; // of each mesh; nodes that contacts rest on themselves
  std::vector<std::int32_t> mean_row_;                           // of each mean, -1 unless wanted
  std::vector<double> columns_;
};

} // namespace cairn
