// Mean contact forces and moments on rigid bodies and on meshes over the last step: criteria by which a body is made
// deformable, or rigid again.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "../simulation/simulation.hpp"

namespace cairn {

struct ContactLoad {
  double force = 0;               // the largest mean force of one contact over the step [N]
  std::array<double, 9> moment{}; // of bodies: sum of forces times their arms from the centre of mass [N m]
  // The largest size of a principal value of the symmetric part of the moment over the volume, the mean stress of a
  // body in balance under these forces [Pa] (Love 1927; Drescher & de Josselin de Jong 1972).
  double stress(int dim, double volume) const;
};

class ContactLoads {
public:
  // In a periodic cell arms are those to the nearest images: of bodies of less than half a cell.
  // Of rigid bodies by their ids, which are there, and of meshes by their numbers among those of the simulation. Of a
  // simulation without a step all is 0.
  void read(Simulation& s, std::span<const std::int64_t> bodies, std::span<const std::size_t> meshes);
  std::vector<ContactLoad> of_bodies, of_meshes;

private:
  void add(const Simulation& s, std::int64_t contact, std::int32_t contactor, bool other);

  std::vector<std::int32_t> slot_of_body_, slot_of_mesh_; // -1: not asked for
  std::vector<std::array<double, 3>> centre_;
  std::vector<double> impulse_;
};

} // namespace cairn
