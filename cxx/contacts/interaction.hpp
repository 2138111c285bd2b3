// Contacts of a step: assembled from candidates into batches, solved, committed; what the next step inherits follows
// the contact's key.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "../base/cell.hpp"
#include "../bodies/body.hpp"
#include "../contactors/contactor.hpp"
#include "../detection/candidates.hpp"
#include "../laws/law_table.hpp"
#include "../solvers/solve_report.hpp"
#include "../solvers/solver_options.hpp"
#include "cairn/core.h"
#include "contact_energy.hpp"
#include "contact_memory.hpp"
#include "contact_options.hpp"
#include "contact_views.hpp"
#include "rope_ends.hpp"
#include "step_joints.hpp"

namespace cairn {

struct ContactSystem;
class MeshSet;
class OverlapLimit;
class Scratch;

struct Nodes;

class Interactions {
public:
  explicit Interactions(int dim);
  ~Interactions();
  Interactions(Interactions&&) noexcept;
  Interactions& operator=(Interactions&&) noexcept;

  // The candidates stay the caller's and must not change until commit. velocities are those at the start of the
  // step, positions those of detection. nodes: of the meshes. Throws std::invalid_argument if a pair of materials has
  // no law (names both).
  void assemble(const Bodies&, const Contactors&, const Candidates&, const LawTable&, const Cell&, double h,
                double theta, MeshSet* meshes = nullptr, Nodes* nodes = nullptr);
  // Starts the memory of kept contacts for bodies that came in since the last step and touch. Returns a warning about
  // bodies that stay unjoined because they touch without an area; empty: none.
  std::string bond(const Bodies&, const Contactors&, const Candidates&, const LawTable&, const Cell&, double h,
                   double theta, MeshSet* meshes, Nodes* nodes);
  void see_contactors(std::int64_t below); // those with a smaller id no longer come in
  // Measures anchored contacts at their anchors, instead of the nearby contacts of detection. `numbers`: contactors A
  // and B of each key of the memory, -1 if they are gone.
  void measure_anchored(const Bodies&, const Contactors&, const LawTable&, const Cell&,
                        std::span<const std::int32_t> numbers, Candidates&, MeshSet* meshes = nullptr,
                        Nodes* nodes = nullptr);
  // Velocities (3 | 6, bodies) that take back overlap in a step, the smallest in the metric of mass; at the velocities
  // of its end. persisting: of contacts alone that press in this step and did in the last one. False: there is none.
  bool part_overlaps(const Bodies&, bool persisting, Array<double>& velocity);
  OverlapLimit& overlap();      // of the contacts as they were assembled, for ranks
  bool overlap_adds_up() const; // in a dense pack, so that the last step did not end early
  ContactOptions& options();    // of the next assembly; its pose is set by pose()
  void pose(const ContactPose& pose);

  // Temperatures [K] and potentials [V] of bodies, then of nodes, for laws that ask, until the next call; null: none.
  void act_at(const double* temperature, const double* potential);
  // Reads bodies.velocity_free; leaves bodies unchanged. moving: the cell that contacts were assembled in, if its shape
  // is to follow the stress; it gets the rates and the stress of the solution.
  SolveReport solve(const Bodies&, const SolverOptions&, Cell* moving = nullptr);
  // Impulses (dim, count), local, that someone else solved for, instead of solve.
  void give_impulses(const double* local);
  // velocity = velocity_free + A^-1 H r; adds H r to `reaction` when that field is active. Also measures the contacts'
  // energy.
  void update_velocity(Bodies&);
  // Work that the bodies of a contact of the system which grew give it in the step [J].
  double work_of_growth(const cairn_batch& b, int lane) const;
  // Impulses of the present solution on the nodes of meshes, each in its MeshBody::impulse; then the impulses as those
  // that the next assemble begins from, within the same step.
  void give_meshes() const;
  void keep_impulses();
  // After meshes got contact nodes for someone else: what contacts read of them is there again.
  void refresh_meshes(const Bodies&);
  // State of laws, then impulses and keys become the memory of the next step.
  ContactEnergy commit(bool converged = true);

  std::int64_t count() const;
  const ContactViews& views() const;
  StepJoints& joints();
  const std::vector<ContactKey>& kept(); // contacts whose first state is above 0, for laws that keep them
  void forget_impulses();                // the next step begins from none

  const ContactMemory& memory() const;       // after commit: what the next assemble will inherit
  void restore(ContactMemory);               // throws std::invalid_argument if sizes do not agree
  std::int64_t bytes() const;                // held for contacts
  std::int64_t body_bytes() const;           // held for bodies: velocity records
  Scratch& scratch();                        // where contacts stand, to be used until assemble: they are gone
  ContactSystem& system();                   // as solvers see it: batches, schedule, velocity records
  std::span<Anchor> anchors();               // of the memory, in the order of its keys; empty: none
  std::span<double> states(std::size_t key); // of the memory

private:
  struct State;
  std::unique_ptr<State> s_;
};

} // namespace cairn
