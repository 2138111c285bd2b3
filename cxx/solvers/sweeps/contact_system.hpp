// The contacts of a step as solvers see them: batches in the order of stages and tasks, and velocity records of bodies.
#pragma once
#include <memory>
#include <vector>

#include "../../base/field.hpp"
#include "../../bodies/condensed_body.hpp"
#include "cairn/core.h"

namespace cairn {

class MovingCell;
struct ActiveSetMemory;
struct RefinementMemory;
struct RestMemory;
struct SolidMemory;

// A velocity of all that moves: of rigid bodies (3 | 6, n), of nodes of meshes (dim, n); null: there are none.
struct Velocities {
  Velocities(const Field<double>& of_bodies, const Field<double>* of_nodes = nullptr)
      : bodies(of_bodies), nodes(of_nodes) {}
  const Field<double>& bodies;
  const Field<double>* nodes;
};

struct ContactSystem {
  int dim = 2;
  std::int64_t bodies = 0;
  std::vector<cairn_batch> batches;
  std::vector<std::int32_t> first_task, first_batch; // of each stage, of each task
  std::vector<std::int32_t> colour;                  // of each candidate, where ranks chose it: a stage each
  int colours = 0;                                   // 0: the plan chooses
  Array<cairn_record> record, general;               // (bodies + 1); the last is the spare one
  std::vector<CondensedBody> condensed;              // on which mapped sides rest
  std::vector<cairn_condensed> condensed_dofs;       // of them, as batches refer to them
  bool reaches = false;                 // the compliance of one of them is not formed, so that there is no W
  std::vector<double> condensed_change; // (dim, condensed) of their velocities as wholes: see measure_light
  Array<double> condensed_velocity;     // of their contact nodes, each body from a cache line on
  Array<double> work;
  Array<std::int32_t> candidate;         // (places of contacts, dummies included); -1: dummy
  Array<double> sums, change;            // (6, batches), (batches)
  bool serial = false;                   // a law must not be called by two threads at once
  Array<double> before, r_before, along; // velocities; impulses by place; by batch: see Extrapolation
  Array<std::int32_t> chosen;            // by task: see Extrapolation
  Array<double> best;                    // impulses in the order of batches: see BestImpulses
  Array<double> law_energy;              // (8, places), where ranks chose colours: see LawCommit [J]
  Array<double> kept_r, kept_u;          // impulses and relative velocities in the order of batches: see VelocityError
  double weight_speed_square = 0;        // |v_free - v|_M^2 of the bodies that move, what loads alone make of them [J]
  double begin_speed_square = 0;         // |v|_M^2 of rigid bodies that move, when the step begins [J]
  double mesh_speed_square = 0;          // |v_free|_M^2 of bodies that deform [J]
  std::shared_ptr<ActiveSetMemory> newton; // made by the first solve
  std::shared_ptr<SolidMemory> solid;      // made where bonds make a solid
  RefinementMemory* refinement = nullptr;  // of the run; null: none is kept
  RestMemory* rest = nullptr;              // likewise
  MovingCell* cell = nullptr;              // whose shape follows the stress; null: it does not
  bool grows = false;                      // bodies change their size
  bool clumps = false; // sides of bodies that are not round are those of clumps of balls, which sweeps may leap over
  bool pack = false;   // grains that do not bear on faces, where a strategy ends steps of dense packs early
  bool keeps_velocity = false; // records hold velocities of bodies to more digits than impulses give
  double penetration = 0;      // deepest overlap / size of the smaller body
  double drift = 0;            // deepest overlap beyond the limit of part_overlaps, over the same

  int velocities() const { return dim == 2 ? 3 : 6; }
  std::int64_t places() const { return batches.empty() ? 0 : batches.back().first + batches.back().count; }
  cairn_schedule schedule(int threads);
  bool may_hold() const;  // a contact's law is one of bonds or joints
  double speed() const;   // max(|v|_M, |h g|_M), of velocities in the records [sqrt(J)]
  bool compliant = false; // a batch has a compliance of its own
  // W is more than what bodies of six dofs give: contacts of a condensed body see each other, or have a compliance.
  bool needs_blocks() const { return compliant || !condensed.empty(); }
  void clear_velocities();
  // Velocities of the rows of condensed bodies: those of nodes; more of them; none.
  void load_condensed(const Field<double>& velocity);
  void add_condensed(const Field<double>& velocity);
  void clear_condensed();
  void read_condensed(std::int32_t body, std::int32_t row, double* velocity) const; // as it stands
  void clear_touched();                                                             // of bodies with contacts alone
  // velocities of bodies into the records; inverse masses stay
  void load(const Velocities& velocity);
  void unload(Field<double>& velocity, Field<double>* of_nodes = nullptr) const;
  // velocity = that of the records, to which `more` is then added
  void unload_and_add(Field<double>& velocity, const Velocities& more);
};

// True if all initial impulses are zero.
bool begins_from_nothing(const ContactSystem&);

// Solver of single contacts of a batch: its law's own, or that of the cone for its blocks.
cairn_law_solve* local_solver(const cairn_batch&, int dim);

// row k: side k of sides.def
const cairn_side* sides();
bool is_radial(std::int32_t side);

} // namespace cairn
