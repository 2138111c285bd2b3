// Deformable bodies beside a liquid: points below their sides, which nodes carry by shape functions, and the motion of
// the nodes within a step. Nodes take the forces of the points by the same weights: momentum and power are kept.
#pragma once
#include <cstdint>
#include <vector>

#include "../meshes/mesh_set.hpp"
#include "../scene/scene.hpp"
#include "cairn/fluid.h"

namespace cairn {

// Points below sides of meshes. Weights are shape functions of the side at the foot of a point, slopes their
// derivatives along its parent coordinates; a point lies by its depth below the foot, along the normal of the side.
struct FluidSkin {
  std::vector<std::int64_t> first_node;      // (meshes) id of the first node of each
  std::vector<std::int8_t> slip;             // (meshes) Slip
  std::int64_t most = 0;                     // nodes of a side at most
  std::vector<std::int32_t> mesh;            // (n)
  std::vector<std::int32_t> node;            // (most, n) within the mesh; weights of nodes that are not there are 0
  std::vector<double> weight, along, across; // (most, n), across: 3D alone
  std::vector<double> depth, volume;         // (n) [m], [m3 | m2]
  std::vector<double> behind;                // (n) how far behind its side particles see a point at most [m]
  std::int64_t count() const { return std::int64_t(mesh.size()); }
};

// A step whose length and scheme are known, and the bodies that move by it.
struct FluidStep {
  MeshSet* meshes = nullptr;
  cairn_scheme scheme{};
  double time = 0; // at its begin [s]
};

class FluidSkins {
public:
  void set(int dim, FluidSkin points, std::vector<double> size);
  std::int64_t count() const { return points_.count(); }
  bool empty() const { return meshes_.empty(); }

  // Bodies as the step begins: velocities that they would end with without the liquid, and the rate of change by them.
  void load(Scene& scene, const FluidStep& step);
  // Half a kick by the liquid and by all else.
  void accelerate(double dt);
  void move(double dt);
  // Records of the points where the nodes are, see fluid.h.
  void place(double* records) const;
  // Forces of points (3, n) to nodes, and how nodes answer.
  void take(const double* records, const double* forces, double thickness);
  // Mass of the liquid that a side moves, in a layer of a thickness [m], over the least that the body sets against it.
  double burden(double density, double layer, double spacing, double thickness);
  // Mean forces of the step beside the loads that the bodies have; loads as they were; what contacts changed.
  void give(double h);
  void put_back();
  void end(const Scene& scene, double h);
  // Places at which the list was made (3, n), kept and put into records.
  void keep_listed(const double* records);
  void show_listed(double* records) const;
  double way(const double* records) const; // the farthest of a point since then [m]

  // Mean forces of the last step on the nodes of a mesh, by the id of its first one (dim, nodes) [N]; none: empty.
  std::vector<double> forces(std::int64_t first_node) const;
  std::int64_t bytes() const;

  struct State { // of a checkpoint, and of a step that may be undone
    std::vector<double> force, contact, contact_before, listed;
  } state;

private:
  struct Mesh {
    std::int64_t id = 0; // of its first node
    MeshBody* body = nullptr;
    std::int64_t first = 0, dofs = 0, row = 0; // among dofs of all; of its first node in the scene
    std::int8_t slip = 0;
    std::vector<double> begin, end; // loads that it has [N]
  };
  void answer();

  int dim_ = 2;
  FluidSkin points_;
  std::vector<double> size_; // (n) of the base of a side at the start, |g1 x g2|
  std::vector<Mesh> meshes_;
  std::vector<double> place_, velocity_, constant_, kept_, answer_, impulse_, mean_; // (dofs of all)
  bool given_ = false;
};

} // namespace cairn
