// Replacement of bodies between steps, rigid by deformable and back, and transfer of their contact memory.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "../bodies/rigid_motion.hpp"
#include "../simulation/simulation.hpp"

namespace cairn {

// Where a rigid body is and how it moves; spin: its angular momentum about its centre of mass.
struct RigidMotion {
  double mass = 0, kinetic = 0;
  std::array<double, 3> position{}, velocity{}, spin{}; // absolute [m], [m/s], [N m s]
  Rotation rotation = upright;
};
RigidMotion motion_of(const Scene& scene, std::int64_t body);

// A mesh in the place of a body. own: places of its nodes from their centre of mass, as the body came in; base: to the
// axes of the body from those in which the mesh is at rest; turned: own, as the body stands (dim, n) [m].
struct MeshPlace {
  std::vector<double> own, turned, reference, displacement;
  Rotation base = upright;
  double factor = 1; // of its density
};
// mass, points (dim, n): of the mesh as it is given; start: how the body stood as it came in; large: the mesh bears
// large rotations, and turns by displacements.
MeshPlace place_of(int dim, const SparseMatrix& mass, std::span<const double> points, const RigidMotion& at,
                   const Rotation& start, bool large);
// Velocities of its nodes with the momentum of the body, by the mass that it has there; and their energy.
std::vector<double> velocities_of(int dim, const SparseMatrix& mass, const MeshPlace& place, const RigidMotion& at,
                                  double& kinetic);
// How a body stands that came in as its mesh was made, where the nodes (dim, n) of that are now.
Rotation turn_of(int dim, const SparseMatrix& mass, std::span<const double> x, std::span<const double> own,
                 const Rotation& base);
// Velocity (3 | 6) of a body of these principal moments about its axes, with the momentum of nodes; and its energy.
std::vector<double> velocity_of(int dim, const NodesMotion& motion, const Rotation& axes,
                                std::span<const double> inertia, double& kinetic);

// Throws Error if a bond holds a body (or part of a mesh) that is to be replaced to another one: the new surface
// touches at other points, along other normals and with other areas, so the state of the bond has no meaning there.
// what: their name.
void check_unbonded(const Simulation& s, std::span<const std::int64_t> ids, const std::string& what);

// Transfer of contact memory to new bodies: each impulse goes to the nearest contacts of the new bodies with the same
// neighbours. A contact between two new bodies is shared by its distances from them, so that force and moment are
// preserved. Made before the old bodies are removed; strategies other than NSCD transfer nothing.
class PassedContacts {
public:
  // ids: bodies to remove, or parts of meshes; h: step by which contacts are searched [s], 0: that of the memory.
  PassedContacts(Simulation& s, double h, std::span<const std::int64_t> ids);
  void pass_to(Simulation& s, std::span<const std::int64_t> ids);

private:
  struct Seen { // a contact that was looked for
    ContactKey key{};
    std::array<double, 3> point{}, normal{};
    int side = 0; // of the bodies asked for: 1 the candidate, on which impulses act, -1 the antagonist; 0 neither
  };
  struct Passed { // impulses in space of a contact that there is now
    const Seen* to;
    std::size_t from; // key of the memory that it first had something of
    std::vector<double> impulse;
  };
  std::vector<Seen> look(Simulation& s, std::span<const std::int64_t> ids) const;
  void see(const Simulation& s, std::span<const std::int64_t> ids, ContactMemory& out) const;
  void pass_one(int dim, std::size_t key, const Seen& from, const std::vector<const Seen*>& near,
                std::vector<Passed>& passed) const;
  void keep(ContactMemory& to, std::size_t key) const;

  double h_;
  bool passes_ = false;
  std::vector<Seen> before_;
  ContactMemory memory_;
};

// Energy that the displacements of a mesh store, with that of its initial stress, as the next step begins from it [J].
// Throws Error.
double stored_at_begin(MeshBody& mesh, const Nodes& nodes);
// Terms of the balance; before there is one, with what initial stresses of bodies store.
Energy told_energy(Simulation& s);

} // namespace cairn
