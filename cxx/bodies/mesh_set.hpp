// The deformable bodies of a scene, and what a contact on one of them rests on.
#pragma once
#include <algorithm>
#include <span>
#include <vector>

#include "condensed_body.hpp"
#include "mesh_body.hpp"

namespace cairn {

// Nodes of a mesh that carry a point of its surface, with weights whose sum is 1.
struct Mapping {
  std::int32_t mesh = -1;
  std::int32_t node[4] = {-1, -1, -1, -1};
  double weight[4] = {0, 0, 0, 0};
};

class MeshSet {
public:
  std::vector<MeshBody> meshes;

  bool empty() const { return meshes.empty(); }
  bool linear() const {
    return std::all_of(meshes.begin(), meshes.end(), [](const MeshBody& m) { return m.linear(); });
  }
  // Finds the bodies of all meshes among those of the scene; to be called when internal numbers change.
  void place(const Bodies& bodies, const std::vector<std::int32_t>& insertion_order);
  bool carries(std::int32_t body) const { return of_body_[body].mesh >= 0; }
  std::int32_t mesh_of(std::int32_t body) const { return of_body_[body].mesh; }
  // The nodes that a point (dim) [m] on a body of a mesh moves with.
  Mapping mapping(const Bodies& bodies, std::int32_t body, const double* point) const;
  // Of a contact on a node or a point, the part of the surface that it stands for [m2], in 2D of a metre across the
  // plane; 0 of edges and facets. After find_areas, which is asked again when internal numbers changed.
  double area(std::int32_t body) const { return area_[body]; }
  bool has_areas() const { return area_.size() == of_body_.size(); }
  void find_areas(const std::vector<std::uint8_t>& touches);
  // Nodes that a contact may rest on become contact nodes.
  void want(const Mapping& mapping);
  // After all were wanted: compliances, and the meshes as solvers see them, with room for the velocities of contact
  // nodes.
  void condense(std::vector<CondensedBody>& out, Array<double>& velocity);

private:
  enum class Role : std::int8_t { node, point, edge, facet };
  struct Place {
    std::int32_t mesh = -1, index = -1;
    Role role = Role::node;
  };
  std::vector<Place> of_body_;
  std::vector<double> area_;                      // per body
  std::vector<std::vector<std::int32_t>> wanted_; // nodes of each mesh
};

} // namespace cairn
