// Deformable body, by the matrices of its nodes or by the stresses of a material: its step and its interface to
// contacts.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "../base/field.hpp"
#include "../fe/internal_forces.hpp"
#include "../soe/soe.hpp"
#include "../soe/unit_reaches.hpp"
#include "cairn/core.h"
#include "mesh_pressure.hpp"
#include "mesh_ties.hpp"

namespace cairn {

struct ElementInfo;
struct Nodes;

// Cells of linear elasticity that the stiffness of a mesh is the sum of, for bounds of its frequencies.
struct ElasticCells {
  const ElementInfo* element = nullptr;
  std::vector<std::int32_t> node; // (nodes, cells)
  std::vector<double> elasticity; // times the thickness in 2D [Pa]
};

// Input of a mesh. Dof dim i + k is the displacement of node i along axis k.
struct MeshModel {
  int dim = 2;
  std::string name;
  std::vector<double> reference;         // (dim, nodes) [m], relative to the origin of the scene
  SparseMatrix mass, stiffness, damping; // lower triangles of one pattern; the last two empty where operators are given
  std::vector<double> node_mass;         // (nodes) that the scene shows [kg]; empty: the sums of the rows of mass
  std::vector<std::uint8_t> held;        // (dofs) 1: its velocity is given
  SoeOptions options;                    // of the system of equations
  std::int32_t number = 0;               // by which contactors name it, from 1
  std::vector<std::int64_t> node_ids, point_ids, side_ids; // of nodes, points, edges or facets, each rising
  // Points between nodes, edges (2D) and facets (3D): nodes and weights (4, each); of edges and facets the nodes alone.
  std::vector<std::int32_t> contact_nodes;                       // that are points of contact themselves
  std::vector<std::int32_t> point_nodes, side_nodes, face_nodes; // (4, n), -1 where fewer; faces: whose part a facet is
  std::vector<double> point_weights;                             // (4, points)
  bool mortar = false; // its contact nodes meet sides of other meshes on average
  std::vector<std::int32_t>
      whole_nodes; // (9, sides) of the side of a cell that each is a part of, -1 where fewer; empty: itself
  std::vector<std::int32_t> side_from, side_to;   // of each node the side that begins, or ends, there; -1: none
  bool self_contact = false;                      // its points meet its own sides
  std::vector<std::int32_t> around, around_start; // nodes that each facet sees, its own first; (facets + 1)
  MeshTies ties;                                  // dofs that follow others
  // Initial stresses of a linear body: their forces (dofs) [N], empty: none; their stored energy [J].
  std::vector<double> initial_force;
  double initial_energy = 0;
  std::vector<ElasticCells> cells; // of a linear body, if it is made of them
  // Modes that are damped besides, C = sum of rate (M f)(M f)': (dofs, modes), f' M f = 1, zero on held dofs, and their
  // rates 2 zeta omega [1/s]; empty: none.
  std::vector<double> modes, mode_rates;
  // Operators of another finite element code: products with stiffness and damping, and a solver of A x = b on free
  // dofs.
  std::function<void(const double*x, double*out)> times_stiffness, times_damping;
  std::function<std::function<void(double* b)>(double h, double theta)> make_solver;
  // Stresses of a material of solids, or forces of another code, in the place of stiffness, which then is that at the
  // start; null: linear.
  std::shared_ptr<InternalForces> bulk;
  // Measure of edges in the plane: ring: revolution about the line x = axis [m]; else thickness [m].
  bool ring = false;
  double thickness = 1, axis = 0;
  std::int64_t nodes() const { return std::int64_t(reference.size()) / dim; }
  std::int64_t dofs() const { return std::int64_t(reference.size()); }
};

// Where Newton's method of a mesh stands after a pass.
struct NewtonError {
  double error = 0; // norm of the residual over that of its terms, by the inverse of A, or over that of the forces of
                    // held dofs if larger; where all is rounding, over the terms of products
  std::int64_t node = -1; // where it is largest
  bool whole = true;      // the last change was taken whole
  BulkResult fault;       // of a cell that no part of the change leaves in order
};

// Works of a mesh over a step in the energy balance, beyond those of its nodes as point masses [J].
struct MeshWork {
  double elastic = 0, damping = 0, inertia = 0, kinetic_change = 0; // along the way
  double material = 0;                                              // dissipated at the points of the material
  double absorbed = 0;   // part of `elastic` of another code that tells neither its stored nor its dissipated energy
  double warmed = 0;     // given by what swelled at the begin of the step
  double binding = 0;    // by constraint forces of ties and rigid parts: zero but for the residual of the balance
  double beyond = 0;     // of loads and prescribed motions: mean of both ends less the integrator's value
  double drag = 0;       // of `damping`, in the mean of both ends
  double driven = 0;     // by supports with prescribed motion, in the mean of both ends
  double integrator = 0; // dissipated by the integrator, through inertia and the time of its elastic forces
  double stored = 0, stored_change = 0, kinetic = 0; // at the end of the step; kinetic: beside that of lumped masses
};

// Wall-clock time of the passes of Newton's method [s]. Contacts: columns of compliance, rows and solution; balance:
// residual at the stresses of a pass, and the solutions that measure it; all: the whole method.
struct NewtonSeconds {
  double assembly = 0, factorisation = 0, contacts = 0, balance = 0, all = 0;
};

// No less than the highest frequency of a mesh [1/s], and than any eigenvalue of M^-1 C [1/s]; infinity: unknown.
struct FrequencyBound {
  double omega = std::numeric_limits<double>::infinity(), rate = omega;
  bool known() const { return std::isfinite(omega) && std::isfinite(rate); }
};

class MeshBody {
public:
  explicit MeshBody(MeshModel model);

  MeshModel model;
  std::int64_t first_node = 0;              // where its nodes begin among those of the scene
  std::vector<double> load_begin, load_end; // (dofs) forces at both ends of the step [N]; empty: none
  std::vector<double> thermal_load;         // (dofs) of restrained expansion [N]; empty: none
  std::vector<double> held_velocity;        // (dofs) of held dofs at the end of the step [m/s]; empty: zero
  std::vector<PressedSides> pressed; // of bodies that are not linear: at the end of the step where these are then
  double time = 0;                   // at which the step at hand begins [s]
  MeshWork work;                     // of the last step
  // Its place among the nodes of the scene.
  std::int32_t node(std::int64_t i) const { return std::int32_t(first_node + i); }

  std::int64_t solves = 0, factorisations = 0; // forward and back, and of A, since the start

  NewtonSeconds newton_seconds;

  double size() const { return size_; } // of a cell, about [m]
  // A step of central differences that is certain to be stable [s], see mesh_stability.cpp; what opposes velocities
  // counts so many times, by drag_bound of the integrator.
  double stable_step(double rate_share, const Nodes& nodes);

  // Velocities of nodes at the end of the step without contacts, from those in `nodes`; of a step's begin.
  // Of a body whose stresses are a material's: Newton's method round the solution of contacts. free_velocity is its
  // first pass; after a solution, with `impulse` gathered, `judge` moves on, with a part of the change where the
  // whole one leaves more of the balance; `linearise` makes the free velocity of the next pass.
  bool linear() const { return !model.bulk; }
  // tolerance: on the error, by which judge guesses whether a pass is the last; else it makes the tangent of the next.
  NewtonError judge(double tolerance = 0);
  void linearise(Nodes& nodes);
  // The end of the step becomes the begin of the next; or the step was undone.
  void commit();
  void roll_back();
  // Results of the last step that views show: kept while another step is tried, shown again if that one is undone.
  struct Shown {
    Array<double> impulse;
    std::vector<double> reaction, stress;
  };
  void keep(Shown& to) const;
  void show(const Shown& from);
  // State for a checkpoint: internal forces at the begin of the next step [N], then their stored energy [J]; empty
  // before the first step. restore() throws Error for the state of another mesh.
  std::vector<double> memory() const;
  void restore(std::span<const double> state, std::span<const double> memory);
  void forget(); // as at the start
  // For a checkpoint, see mesh_touched.cpp: h, damping, stiffness, largest, mixed of factors, how often nodes came to
  // touch, how many there were after each time, and these nodes; of the next ones. Empty where nothing depends on it.
  std::vector<double> touched() const;
  void restore_touched(std::span<const double> of); // throws Error for the list of another mesh
  std::string describe(const BulkResult& fault) const;
  // Throws the description of a fault: StepTooLong with the advice where shorter parts of the step may mend it, else
  // Error.
  [[noreturn]] void fail(const BulkResult& fault, const std::string& where, const std::string& advice) const;
  std::string remedy() const; // where no balance is found
  // check: throws Error beyond the limit of an explicit scheme.
  void free_velocity(Nodes& nodes, const double* gravity, const cairn_scheme& scheme, bool check);
  // Starts the stored derivatives of the integrator at the nodes, from the forces at hand; and the change of velocity
  // over the step by forces without contacts.
  void start_history(Nodes& nodes, const double* gravity, const cairn_scheme& scheme);
  void smooth_change(Nodes& nodes, double* change);
  // The way of the step beside that of the velocities at its ends, where rigid parts turn; else it is left as it is.
  void turn_way(const Nodes& nodes, double* way);
  // Contact nodes from now on, in this order after those that are: compliance between them.
  void touch(const std::vector<std::int32_t>& more);
  std::int64_t contact_nodes() const { return std::int64_t(now_->active.size()); }
  std::int32_t place(std::int32_t node) const { return now_->place[node]; } // among contact nodes, -1: none
  std::int32_t contact_node(std::int64_t place) const { return now_->active[place]; }
  // The same of nodes, rising and none twice, that are all the step needs. Where their compliance would take more bytes
  // than `of` says it may be kept by reaches of its factor, and nodes that are not needed may be forgotten.
  struct Bytes {
    double most = 1e9; // more is not taken if reaches take less
    double easy = 1e9; // beyond, reaches are swept sooner if they take a quarter
  };
  void rest_on(const std::vector<std::int32_t>& nodes, const Bytes& of, bool may_reach);
  bool may_exceed(double bytes) const { return 8.0 * double(model.dofs()) * double(model.dofs()) > bytes; }
  double* compliance() { return now_->compliance.data(); }
  std::int64_t leading() const { return now_->leading; }
  const UnitReaches* reaches() const { return now_->reached ? &now_->reaches : nullptr; }
  double mass() const { return mean_mass_ * double(model.nodes()); } // of the whole [kg]
  std::int64_t touching() const { return touching_; }                // nodes that contacts may ever rest on, 1 at least
  // Inverse of the mass of the whole mesh, 0 where it has held dofs along each axis [1/kg].
  double inverse_mass() const { return inverse_mass_; }
  Array<double> impulse;        // (dofs) of contacts, to be given
  std::vector<double> reaction; // (dofs) forces that hold the held dofs, of the last step [N]; of free ones rounding

  // The velocities that `push` adds to are none: it then gives displacements, over the step, that impulses make.
  void rest() { std::fill(free_.begin(), free_.end(), 0.0); }
  double stored(const Nodes& nodes); // energy of the displacements at hand [J]
  // Velocities of nodes at the end of the step with `impulse`.
  void push(Nodes& nodes);
  // Force on each node that its points of mass need besides gravity and contacts [N], and the works of the step.
  void account(Nodes& nodes, const double* gravity);
  std::int64_t bytes() const;

private:
  struct Touches {
    std::vector<std::int32_t> nodes, ends; // how many there were after each time
  };
  static constexpr std::size_t most_factors = 4;
  struct Factors { // of A = M + damping C + stiffness K
    double h = 0, damping = 0, stiffness = 0, largest = 0;
    double mixed = 0; // share of the inverse of M in the compliance, see mesh_jumps.cpp
    std::unique_ptr<Soe> soe;
    std::function<void(double*)> solver;
    std::vector<double> value; // of A
    bool known = false;        // of the pass: these are its factors
    // Damped modes: the inverse of A is that without modes less Z B Z' (Woodbury 1950): Z (dofs, modes) and the
    // Cholesky factor of B^-1, lower (modes, modes).
    std::vector<double> modal_reach, modal_factor;
    std::vector<std::int32_t> active, place;
    std::vector<std::int32_t> order; // how many were active after each time where numbers depend on that
    Touches again;                   // to be touched before others
    bool spare = false;              // an undone step had them
    std::int64_t leading = 0;
    Array<double> compliance;        // (leading, leading)
    bool reached = false;            // there are reaches in its place
    std::vector<std::int32_t> asked; // nodes of which it was last decided whether to take reaches
    std::int64_t asked_numbers = -1; // of these
    UnitReaches reaches;
    void forget(std::int64_t nodes) { // forgets the contact nodes and their compliance
      active.clear();
      order.clear();
      again = {};
      place.assign(std::size_t(nodes), -1);
      leading = 0;
      if (reached) reaches.clear();
    }
    bool made() const { return soe || solver; }
    bool same_as(const Factors& f) const {
      return h == f.h && damping == f.damping && stiffness == f.stiffness && largest == f.largest && mixed == f.mixed;
    }
    std::int64_t bytes() const {
      return (soe ? soe->bytes() : 0) + reaches.bytes() + std::int64_t(8 * (value.capacity() + compliance.capacity()));
    }
  };
  std::vector<std::int32_t> dofs_of(std::span<const std::int32_t> nodes) const;
  bool by_units(const Factors& f) const;
  void touch_again();
  bool by_units() const; // the compliance is entries of the inverse of the factorised matrix itself
  void mark_contact_nodes();
  void take_scheme(const cairn_scheme& scheme, bool check);
  void factorise_tangent();
  void start_newton(Nodes& nodes);
  void take_history(Nodes& nodes);
  void predict_force();
  void start_bulk_history(Nodes& nodes, const double* gravity, const cairn_scheme& scheme);
  double way_of(std::size_t i, double v) const;
  void find_stresses_at_end(const std::vector<double>& end);
  void damped_velocity(const std::vector<double>& v);
  double force_of(std::size_t i) const; // of the stresses over the step [N]
  void find_free_velocity();
  void residual_of(const std::vector<double>& v);
  BulkResult stresses_of(const std::vector<double>& v, bool tangent);
  BulkResult stresses_there(const double* v, double rate, bool tangent);
  BulkResult forces_at_begin(double* force);
  void account_bulk(Nodes& nodes, const double* gravity);
  void follow_leaders(Nodes& nodes); // applies ties to stored derivatives
  void account_ties();               // after the reactions, before what follows hands its own on
  void account_stored(Nodes& nodes, const std::vector<double>& end, const std::vector<double>& way);
  bool weighs_an_end() const; // the scheme takes forces elsewhere than in the mean of both ends of a step
  void find_loads_beyond(const std::vector<double>& way);
  void account_means(const std::vector<double>& way);
  void account_linear_means(const std::vector<double>& way, const std::vector<double>& pull);
  void account_bulk_means(const std::vector<double>& end);
  void factorise(const cairn_scheme& scheme, bool check);
  void make_factors(Factors& made, const cairn_scheme& scheme, bool check);
  void check_step(const cairn_scheme& scheme);
  double stable_step_there(double rate_share);
  void check_step_there(const cairn_scheme& scheme);
  template <class Use>
  auto with_stiffness_at(const std::vector<double>& u, Use&& use); // for bodies that are not linear
  void watch_stability();
  void times_history(Nodes& nodes); // what the history adds to K q, C v and M v of the step
  void history_sum(Nodes& nodes, const double* factors, double* out) const;
  void solve_mass(double* b); // of held dofs: zero
  void solve_bound_mass(double* b);
  void find_jump(const std::vector<double>& end);      // of velocities
  double jump_share(const cairn_scheme& scheme) const; // see mesh_jumps.cpp
  static bool has_part(double share) { return share < 0 || share > 0; }
  struct Answer {
    double mass = 0, rest = 1;
  };
  Answer answer() const;
  void find_rayleigh();
  double undamped_share() const;
  void respond(double* b, std::int64_t columns = 1);
  void start_jumps();
  void forces_of_jumps(const std::vector<double>& jump, double* x);
  void take_jumps(double* x);
  double way_of_jumps(std::size_t i) const;
  double undamped_jump(std::size_t i) const;
  void add_known_jumps();
  std::string advice() const; // Advice where stresses are not found
  void find_modal_momentum();
  void factorise_modes(Factors& f);
  void solve_modes(double* b, std::int64_t columns);
  void damp_modes(const double* v, double* out) const; // adds C v of modes
  bool diagonal_mass() const;                          // M as it is given
  bool steady_with_modes(const Soe& soe, double h);    // by factors without them
  static constexpr double quick =
      1 + 1e-6; // a bound of omega^2 may be so much larger: most elements are told by factors
  FrequencyBound frequency_bound(bool by_elements,
                                 double slack = quick) const;                // the lower of two, or that of rows alone
  double element_bound(const std::vector<double>& mass, double slack) const; // of omega^2 [1/s2]
  double row_bound(const SparseMatrix& a, const std::vector<double>& mass) const; // of eigenvalues of M^-1 A
  double frequency_estimate(double* xi) const; // lower bound of the highest frequency [1/s], and its damping ratio xi
  bool steady(double h, double rate_share);    // whether central differences of h [s] are stable, by factors
  void solve(double* b, std::int64_t columns = 1); // held dofs bring their given x
  std::unique_ptr<Soe> make_soe() const;
  SoeStatus factor(Soe& soe, const double* value);
  void turn_iterate();
  double force_weight(std::int64_t i) const;
  void kept_momentum(double* out) const;
  void find_kept_way(Nodes& nodes);
  void press(double* tangent);
  void multiply(const SparseMatrix& a, const double* x, double* out) const;
  void stiffness_times(const double* x, double* out) const;
  void damping_times(const double* x, double* out) const;
  void multiply_mass(const double* x, double* out) const;
  void weigh(const double* gravity);    // M g
  void times_velocity(const double* v); // K, C and M of it, unless they are there
  void gather(const Field<double>& field, double* out) const;
  void scatter(const double* v, Field<double>& field) const;
  double on_diagonal(const std::vector<double>& value, std::int64_t row) const;
  bool lost_mass(std::int64_t row) const;
  [[noreturn]] void refuse(const SoeStatus& status) const;

  std::vector<std::unique_ptr<Factors>> factors_;
  Factors* now_ = nullptr;
  std::vector<double> lumped_;                                      // (dofs) [kg]
  std::vector<double> q_, v_, free_, f_, a_, b_;                    // (dofs) of the step at hand
  std::vector<double> stiff_q_;                                     // K q of the step at hand [N]
  std::vector<double> weight_, weight_of_;                          // M g, g [N, m/s2]
  std::vector<double> moving_, stiff_, damped_, momentum_;          // v and K v, C v, M v, of the last v asked for
  std::vector<double> stiff_begin_, damped_begin_, momentum_begin_; // as the step began
  bool lumped_mass_ = false, damps_ = false;                        // M is diagonal; C is not zero
  std::vector<double> columns_;                                     // (some, dofs) right sides that are solved at once
  std::vector<double> modal_momentum_, modal_pull_;                 // (dofs, modes) M f, zero on held dofs; (modes)
  // Newton's method: velocities of the pass, internal forces at both ends of the step and forces of damping,
  // derivative, residual of the balance, and the end of the step.
  std::vector<double> iterate_, force_begin_, force_end_, c_, tangent_, residual_, trial_, start_, norms_, way_end_,
      velocity_end_;
  std::unique_ptr<Factors> own_; // of the pass
  BulkResult found_;             // at the end
  NewtonError find_change(bool with_tangent, double tolerance);
  double measure_balance(double& scale, std::int64_t& node);
  double borne_by_held() const;
  double rounding();
  void find_swelling_force();
  std::vector<double> swelling_force_; // see find_swelling_force; empty: nothing swells
  double warmed_ = 0;
  std::vector<double> force_step_; // of the stresses over a step that is predicted, or has ended [N]
  std::vector<double> past_, elastic_past_, damped_past_, kicked_past_; // of the history; empty where there is none
  std::vector<double> press_begin_, press_;               // of pressures: at the begin of the step, over the step [N]
  std::vector<double> loads_, mean_, drag_, taken_, way_; // (dofs) see mesh_work.cpp
  double end_share_ = 0.5;                                // of the end of the step in loads
  const double* seen_at_ = nullptr;                       // displacements by which frequencies are judged; null: none
  double judged_ = 0;                      // share of the limit at which stability was judged last, squared
  std::int64_t since_judged_ = 0;          // [steps]
  double stored_begin_ = 0, checked_ = 0;  // checked_: step over its limit that is known to be stable
  bool begun_ = false;                     // stored_begin_ and force_begin_ are known
  bool undone_ = false;                    // the step before was: nodes begin at way_end_, to the bit, or were set
  double h_ = 0, share_ = 0;               // the step at hand, of a body that is not linear
  double end_weight_ = 0, rate_share_ = 0; // of the end in forces of stresses, and in rates of strain
  bool explicit_ = false, by_energy_ = false;
  bool tangent_known_ = false;             // at iterate_, with its stresses
  double error_before_ = 0;                // of the pass before
  bool goes_on_ = false, went_on_ = false; // a pass is expected after the next one; the step took several passes
  std::vector<double> known_, stiff_known_, damped_known_, momentum_known_; // of the history; zero where there is none
  std::vector<double> way_beside_; // (dofs) see turn_way; empty where no rigid part turns, or nothing is kept [m]
  std::vector<double> jump_;       // (dofs) of velocities, by contacts and drives on the mass alone [m/s]
  double rayleigh_[2] = {0, 0};
  bool by_rayleigh_ = false;
  std::vector<double> given_jump_, impulse_jump_, responding_; // see mesh_jumps.cpp [m/s]
  std::vector<double> borne_;       // (dofs) what reactions to jumps would have too much by the scheme's impulse [N]
  std::unique_ptr<Soe> mass_;       // factors of M, for histories alone
  double size_ = 0, mean_mass_ = 0; // of a dof [kg]
  double inverse_mass_ = 0;         // see inverse_mass()
  std::int64_t touching_ = 1;       // see touching()
  cairn_scheme scheme_{};           // of the step at hand
};

} // namespace cairn
