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
#include "../solvers/refinement_memory.hpp"
#include "../solvers/solve_report.hpp"
#include "../solvers/solver_options.hpp"
#include "cairn/core.h"

namespace cairn {

struct ContactSystem;
class MeshSet;
class Scratch;

// Position errors of joints at the next detection, by the velocities of a solution.
struct JointMiss {
  double gap = 0;            // largest error along blocked directions [m]
  double error = 0;          // the largest, over the length of its joint; a turn [rad]
  std::int64_t contact = -1; // where that is, its place in the candidates; -1: nothing was measured
  double swing = 0;          // largest square of step times rate at which tension swings a body about its joint
  bool small = true;         // against how fast the bodies of any joint move against each other, or rounding
};

// Energy that the contacts took out of the bodies in one step [J], D = -sum r.(u+ + u-)/2.
struct ContactEnergy {
  double normal = 0, tangential = 0; // rotation components of bonds count as tangential
  double cell_work = 0;              // that a moving periodic cell gave through its boundary, -sum r.jump
  double created = 0;                // by contacts whose impulses gave energy, as restitution with friction can
  double turned_over = 0;            // sum of the energies that each contact took or gave
  double grown = 0;                  // that bodies gave which grew
  double driven = 0;                 // that motors of joints gave
  // Energies told by laws; normal and tangential are without these.
  double stored = 0, stored_change = 0, released = 0; // in their springs now, gained in the step, spent for good
};

// The condition that a strategy poses at contacts, a row of poses.def; null: Moreau's, as laws prepare it.
struct ContactPose {
  cairn_pose* kernel = nullptr;
  double params[2] = {0, 0};
};

// Where a bond of bodies with sides, or a joint, holds on to them: points that they carry, from their centres of mass.
struct Anchor {
  double a[3] = {}, shape_a[3] = {}; // of A in its axes, now and as its shape came in [m]
  double b[3] = {}, shape_b[3] = {}; // of B in its axes
  double normal[3] = {};             // in the axes of B
  double turn[4] = {};               // of A against B when a joint, or a bond, was made: a quaternion, in 2D an angle
  double length = 0;                 // between the points of a joint then [m]; of a bond held fast 1
  double siblings = 0;               // anchors that the pair began with
  double reach = -1; // what detection finds nearer than this is the anchored contact itself [m]; below 0: no anchor
};

// Contactors that a rope over a pulley runs between; -1: one of them is gone.
struct RopeEnds {
  std::int32_t near = -1, pulley = -1, far = -1;
};
// Nothing for a material that is no rope's.
std::optional<RopeEnds> rope_ends(const Contactors& contactors, const LawTable& laws, int material);

// Contact data for a bit-identical restart.
struct ContactMemory {
  double h = 0;                           // step that the impulses belong to [s]; 0 before the first
  std::int64_t contactors_seen = 0;       // contactor ids below this one can no longer bond on first sight
  std::vector<std::int64_t> seen_besides; // nor can these, rising: they took the place of others that were seen
  bool has_seen(std::int64_t contactor) const {
    return contactor < contactors_seen || std::binary_search(seen_besides.begin(), seen_besides.end(), contactor);
  }
  int impulse_components = 0, state_components = 0;
  bool joints_came = false;     // since joints were seated, see joint_seats.cpp
  bool gaps_of_bonds = false;   // states of pairs that are held are their gap alone, as files had it once
  std::vector<ContactKey> keys; // contacts with an impulse or a state
  std::vector<double>
      impulses; // (impulse_components, keys) 2D: n, t [, moment]; 3D: x y z in space axes [, moment x y z]
  std::vector<double> states;  // (state_components, keys), vectors in space axes, of anchored ones in those of B
  std::vector<Anchor> anchors; // (keys), empty where no contact is anchored
  RefinementMemory refinement;
  RestMemory rest;
  std::vector<RimSeat> seats; // by ids: nodes of meshes that lie on flat sides, see detection/rims.cpp
  std::vector<double> forces; // (dim, keys) at the end of the step, as impulses; empty where no strategy needs them
};

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
  // contact_flight.cpp), or at detection, as LMGC90 has it.
  void hold_at_detection(bool there);
  // Limit of the overlap of rigid bodies over the size of the smaller one: part_overlaps takes back the rest; see
  // overlap.cpp.
  void limit_overlap(double share);
  // Velocities (3 | 6, bodies) that take back overlap in a step, the smallest in the metric of mass; at the velocities
  // of its end. persisting: of contacts alone that press in this step and did in the last one. False: there is none.
  bool part_overlaps(const Bodies&, bool persisting, Array<double>& velocity);
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
  bool seats_joints() const;
  void joints_seated();
  // Selects the joints to correct, as assembled, before bodies are displaced.
  void choose_joints_to_seat(const Bodies&);
  // Largest position error of these joints, as assembled, over that of rounding; 0 if below 1.
  double joints_off() const;
  // Velocities (3 | 6, bodies) that undo it in a step, the smallest in the metric of mass. False: there are none, or
  // they are more than those of the bodies. Impulses at hand are lost.
  bool seat_joints(const Bodies&, Array<double>& velocity);
  // Loads by the impulses at hand, in the order of bodies; see joint_swing.cpp.
  void loads_of_joints(std::vector<JointLoad>& loads) const;
  // Largest square of step times rate at which bars and ropes swing across their axis, beyond the implicit part.
  double swing_across() const;
  // After these; settled: they miss no more than they may. See joint_flight.cpp.
  bool ease_joints(const Bodies&, bool settled);
  void pose(const ContactPose& pose);
  // Temperatures [K] and potentials [V] of bodies, then of nodes, for laws that ask, until the next call; null: none.
  void act_at(const double* temperature, const double* potential);
  // Reads bodies.velocity_free; leaves bodies unchanged.
  SolveReport solve(const Bodies&, const SolverOptions&);
  // Impulses (dim, count), local, that someone else solved for, instead of solve.
  void give_impulses(const double* local);
  // velocity = velocity_free + A^-1 H r; adds H r to `reaction` when that field is active. Also measures the contacts'
  // energy.
  void update_velocity(Bodies&);
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
