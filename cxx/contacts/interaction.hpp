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
#include "joint_miss.hpp"
#include "rope_ends.hpp"

namespace cairn {

struct ContactSystem;
class MeshSet;
class Scratch;

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

struct FrictionProblem;
struct Nodes;
struct LawRows;

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
  // Where impulses act: in the middle of the gap, or on each body's own surface, as LMGC90 has it.
  void act_on_surfaces(bool surfaces);
  // Where laws hold: in the middle of the flight to the next detection, of second order on curved surfaces (see
  // midpoint_motion.hpp), or at detection, as LMGC90 has it.
  void hold_at_detection(bool there);
  // Limit of the overlap of rigid bodies over the size of the smaller one: part_overlaps takes back the rest; see
  // overlap_limit.hpp.
  void limit_overlap(double share);
  // Velocities (3 | 6, bodies) that take back overlap in a step, the smallest in the metric of mass; at the velocities
  // of its end. persisting: of contacts alone that press in this step and did in the last one. False: there is none.
  bool part_overlaps(const Bodies&, bool persisting, Array<double>& velocity);
  bool overlap_adds_up() const; // in a dense pack, so that the last step did not end early
  // Share of position errors of joints and bonds on meshes that a step corrects, where its integrator moves bodies by
  // part of a jump beside their velocities (mesh_jumps.cpp): correcting all at once would feed back and grow.
  void correct_meshes_by(double share);
  // Joints go by the middle of the flight: the share of the end of the step in forces of their springs, and that of the
  // step which is left when contacts are detected.
  void centre_joints(double share, double left);
  void measure_from(const std::array<double, 3>& origin); // of the scene [m]
  // Once a solution is there; small: no more than `least` of the speed of joints.
  JointMiss miss_of_joints(const Bodies&, double least);
  // Stores the biases for the next solution and the present position errors; then sets biases that correct a share of
  // these.
  void keep_joints();
  void correct_joints(double share);
  std::string name_of_joint(std::int64_t contact) const;
  // True if joints came in, or the step length changed, so that joints do not yet fit the place of detection. See
  // joint_seats.cpp.
  bool must_project_joints() const;
  void joints_projected();
  // Selects the joints to project, as assembled, before bodies are displaced.
  void choose_joints_to_project(const Bodies&);
  // Largest position error of these joints, as assembled, over that of rounding; 0 if below 1.
  double joint_violation() const;
  // Velocities (3 | 6, bodies) that undo it in a step, the smallest in the metric of mass. False: there are none, or
  // they are more than those of the bodies. Impulses at hand are lost.
  bool project_joints(const Bodies&, Array<double>& velocity);
  // Loads by the impulses at hand, in the order of bodies; see joint_swing.hpp.
  void loads_of_joints(std::vector<JointLoad>& loads) const;
  // Largest square of step times rate at which bars and ropes swing across their axis, beyond the implicit part.
  double swing_across() const;
  // After these; settled: they miss no more than they may. See joint_drift.hpp.
  bool ease_joints(const Bodies&, bool settled);
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

  // Views of the present step, in the order of the candidates; out arrays are the caller's.
  std::int64_t count() const;
  void impulse_local(double* out) const;     // (c, count), c = dim: n, t [, s] [N s]
  void impulse_space(double* out) const;     // (dim, count), on A [N s]
  void moment_space(double* out) const;      // (1 or 3, count), on A, of bonds; zero elsewhere [N m s]
  void relative_velocity(double* out) const; // (dim, count), at the end of the step, local; after update_velocity [m/s]
  void status(std::int32_t* out) const;      // (count), see cairn_contact_status
  void keys(std::int64_t* out) const;        // (4, count): ids of the contactors, feature, image
  void dissipated(double* out) const;        // (count), after update_velocity [J]
  void stored(double* out) const;            // (count), in the springs of laws, after commit [J]
  void kept(double* out) const; // (count) soundness of pairs that laws keep, 1 sound to 0 broken, after commit
  // (count) of laws that have a state variable of that name, 0 elsewhere; after commit.
  void law_state(const std::string& name, double* out) const;
  // (count) forces with which liquids between bodies that touch draw them: these press a spot beside impulses; 0
  // elsewhere; after commit [N].
  void attraction(double* out) const;
  ContactRows rows() const; // after assemble
  bool jointed() const;     // joints are among them
  // The contacts of a step among bodies that joints hold, each limit and motor of these as a contact after the others;
  // the impulses at hand stay. Throws Error where laws with a solution of their own are beside, or it has no factors.
  FrictionProblem jointed_problem(const Bodies&);
  LawRows law_rows(Law) const;           // of the contacts of a law with a solution of its own; after update_velocity
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
