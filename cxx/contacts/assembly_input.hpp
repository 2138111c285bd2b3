// Input of the assembly of contacts.
#pragma once
#include <array>
#include <cstdint>

#include "../base/cell.hpp"
#include "../bodies/body.hpp"
#include "../contactors/contactor.hpp"
#include "../detection/candidates.hpp"
#include "../laws/law_table.hpp"
#include "../meshes/mesh_set.hpp"
#include "../solvers/sweeps/contact_system.hpp"
#include "contact_memory.hpp"
#include "contact_options.hpp"

namespace cairn {

// Read-only view of the scene that the contacts of a step are assembled from. Pointers are the caller's, and valid from
// assembly to commit.
class AssemblyInput {
public:
  explicit AssemblyInput(int dim) : dim_(dim) {}

  const Bodies* bodies = nullptr;
  const Contactors* contactors = nullptr;
  const Candidates* candidates = nullptr;
  const LawTable* laws = nullptr;
  const Cell* cell = nullptr;
  MeshSet* meshes = nullptr;                                 // null: none in the scene
  Nodes* nodes = nullptr;                                    // of these
  const double *temperature = nullptr, *potential = nullptr; // of bodies, then of nodes; null: the scene has none
  double h = 0, theta = 0;                                   // [s], [-]
  bool sheared = false;                                      // the periodic cell changes its shape
  ContactOptions options;

  int dim() const { return dim_; }
  bool has_jumps() const { return sheared || bodies->surface_velocity.active; } // see surface_motion.hpp
  bool at_midpoint() const { return options.configuration == LawConfiguration::midpoint; }
  double gap_share() const { return options.impulse_point == ImpulsePoint::own_surface ? 0 : 0.5; } // in a lever
  double theta_of(const LawInfo& law) const { return law.joins ? options.joint_theta.value_or(theta) : theta; }
  std::int32_t body(std::int32_t contactor) const { // below 0: mapped
    return contactors->body.values[std::size_t(contactor)];
  }
  // Number of the carrier that two contacts may not move at once: bodies, then meshes.
  std::int32_t unit_of(std::int32_t contactor) const {
    const std::int32_t carrier = body(contactor);
    return carrier < 0 ? std::int32_t(bodies->count) + meshes->mesh_of(contactor) : carrier;
  }
  std::int64_t units() const { return bodies->count + (meshes ? std::int64_t(meshes->meshes.size()) : 0); }
  ContactKey key(std::int64_t i) const {
    const auto& id = contactors->id.values;
    return {id[std::size_t(candidates->contactor_a[i])], id[std::size_t(candidates->contactor_b[i])],
            candidates->feature[i], candidates->image[i]};
  }
  // Free velocities, or another field of them.
  Velocities free(const Bodies& from) const { return {from.velocity_free, meshes ? &nodes->velocity_free : nullptr}; }

  bool has_fields() const { return temperature || potential; }
  // Value at a body, or the weighted mean over the nodes of a mapped contactor.
  double value_at(const double* value, std::int32_t contactor) const;
  // Temperatures and potentials of both sides of a contact, columns n apart.
  void fields_of(std::int64_t contact, std::int64_t n, double* out) const;

  // Carrier of a contactor: its position [m], and vectors of its axes in axes of space.
  void carrier_at(std::int32_t contactor, double* x) const;
  void carried(std::int32_t contactor, const double* own, double* out) const;
  bool on_mesh_side(std::int32_t contactor) const { return body(contactor) < 0 && meshes->turns(contactor); }
  // Unit outward normal of a triangle or of an edge of a mesh.
  void normal_of_side(std::int32_t side, double* m) const;
  // Vector between both ends of an anchored contact [m].
  void between_ends(std::int32_t contactor_a, std::int32_t contactor_b, std::int32_t image, const Anchor& anchor,
                    double* between) const;

private:
  int dim_;
};

// Impulse and moment of a contact on A in space axes; m has 3 components, in 2D its last counts.
void space_impulse(int dim, const cairn_batch& b, int lane, double p[3], double m[3]);

// f(batch, lane, candidate) for every contact that is batched.
template <class F>
void each_contact(const ContactSystem& system, F&& f) {
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane) f(b, lane, std::int64_t(system.candidate[b.first + lane]));
}

} // namespace cairn
