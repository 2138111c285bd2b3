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
  void end(double h);
  // Places at which the list was made (3, n), kept and put into records.
  void keep_listed(const double* records);
  void show_listed(double* records) const;
  double way(const double* records) const; // the farthest of a point since then [m]

  // The incompressible form, see fluid_skins_within.cpp. Points have six components, as bodies have; spins and moments
  // are 0.
  // Bodies where contacts are detected, whose free velocities are known.
  void stand(Scene& scene, MeshSet& meshes, double h);
  // The impulse of the liquid without pressure, as loads of the bodies (6, n) [N s].
  void take_known(Scene& scene, const double* impulse);
  // Velocities without pressure and contacts, after a pass of Newton's method as well.
  void renew_free(const Scene& scene);
  void show_begin(double* velocity) const;
  void show_free(double* velocity) const;
  void show_contacts(double* change) const;                              // as last known
  std::vector<double>& changes_by_contacts() { return within_.contact; } // (dofs of all) of velocities [m/s]
  void show_now(const Scene& scene, double* velocity);
  void respond(const double* impulse, double* change); // of velocities
  // The impulse of pressure, as loads of the bodies in the place of that before.
  void press(Scene& scene, const double* impulse);
  // The greatest velocity of a node by which contacts differ from what the pressure saw, once their impulses are given
  // to the bodies; they are known then.
  double take_contacts();
  double speed() const; // the greatest of a node that the liquid meets, under pressure

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
    void keep_loads();              // these, and makes room for those of the liquid
  };
  void find_bodies(MeshSet* meshes);
  void answer();

  int dim_ = 2;
  FluidSkin points_;
  std::vector<double> size_; // (n) of the base of a side at the start, |g1 x g2|
  std::vector<Mesh> meshes_;
  std::vector<double> place_, velocity_, constant_, kept_, answer_, impulse_, mean_; // (dofs of all)

  struct Within { // a step of the incompressible form, dofs of all
    double h = 0;
    std::vector<double> map;                       // (dim, dim, most, n) velocity of a point by that of a node
    std::vector<std::int8_t> met;                  // 1: points move with it
    std::vector<double> free, contact, pressed;    // velocities [m/s]
    std::vector<double> known, impulse;            // of the liquid, without and of pressure [N s]
    std::vector<double> nodal, change, now, force; // of a product or a stage
  };
  Within within_;
  void make_maps();
  void to_points(const std::vector<double>& of_nodes, double* of_points) const;
  void to_nodes(const double* of_points, std::vector<double>& of_nodes) const;
  void respond_nodes(const std::vector<double>& impulse, std::vector<double>& change);
  void add_loads(Scene& scene, const std::vector<double>& impulse);
  bool given_ = false;
};

} // namespace cairn
