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
#include "../laws/law_rules.hpp"
#include "cairn/core.h"

namespace cairn {

struct ContactSystem;
class MeshSet;
class Scratch;

// Rows of laws.def, in its order; their names stand in laws/law_names.hpp.
enum class Law : std::int16_t;

// What a row of laws.def declares, read once.
struct LawParameter {
  std::string name;
  bool required = false; // no default
  double standard = 0, smallest = 0, largest = 0;
};
struct LawInfo {
  std::string name, python_name;
  int components2 = 0, components3 = 0;
  std::vector<LawParameter> parameters;
  std::vector<std::string> state;  // "name*": a vector in the tangent plane
  std::vector<double> state_begin; // of a contact that is new
  bool has_prepare = false, has_solve = false, has_commit = false;
  bool normal_bias = false; // no bias of tangential velocities
  bool yields = false;      // may have a compliance: its contacts keep room for one
  // A pair stays a contact while its first state variable is above 0, which is 1 where bodies came in together and
  // touched; holds: it is then held fast, and under Coulomb's cone, with the first parameter, where it is 0.
  bool keeps = false, holds = false;
  // Where bodies with sides are kept, it is at points that they carry: along the normal there, or along the line
  // between.
  bool anchored = false, joins = false, spans = false;
  bool keeps_area = false; // as the state "area": solve and residual ask for no geometry in params
  // The parameter that says up to which gap the law acts, "reach", or a place from which it counts; -1: none.
  int reach = -1;
  bool reaches_back = false; // that parameter times -1
  int within = -1;           // the parameter "within": a gap up to which bodies that come in together touch; -1: none
  cairn_law_prepare* prepare = nullptr;
  cairn_law_solve* solve = nullptr;
  cairn_law_commit* commit = nullptr;
  cairn_law_residual* residual = nullptr; // with solve: how far from it
  cairn_law_energy* energy = nullptr;
  cairn_law_force* force = nullptr; // serves smooth strategies, as prepare serves NSCD
  cairn_law_stiffness* stiffness = nullptr;
  // Of laws from a user's library alone: where it is, whether threads may call it at once, what it says of a failure.
  std::string library;
  bool thread_safe = true;
  const char* (*complaint)() = nullptr;
  bool plugged() const { return !library.empty(); }
  double acts_from(const double* params) const { // a gap [m]
    return reach < 0 ? 0 : std::max(0.0, reaches_back ? -params[reach] : params[reach]);
  }
  // Numbers of the state as the law sees it, and as it is kept: vectors in space axes.
  int state_columns(int dim) const { return state_numbers(dim - 1); }
  int state_kept(int dim) const { return state_numbers(dim == 2 ? 1 : 3); }
  int state_numbers(int of_vector) const {
    int all = 0;
    for (const std::string& name : state) all += name.back() == '*' ? of_vector : 1;
    return all;
  }
  // Where a state variable begins among the columns that the law sees; -1: it has none of that name.
  int state_column(const std::string& variable, int dim) const {
    int column = 0;
    for (const std::string& name : state) {
      if (name == variable) return column;
      column += name.back() == '*' ? dim - 1 : 1;
    }
    return -1;
  }
  int components(int dim) const { return dim == 2 ? components2 : components3; }
};
// Rows of laws.def, then the laws that were plugged in, in their order. References stay valid.
const std::vector<LawInfo>& law_infos();
// Adds a law, or replaces the one of the same name if `replace` says so. Throws std::invalid_argument.
Law register_law(LawInfo law, bool replace);
// Parameters "name:default:smallest:largest" and state "name:value of a new contact", separated by blanks.
// Throws std::invalid_argument for a word that cannot be read.
void declare_law(LawInfo& law, const std::string& parameters, const std::string& state);

// Which law, with which parameters, rules a pair of materials (or groups): see LawRules.
class LawTable {
public:
  static constexpr int max_parameters = 20, max_states = 20;
  struct Entry {
    Law law;
    std::int16_t place = 0; // of the law among those of the table
    double params[max_parameters];
    std::int32_t first_curve = 0, curves = 0; // parameters that depend on temperature
  };
  // A parameter by the mean temperature of both sides [K]: piecewise linear, constant beyond its ends.
  struct Curve {
    int parameter = 0;
    std::vector<double> temperature, value;
    double at(double t) const;
  };
  LawTable() = default;
  explicit LawTable(std::vector<std::string> material_names); // numbered as contactors.material
  // Materials that may be of a group, "" if not.
  LawTable(std::vector<std::string> material_names, const std::vector<std::string>& groups);
  int materials() const { return int(names_.size()); }
  // Both orders of the pair. Throws std::invalid_argument naming parameter, value and range.
  void set(int material_a, int material_b, Law law, std::span<const double> params);
  void set_default(Law law, std::span<const double> params); // for pairs that have none of their own
  // Rules by the names of materials and groups or "*"; one that names nothing of the scene has no effect. After the
  // last of them: settle.
  void rule(const std::string& a, const std::string& b, Law law, std::span<const double> params,
            std::span<const Curve> curves = {});
  void pass_through(const std::string& a, const std::string& b);
  void keep_apart(std::span<const std::int32_t> materials) { rules_.keep_apart(materials); }
  // Numbers the laws that pairs of materials have by the first pair that has each, and forgets those that none has.
  void settle();
  // -1 if the pair has no law
  int find(int material_a, int material_b) const {
    const std::int32_t rule = rules_.between(material_a, material_b);
    return rule < 0 ? -1 : entry_of_[std::size_t(rule)];
  }
  const Entry& entry(int i) const { return entries_[i]; }
  int entries() const { return int(entries_.size()); }
  const std::vector<Law>& laws() const { return laws_; } // that the table has, each once
  const std::string& name(int material) const { return names_[material]; }
  const LawRules& rules() const { return rules_; }
  const std::vector<Curve>& curves() const { return curves_; }

private:
  int add(Law law, std::span<const double> params, std::span<const Curve> curves = {});
  void take(const Entry& entry);
  std::vector<std::string> names_;
  LawRules rules_;
  std::vector<std::int32_t> entry_of_; // of the rules; -1: a rule by which they pass through each other
  std::vector<Entry> entries_;
  std::vector<Curve> curves_;
  std::map<std::vector<double>, std::int32_t> known_; // law and parameters of the entries
  std::vector<Law> laws_;
};

struct SolverOptions {
  double tolerance; // on the true error (DESIGN, section 5)
  int min_iterations;
  int max_iterations;
  int threads;                 // 0: as OpenMP decides
  std::string solver = "nlgs"; // in steps: nlgs, auto, or a solver of problems (friction_problem.hpp)
  // On the velocities that impulses leave, see VelocityError; infinity: not asked for.
  double accuracy = std::numeric_limits<double>::infinity();
  bool extrapolates = true;      // sweeps begin beyond the last one: see Extrapolation
  bool associated_start = false; // see AssociatedStart
  // The same problem but for its biases was solved just now, and the step begins with its impulses: 1, or 2 where
  // Newton's method over bodies found them.
  int again = 0;
  double softening_relaxation = 1; // share of its change that a bond which softens takes in a sweep
  double max_bytes = 1e9;          // of factors, and of W where a solver takes it in blocks
};

enum class SolveStatus { converged, iteration_limit, diverged, newton_limit };

struct SolveReport {
  SolveStatus status = SolveStatus::converged;
  std::int64_t contacts = 0; // candidates that were solved
  int iterations = 0;
  int checks = 0;                  // evaluations of the error
  double error = 0;                // natural map, energy norm, relative
  double worst_error = 0;          // of one contact, on its own scale, at least a millionth of the mean: 0 to 1
  std::int64_t worst_contact = -1; // its place in the candidates
  double light_error = 0; // where masses differ: speeds that break the law, on the scale of lighter bodies (LightError)
  std::int64_t light_contact = -1;                                  // where it is largest, its place in the candidates
  double velocity_error = std::numeric_limits<double>::quiet_NaN(); // estimated, see VelocityError; NaN: not asked for
  double penetration = 0;                                           // deepest overlap / size of the smaller body
  double cone_distance = 0;                                         // distance of impulses outside the cone / impulse
  double energy_created = 0; // energy that contacts made from nothing / energy in play; once it is committed
  double joint_error = 0;    // largest error of a joint at the next detection / its length; a turn [rad]: see JointMiss
  double joint_gap = 0;      // largest distance there of points that a joint holds together [m]
  std::int64_t joint_contact = -1; // where joint_error is, its place in the candidates; -1: none was measured
  std::string joint_hint;          // what to do about it; empty: it is as small as was asked
  std::string hint;                // empty when converged
  const char* solver = "nlgs";     // that gave the answer
};

// What the loads of its joints resist turns of a body by: xx yy zz xy xz yz, in the plane one. [N m]
struct JointLoad {
  std::int32_t body;
  double stiffness[6];
};
// Of a stiffness by which something swings, the share that a step takes implicitly: none where the square of step times
// rate is small, and where it is large so much that this is 2 then (explicit steps hold below 4).
inline double implicit_share(double square) { return square > 1 ? 0.5 * (1 - 1 / square) : 0; }

// What joints of rigid bodies miss where the next step detects them, by the velocities of a solution.
struct JointMiss {
  double gap = 0;            // the largest along what is blocked [m]
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
  double turned_over = 0;            // sum of what each contact took or gave
  double grown = 0;                  // that bodies gave which grew
  double driven = 0;                 // that motors of joints gave
  // By laws that tell; normal and tangential are what is left besides.
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

// What solids of bonds taught a solver that steps through a run: see SolidCorrection::refine.
struct RefinementMemory {
  double amplification = 0;   // of errors, in velocities; 0: not known; infinity: it was not found
  double share = 0;           // by which passes gave way; 0: not known
  int failures = 0, idle = 0; // refinements in a row that came to nothing; steps until the next
};

// What a restart needs to go on to the same bits.
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
  // Of sides on meshes, if there are any: the mesh, -1 of others (2, count); nodes and their weights (4, 2, count), the
  // weight 0 where fewer.
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
  // Begins the memory of contacts that laws keep, of bodies that came in since the last step and touch. Returns what is
  // to be told of bodies that a law does not join since they touch without an area; empty: nothing.
  std::string bond(const Bodies&, const Contactors&, const Candidates&, const LawTable&, const Cell&, double h,
                   double theta, MeshSet* meshes, Nodes* nodes);
  void see_contactors(std::int64_t below); // those with a smaller id no longer come in
  // Contacts whose memory has an anchor are measured there, in place of what detection found near it. `numbers`: of
  // contactors A and B of each key of the memory, -1 if they are gone.
  void measure_anchored(const Bodies&, const Contactors&, const LawTable&, const Cell&,
                        std::span<const std::int32_t> numbers, Candidates&, MeshSet* meshes = nullptr,
                        Nodes* nodes = nullptr);
  // Where impulses act: in the middle of the gap, or on each body's own surface, as LMGC90 has it.
  void act_on_surfaces(bool surfaces);
  // Where laws hold: in the middle of the flight to the next detection, of second order on curved surfaces (see
  // contact_flight.cpp), or at detection, as LMGC90 has it.
  void hold_at_detection(bool there);
  // Which share of what joints and bonds on meshes miss a step makes good, where its integrator moves what impulses
  // hold beside their velocities (mesh_jumps.cpp): all of it at once would answer to that, and grow.
  void correct_meshes_by(double share);
  // Joints go by the middle of the flight: the share of the end of the step in forces of their springs, and that of the
  // step which is left when contacts are detected.
  void centre_joints(double share, double left);
  void measure_from(const std::array<double, 3>& origin); // of the scene [m]
  // Once a solution is there; small: no more than `least` of the speed of joints.
  JointMiss miss_of_joints(const Bodies&, double least);
  // Biases that the next solution begins from, and what was missed by that at hand; then biases by which a share of
  // this is made good.
  void keep_joints();
  void correct_joints(double share);
  std::string name_of_joint(std::int64_t contact) const;
  // Whether joints came in, or steps became another length, since joints held where contacts are detected. See
  // joint_seats.cpp.
  bool seats_joints() const;
  void joints_seated();
  // Which of them do: once, as they were assembled, before they are moved.
  void choose_joints_to_seat(const Bodies&);
  // How far these are off as they were assembled, over what rounding leaves.
  double joints_off() const;
  // Velocities (3 | 6, bodies) that undo it in a step, the smallest in the metric of mass. False: there are none, or
  // they are more than those of the bodies. Impulses at hand are lost.
  bool seat_joints(const Bodies&, Array<double>& velocity);
  // Loads by the impulses at hand, in the order of bodies; see joint_swing.cpp.
  void loads_of_joints(std::vector<JointLoad>& loads) const;
  // Largest square of step times rate by which bars and ropes swing across themselves beyond what is taken implicitly.
  double swing_across() const;
  // After these; settled: they miss no more than they may. See joint_flight.cpp.
  bool ease_joints(const Bodies&, bool settled);
  void pose(const ContactPose& pose);
  // What bodies, then nodes, have for laws that ask, until it is said again; null: the scene has none. [K], [V]
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
  void kept(double* out) const;              // (count) what is left of pairs that laws keep, 1 sound to 0, after commit
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
