// Rigid bodies made deformable in a run, and back, by hand: momentum, angular momentum, ids, contacts and impulses pass
// over; what the kinetic and the stored energy lose is a term of the balance, dissipated_reshaping.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "../contactors/contactor.hpp"
#include "../scene/mesh_parts.hpp"
#include "reshaping.hpp"

namespace cairn {

// A rigid body of another shape, in the place of a mesh. axes: how it stands; mass [kg] and inertia (1 | 3) [kg m2]: of
// the shape, to be scaled to the mass of the mesh; add_contactors: gives them to the body of that id.
struct OtherShape {
  Rotation axes = upright;
  double mass = 0;
  std::vector<double> inertia;
  std::function<void(Scene& scene, std::int64_t id)> add_contactors;
};

class Transforms {
public:
  // How bodies stand as they come in, from a number on, or with the scene: a mesh is of their shape then.
  void came_in(const Scene& scene, std::int64_t first = -1);
  // After a restart: of bodies that came in within a run that is not known, nor whose their numbers were here.
  void restarted(const Scene& scene);

  // A mesh of cells, of the shape of body `id` as it came in, takes its place, mass and momentum; it touches with its
  // whole surface where it is not said with what. Materials below 0: that of the contactors of the body. Returns its
  // number among the meshes. Throws Error; the simulation is then as it was.
  std::size_t deform(Simulation& s, std::int64_t id, MeshDraft draft, const std::string& name,
                     std::int32_t node_material, std::int32_t side_material);
  // Checks the arguments of deform() without any change. Throws Error.
  void check(const Simulation& s, std::int64_t id, const MeshDraft& draft) const;
  // The body that a mesh was, where its nodes stand; returns its id, which is its own again. Given another shape, which
  // a mesh that was never a rigid body needs: a new body. Throws Error as above.
  std::int64_t rigidify(Simulation& s, std::size_t mesh, const OtherShape* shape = nullptr);
  // Id of the rigid body that a mesh replaced, -1: none.
  std::int64_t former_id(const MeshBody& mesh) const;

  // Forces that bodies had, on their nodes in a step of h [s]; until the mesh has loads of its own.
  void load(Simulation& s, double h);
  void has_loads(const MeshBody& mesh);

private:
  struct Shape { // a contactor of the body
    cairn::Shape shape{};
    std::int32_t material = 0, hull = -1;
    double radius = 0;
    std::vector<double> offset, direction; // empty: none
  };
  struct Former { // rigid body
    std::int64_t id = -1;
    Rotation start = upright, base = upright; // as it came in; to its axes from those of the mesh where it is at rest
    std::vector<double> own;                  // places of the nodes from their centre of mass, as it came in
    std::vector<Shape> shapes;
    double mass = 0, damping = 0;
    std::vector<double> inertia, force; // (1 | 3), (3 | 6) or empty
    bool pushes = false;                // the force is still on its nodes
  };
  Former former_of(const Scene& scene, std::int64_t id) const;
  static void check_cells(const MeshDraft& d, std::int64_t id, int dim);
  void check_draft(const Simulation& s, const MeshDraft& d, std::int64_t id) const;
  Former replaced(const Simulation& s, const MeshBody& mesh, const OtherShape* shape, const NodesMotion& motion) const;
  std::int64_t put_back(Scene& scene, const Former& of, const NodesMotion& motion, const Rotation& axes,
                        double& kinetic);

  std::int64_t within_ = 0;                // bodies from here on came in within a run
  std::map<std::int64_t, Rotation> start_; // of bodies that did not come in upright
  std::set<std::int64_t> unknown_;         // bodies whose initial rotation is not known
  std::map<std::int32_t, Former> formers_; // by the numbers by which contactors name meshes
};

} // namespace cairn
