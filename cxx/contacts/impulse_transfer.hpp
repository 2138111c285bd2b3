// Impulses of contacts on bodies.
#pragma once
#include "assembly_input.hpp"

namespace cairn {

// Gives the impulses of a solution to the bodies that they act on.
class ImpulseTransfer {
public:
  ImpulseTransfer(const AssemblyInput& in, const ContactSystem& system) : in_(in), system_(system) {}
  void give_meshes() const; // to their nodes, in MeshBody::impulse
  void push_meshes() const; // velocities follow from one solution each
  void add_reactions(Bodies& bodies) const;

private:
  void give_moment(const cairn_batch& b, int lane) const;
  void pull_driven(Bodies& bodies, const cairn_batch& b, int lane) const;

  const AssemblyInput& in_;
  const ContactSystem& system_;
};

} // namespace cairn
