// Rigid bodies that are made deformable, and rigid again, by what their contacts bore in a step.
#pragma once
#include <cstdint>
#include <limits>
#include <vector>

#include "../scene/mesh_parts.hpp"
#include "contact_loads.hpp"
#include "transforms.hpp"

namespace cairn {

struct ReshapeWatch {
  std::vector<std::int64_t> bodies; // ids
  MeshDraft draft;                  // of the shape of each
  std::int32_t node_material = -1, side_material = -1;
  double force = std::numeric_limits<double>::infinity();  // of one contact, above which a body is made deformable [N]
  double stress = std::numeric_limits<double>::infinity(); // or a principal value of its mean stress [Pa]
  double back = 0;                                         // rigid again when no contact bears that [N]; 0: never
  double volume = 0;                                       // of the mesh [m3]; found as it is added
};

class ReshapeWatches {
public:
  // Looks after each step from now on. Throws Error for thresholds, bodies and meshes that cannot be.
  void add(Simulation& s, const Transforms& transforms, ReshapeWatch watch);
  // After a step. All is weighed before anything is reshaped. Throws Error of what could not be.
  void look(Simulation& s, Transforms& transforms);

private:
  void weigh(Simulation& s, const Transforms& transforms);

  std::vector<ReshapeWatch> watches_;
  ContactLoads loads_;
  std::vector<std::int64_t> rigid_;                              // watched ones that are rigid bodies now
  std::vector<std::size_t> of_rigid_, meshes_, of_mesh_, above_; // their watches; meshes among these, theirs
  std::vector<std::int64_t> below_;                              // bodies that meshes were
};

// The mesh among those of the simulation that a body is now, -1: none.
std::int64_t mesh_of_body(const Simulation& s, const Transforms& transforms, std::int64_t id);

} // namespace cairn
