// Contacts of the present step as plain arrays, in the order of the candidates.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "../laws/law_info.hpp"

namespace cairn {

class AssemblyInput;
class BatchStorage;
struct ContactSystem;
struct LawRows;

// The assembled contacts as plain arrays, in the order of the candidates, for whoever wants to solve them elsewhere.
struct ContactRows {
  std::vector<double> axes;         // (dim, dim, count): normal, tangents, each in space axes
  std::vector<double> lever;        // (dim, 2, count) of A, of B, in space axes [m]
  std::vector<double> bias, mu;     // (dim, count) [m/s], (count) [-]
  std::vector<double> compliance;   // (dim, count) of the law, on the diagonal of W [1/kg]
  std::vector<std::int32_t> bodies; // (2, count) internal numbers, -1 of a mesh
  std::vector<std::int32_t> kind;   // (count) 0: nothing there moves, 1: Coulomb's cone, 2: a law with its own solution
  // Sides on meshes, if there are any: number of the mesh, -1 for others (2, count); nodes and weights (4, 2, count),
  // unused weights 0.
  std::vector<std::int32_t> mesh, node;
  std::vector<double> weight;
};

// Reads the contacts of a step; arrays are the caller's.
class ContactViews {
public:
  ContactViews(const AssemblyInput& in, const BatchStorage& storage, ContactSystem& system)
      : in_(in), storage_(storage), system_(system) {}
  std::int64_t count() const;
  void impulse_local(double* out) const;     // (c, count), c = dim: n, t [, s] [N s]
  void impulse_space(double* out) const;     // (dim, count), on A [N s]
  void moment_space(double* out) const;      // (1 or 3, count), on A, of bonds; zero elsewhere [N m s]
  void relative_velocity(double* out) const; // (dim, count), at the end of the step, local; after update_velocity [m/s]
  void status(std::int32_t* out) const;      // (count), see cairn_contact_status
  void keys(std::int64_t* out) const;        // (4, count): ids of the contactors, feature, image
  void dissipated(double* out) const;        // (count), after update_velocity [J]
  void stored(double* out) const;            // (count), in the springs of laws, after commit [J]
  void soundness(double* out) const;         // (count) of pairs that laws keep, 1 sound to 0 broken, after commit
  // (count) of laws that have a state variable of that name, 0 elsewhere; after commit.
  void law_state(const std::string& name, double* out) const;
  // (count) forces with which liquids between bodies that touch draw them: these press a spot beside impulses; 0
  // elsewhere; after commit [N].
  void attraction(double* out) const;
  ContactRows rows() const;    // after assemble
  LawRows law_rows(Law) const; // of the contacts of a law with a solution of its own; after update_velocity

private:
  const AssemblyInput& in_;
  const BatchStorage& storage_;
  ContactSystem& system_;
};

} // namespace cairn
