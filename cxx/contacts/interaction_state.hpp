// Data of Interactions, and the stages of its assembly.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "../base/scratch.hpp"
#include "../meshes/mesh_set.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "interaction.hpp"

namespace cairn {

// First value, in the order of batches, that is not finite among the results of a law from a user's library.
struct PluggedFault {
  std::int32_t batch = -1, lane = 0, component = 0;
  const char* what = "";
  double value = 0;
  void note(std::int32_t at_batch, int at_lane, int at_component, const char* name, double found);
};

// Nodes of a side that a contact may rest on, those that bear it first; both footings of one. See twin_bonds.cpp.
struct Footing {
  std::int32_t mesh = -1, node[4] = {-1, -1, -1, -1};
  int nodes = 0, bearing = 0;
};
struct Stand {
  std::int32_t candidate = -1;
  Footing a, b;
  bool left_out = false;
};

struct FaceOutline;
struct FaceView;
struct SurfaceCurvature;

struct Interactions::State {
  explicit State(int dim) { system.dim = dim; }

  // Data from assembly to the next detection: batches and their numbers, and all arrays in the scratch below.
  Scratch scratch;
  Scratch::Mark planning{}; // where what planning alone reads begins
  ContactSystem system;
  ContactMemory memory;
  std::vector<ContactKey> kept_keys;
  // Per batched contact, until batches are filled: where it stands in the memory, -1 if it was not there.
  std::int32_t* place = nullptr;
  // By which candidates of this step are found among those of the last: contactors A and B, feature and image.
  struct CandidateName {
    std::uint64_t pair, which;
    bool operator==(const CandidateName&) const = default;
  };
  Array<CandidateName> names, names_of_last;
  Array<std::int32_t> kept_at;             // per candidate of the last step: where the memory has it, -1: nowhere
  Array<std::int32_t> found_at, left_over; // of candidates of this step; what none of them met
  Array<std::int64_t> ids_in_order;        // of contactors then
  std::size_t keys_in_order = 0;           // of the memory then
  bool in_order = false;                   // the memory stands as `remember` left it
  // Per candidate: its place among the anchors held in this step; -1 none; -2 - k: it goes on with what the memory's
  // key k left when it broke. Empty where no contact is anchored.
  std::vector<std::int32_t> anchor_of;
  std::vector<Anchor> held;
  struct AnchoredPlace {
    std::int32_t a, b, image, feature, key;
    bool sound, spans, joins;
  };
  std::vector<AnchoredPlace> anchored_places, on_surfaces;
  std::vector<std::pair<std::int32_t, std::int32_t>> bonded_nodes; // a body, and a node that is held on it; sorted
  std::vector<std::uint8_t> anchored_seen, joint_material;
  std::vector<std::optional<RopeEnds>> rope_of; // per material: of a rope over a pulley; empty where there is none
  Candidates measured;
  ContactEnergy energy;
  // of the step being assembled, the caller's
  const Bodies* bodies = nullptr;
  const Contactors* contactors = nullptr;
  const Candidates* candidates = nullptr;
  const LawTable* laws = nullptr;
  const Cell* cell = nullptr;
  std::array<double, 3> origin{}; // of the scene: places that were given had its size, and their rounding [m]
  double h = 0, theta = 0;
  double gap_share = 0.5; // of the gap in a lever: 1/2 to its middle, 0 to the body's own surface
  std::vector<double> joint_biases, joint_misses; // kept by keep_joints, in the order of each_miss [m/s], [m]
  std::vector<char> joint_seats;                  // whether seating moves it, by `held`: see choose_joints_to_seat
  double left_of_step = 0;                        // see centre_joints
  double joint_theta = 0;                         // see centre_joints; 0: theta
  double correction = 1;                          // of what joints and bonds on meshes miss, by a step
  double overlap_limit = std::numeric_limits<double>::infinity(); // see limit_overlap
  Array<double> asked, parting;                                   // by place, of part_overlaps [m/s], [N s]
  Array<char> loaded;                                             // by place: the contact pressed in the last step
  bool flies = true; // whether laws hold in the middle of the flight: see contact_flight.cpp
  bool sheared = false;
  bool laws_commit = false;                         // a law of the step has a slot commit or energy
  int impulse_components = 0, state_components = 0; // of this step's laws
  Array<double> work_sums;                          // (4, batches)
  double* parted = nullptr; // per batched contact: speed of parting by growth [m/s]; null: none grows
  PluggedFault fault;       // of laws from users' libraries
  // Per batch, for laws that ask after prepare: null where its law does not.
  struct LawColumns {
    cairn_law_context context;
    double* geometry; // of the context, see laws/law_geometry.hpp
    double* fields;   // (n, 4) of the context, null: the scene has none
    double* flight;   // (n, c) that the bias holds besides the law's own [m/s]
    double* energy;   // (n, 4) as cairn_law_energy gives it
  };
  Array<LawColumns> of_law;
  struct PairParams { // as solve has them, of `count` contacts
    std::int32_t entry, count;
    double* params;
  };
  std::vector<PairParams> params_of_pairs; // of this step
  std::span<double> own_numbers;           // numbers of all batches, without shared parameters
  struct Commits {                         // per batch
    double stored, taken_normal, taken_tangential, released, created, turned_over, driven_tangential, driven_normal;
  };
  Array<Commits> commits;
  struct JointPoint {
    std::int32_t body_a, body_b, image, entry, candidate, batch, lane;
  };
  std::vector<JointPoint> joint_points;
  std::vector<double>
      shared_of; // (3, places) impulses by which brittle joints of faces are judged, NaN: others; or empty

  const double *temperature = nullptr, *potential = nullptr; // of bodies, then of nodes; null: the scene has none
  MeshSet* meshes = nullptr;                                 // null: none in the scene
  Nodes* nodes = nullptr;                                    // of these
  ContactPose pose;
  double* given = nullptr; // (dim) of each place: impulses that the pose adds to the solution; null: none
  Field<double> velocity_given, nodes_given; // free velocities with these

  // per contactor: its kind of side (radial, mapped) and whether its body moves
  static constexpr int radial = 1, moving = 2, mapped = 4;
  static constexpr int kinds = 8; // that two bits and one make
  std::uint8_t* kind = nullptr;
  // per candidate
  std::int32_t* entry = nullptr;
  std::uint16_t* contact_class = nullptr; // (place of the law in the table * kinds + kind of A) * kinds + kind of B
  // per body
  std::int32_t* degree = nullptr; // then per mesh, whose contacts all see each other
  std::uint64_t *colours = nullptr, *tile_colours = nullptr;
  // order in which candidates are batched
  std::int32_t* order = nullptr;
  std::vector<std::int32_t> tile_stage, order_start;
  std::vector<std::int32_t> hub_contacts, late_contacts, ropes, of_hub;
  std::vector<std::pair<std::int64_t, std::int32_t>> by_hub; // 2 body + side, candidate
  std::vector<std::uint32_t> key_of_order;
  std::vector<std::int32_t> order_count, sorted;

  int dim() const { return system.dim; }
  double theta_of(const LawInfo& law) const { return law.joins && joint_theta > 0 ? joint_theta : theta; }
  bool is_anchored(std::int64_t i) const { return !anchor_of.empty() && anchor_of[std::size_t(i)] >= 0; }
  std::int32_t body(std::int32_t contactor) const { // below 0: mapped
    return contactors->body.values[std::size_t(contactor)];
  }
  // Free velocities, or another field of them.
  Velocities free(const Bodies& from) const { return {from.velocity_free, meshes ? &nodes->velocity_free : nullptr}; }
  // Number of the carrier that two contacts may not move at once: bodies, then meshes.
  std::int32_t unit_of(std::int32_t contactor) const {
    const std::int32_t carrier = body(contactor);
    return carrier < 0 ? std::int32_t(system.bodies) + meshes->mesh_of(contactor) : carrier;
  }
  std::int64_t units() const { return system.bodies + (meshes ? std::int64_t(meshes->meshes.size()) : 0); }
  double* params_of_pair(const cairn_batch& b);
  bool has_params_of_pair(const cairn_batch& b) const {
    return b.params < own_numbers.data() || b.params >= own_numbers.data() + own_numbers.size();
  }
  bool has_fields() const { return temperature || potential; }
  // Value at a body, or the weighted mean over the nodes of a mapped contactor.
  double value_at(const double* value, std::int32_t contactor) const {
    if (const std::int32_t carrier = body(contactor); carrier >= 0) return value[carrier];
    const MeshSet::Middle& middle = meshes->middle(contactor);
    double sum = 0;
    for (int j = 0; j < 4 && middle.node[j] >= 0; ++j) sum += middle.weight[j] * value[bodies->count + middle.node[j]];
    return sum;
  }
  // Temperatures and potentials of both sides of a contact, columns n apart.
  void fields_of(std::int64_t contact, std::int64_t n, double* out) const {
    const std::int32_t a = candidates->contactor_a[contact], b = candidates->contactor_b[contact];
    out[0] = temperature ? value_at(temperature, a) : 0;
    out[n] = temperature ? value_at(temperature, b) : 0;
    out[2 * n] = potential ? value_at(potential, a) : 0;
    out[3 * n] = potential ? value_at(potential, b) : 0;
  }
  // Parameters of a contact, n apart, that depend on temperature.
  void vary(std::int64_t contact, std::int64_t n, double* params) const {
    const LawTable::Entry& e = laws->entry(entry[contact]);
    for (int k = e.first_curve; k < e.first_curve + e.curves; ++k) {
      const LawTable::Curve& curve = laws->curves()[std::size_t(k)];
      const double t = 0.5 * (value_at(temperature, candidates->contactor_a[contact]) +
                              value_at(temperature, candidates->contactor_b[contact]));
      params[n * curve.parameter] = std::min(curve.at(t), std::numeric_limits<double>::max());
    }
  }
  bool is_hub(std::int32_t contactor) const {
    return (kind[contactor] & moving) &&
           degree[unit_of(contactor)] > (kind[contactor] & mapped ? mesh_hub_degree : hub_degree);
  }
  static int kind_a(int contact_class) { return contact_class / kinds % kinds; }
  static int kind_b(int contact_class) { return contact_class % kinds; }
  bool moves_a(std::int64_t i) const { return kind_a(contact_class[i]) & moving; }
  bool moves_b(std::int64_t i) const { return kind_b(contact_class[i]) & moving; }
  bool moves(std::int64_t i) const { return moves_a(i) || moves_b(i); }

  void load_bodies();
  void classify();
  void plan();     // batches: which contact stands where
  void fill();     // batches: their numbers
  void remember(); // impulses and states, for the next step
  ContactKey key(std::int64_t i) const {
    const auto& id = contactors->id.values;
    return {id[std::size_t(candidates->contactor_a[i])], id[std::size_t(candidates->contactor_b[i])],
            candidates->feature[i], candidates->image[i]};
  }
  void count_cell_work();
  void count_growth();        // its work, which contacts do not make from nothing
  bool may_end_early() const; // in overlap.cpp
  void note_loaded();
  bool ask_for_parting(const cairn_schedule& schedule, bool persisting);
  // Checks of plugged laws, in plugged_laws.cpp. The first throws std::invalid_argument for a noted fault, the second
  // looks for the law that made a solution diverge.
  void refuse_fault() const;
  void find_fault(const Bodies& with, int sweeps);
  void mark_steps_of_bonds(bool converged) const; // in law_commit.cpp
  void share_joints();                            // impulses by which commits judge brittle faces, in joint_faces.cpp
  bool on_one_face(const JointPoint& one, const JointPoint& other) const;
  void share_face(const std::vector<JointPoint>& face);
  void commit_laws(); // states and energies of laws, in law_commit.cpp
  bool wants_area(const cairn_batch& b, int lane) const;
  double area_of(std::int64_t i) const; // of a contact, in contact_area.cpp
  double cap_radius(std::int64_t i) const;
  double face_area(std::int64_t i) const;
  double shared_face(std::int64_t i) const;
  bool see_face(const FaceView& from, std::int32_t contactor, int sense, const double* shift, FaceOutline& face) const;
  double effective_radius(std::int64_t i) const;
  // How both surfaces are curved where they touch, in contact_curvature.cpp.
  struct Curvatures;
  bool surface_at(std::int64_t i, int side, const double axes[3][3], SurfaceCurvature& out) const;
  Curvatures curvatures(std::int64_t i, const double axes[3][3]) const;
  void rolling_radii(const cairn_batch& b, int lane, double* geometry) const;
  void find_mesh_areas();
  std::vector<Stand> bond_stands;                                // that hold, of those that begin
  std::vector<std::pair<std::int64_t, std::int32_t>> bond_names; // (contactor, place in bond_stands), sorted
  Stand stand_of(std::int64_t i) const;
  std::array<std::int64_t, 2> names_of(const Stand& s) const;
  static bool may_be_twin(const Stand& s);
  bool is_twin(const Stand& s) const;
  void add_bond(const Stand& s);
  // Bonds left out because others share the side that they touch go to `spare`.
  void leave_out_twins(std::vector<std::int32_t>& beginning, std::vector<std::int32_t>& spare);
  // Areas of bonds between meshes and flat sides of bodies, in mesh_face_area.cpp.
  using BondArea = std::pair<std::int32_t, double>; // candidate, area [m2]
  struct MeshFaceBond;
  struct SidesOfNodes;
  class MeshFaces;
  struct MeshPairBond; // of two meshes, in mesh_pair_area.cpp
  class MeshPairFaces;
  bool as_mesh_pair_bond(std::int32_t i, bool spare, MeshPairBond& bond) const;
  void leave_out_corners(std::vector<std::int32_t>& beginning) const;
  void share_mesh_pairs(std::vector<std::int32_t>& beginning, std::span<const std::int32_t> spare,
                        std::vector<BondArea>& areas) const;
  std::vector<BondArea> share_mesh_faces(std::vector<std::int32_t>& beginning, std::span<const std::int32_t> spare);
  bool as_mesh_bond(std::int32_t i, bool spare, MeshFaceBond& bond) const;
  bool is_there(std::span<const MeshFaceBond> bonds, const MeshFaceBond& wanted) const;
  // A contact of bodies that came in, in bonds.cpp.
  enum class Begun { joined, loose, without_area };
  Begun begin_kept(std::int64_t i, double with_h, double with_theta, double area);
  std::string tell_unjoined(std::span<const std::int32_t> joined, std::span<const std::int32_t> bare) const;
  bool came_in_touching(std::int64_t i) const;     // its bodies came in together, and touch
  void anchor(std::int64_t i, const LawInfo& law); // the last key of the memory, in anchors.cpp
  void anchor_bond(std::int64_t i, const LawInfo& law, Anchor& made) const;
  void face_of_node(std::int32_t node, std::int32_t hull, const double* shift, double* normal, double* from) const;
  void anchor_joint(std::int64_t i, Anchor& made) const;
  void carrier_at(std::int32_t contactor, double* x) const;                   // position of its carrier [m]
  void carried(std::int32_t contactor, const double* own, double* out) const; // a vector in its axes, in those of space
  bool on_mesh_side(std::int32_t contactor) const { return body(contactor) < 0 && meshes->turns(contactor); }
  void between_ends(std::int32_t contactor_a, std::int32_t contactor_b, std::int32_t image, const Anchor& anchor,
                    double* between) const; // vector between both ends of an anchored contact [m]
  // Errors of their frames, before the law prepares, with velocities at the begin of the step; in joints.cpp.
  void measure_joints(const cairn_batch& b) const;
  void keep_turn(std::int32_t contactor_a, std::int32_t contactor_b, Anchor& made) const;
  void turned_from(std::int32_t A, std::int32_t B, const Anchor& anchor, double found[4]) const;
  void turned_from(const double* A, const double* B, const Anchor& anchor, double found[4]) const; // of rotations
  // The end on A from that on B [m], and how far A turned from where B has it.
  struct JointPose {
    double between[3] = {}, turned[4] = {};
    bool turns = false, ahead = false;
  };
  void joint_pose(const cairn_batch& b, int lane, JointPose& pose) const;
  // After a flight of that time, at the velocities of the records; joint_flight.cpp.
  void pose_ahead(const cairn_batch& b, int lane, double time, JointPose& pose) const;
  bool swings_alike(const cairn_batch& b, int lane) const; // see choose_joints_to_seat
  bool is_seated(const cairn_batch& b, int lane) const;
  void velocity_of_mapped(const cairn_batch& b, bool of_b, int lane, double out[3]) const;
  void velocity_of_end(const cairn_batch& b, bool of_b, int lane, double out[6]) const;
  bool flies_bent(const cairn_batch& b, int lane) const;
  double joint_errors(const cairn_batch& b, int lane, const JointPose& pose, double error[6]) const;
  JointMiss miss_of_joints(double least) const;
  double length_of_joint(const cairn_batch& b, int lane, const Anchor& anchor) const;
  double swing_of(const cairn_batch& b, int lane, double length) const;
  void fill_drags(const cairn_batch& b) const; // of bars and ropes, by the impulses at hand; joint_swing.cpp
  double gives_across(const cairn_batch& b, int lane) const;
  double length_across(const cairn_batch& b, int lane) const;
  bool ease_joints();
  bool any_spans() const;
  double flown(const cairn_batch& b, int lane) const;
  double missed_more(const cairn_batch& b, int lane) const;
  template <class F>
  void each_miss(F&& f) const;
  void hold_places(const cairn_batch& b) const; // slips and turns of bonds that hold fast
  void find_joints();                           // materials of the ends of joints
  // Far part of a rope, from its pulley to its far end: carrier of the end, then of the pulley. In ropes.cpp.
  struct FarPart {
    std::int32_t body[2];
    double lever[2][3] = {}, normal[3] = {}, length = 0; // normal: from the pulley to the end
  };
  void find_ropes(const Contactors& of, const LawTable& by);
  // True if a contact is a rope between its near end and its pulley; other marks may touch freely.
  bool is_rope(std::int64_t i) const {
    if (rope_of.empty()) return false;
    const std::int32_t a = candidates->contactor_a[i], b = candidates->contactor_b[i];
    const RopeEnds ends = rope_of[std::size_t(*contactors->material[a])].value_or(RopeEnds{});
    return ends.far >= 0 && std::minmax(a, b) == std::minmax(ends.near, ends.pulley);
  }
  FarPart far_part(std::int64_t i) const;
  void fill_ropes(cairn_batch& b) const;
  void space_anchors(std::size_t first); // reaches of those from a key on
  void keep_anchors();
  void find_bonds_on_surfaces();
  bool is_of_surface(std::int32_t side) const;
  std::int32_t surface_of(std::int32_t side) const;
  bool is_held_beside(std::int64_t i, const Candidates& found) const;
  void find_bonded_nodes();
  bool is_held_by_nodes(std::int64_t i, const Candidates& found) const;
  void hand_on_broken();
  void measure_pair(std::span<const AnchoredPlace> places, std::int64_t first, std::int64_t last,
                    const Candidates& found);
  void add_given(const Bodies& bodies);
  void measure_speeds(const Bodies& bodies);
  void add_reactions(Bodies& bodies) const;
  void pull_driven(Bodies& bodies, const cairn_batch& b, int lane) const;
  void give_meshes() const;
  void give_moment(const cairn_batch& b, int lane) const; // turning_sides.cpp
  bool resists_turning(const LawTable::Entry& e) const;
  void refuse_moment(std::int64_t candidate) const; // unless the contact turns with a face
  void push_meshes() const;
  void space_impulse(const cairn_batch& b, int lane, double p[3], double m[3]) const;
  // f(batch, lane, candidate) for every contact that is batched
  template <class F>
  void each(F&& f) const;
  void add_image_jump(const cairn_batch& b, int lane, double factor, double* u) const;

  void normal_of_side(std::int32_t side, double* m) const;

private:
  void load_further_inertia(std::int64_t n);
  void load_meshes();
  static void forget_open(cairn_batch& b);
  void apply_pose(const cairn_batch& b, const double* gap, const double* u, double* compliance);
  void fill_mapping(cairn_batch& b, int side, int lane, std::int64_t candidate);
  void fill_spin(const cairn_batch& b, int side, int lane, std::int64_t candidate, const Mapping& mapping);
  void find_places(int threads);
  bool follow_order();
  void number_places(std::int64_t places, bool known);
  template <class KeyOf>
  void find_others(std::int64_t places, const KeyOf& key_of);
  void follow_across_facets();
  void follow_bonds_across_sides();
  std::int64_t remember(const cairn_batch& b, std::int64_t to);
  template <int d>
  std::int64_t remember_packed(const cairn_batch& b, std::int64_t to);
  void plan_tiles();
  void plan_hubs();
  void plan_late();
  std::int32_t response_rows(const std::int32_t* contacts, int n, const std::int32_t* contactor) const;
  void lay_out_mapping(const cairn_batch& b, std::int32_t*& node, std::int32_t*& dof, double*& response,
                       std::int32_t stride);
  void lay_out_spins(cairn_batch& b);
  void emit(const std::int32_t* contacts, int n, int hub);
  void emit_sorted(const std::vector<std::int32_t>& contacts, int largest, int hub);
  void lay_out();
  void fill_batch(int b, int thread, double& deepest);
  void fill_geometry(cairn_batch& b, double& deepest);
  void fill_impulses(cairn_batch& b);
  void fill_states(const cairn_batch& b) const;
  void lay_into_plane(const cairn_batch& b, int lane, std::int32_t where, double x[3], double t[2]) const; // bonds.cpp
  double twist_since_last(const cairn_batch& b, int lane, const double* normal) const;
  void add_growth(const cairn_batch& b, const double* gap, double* bias) const;
  bool limits_overlap(const cairn_batch& b) const; // in overlap.cpp
  bool all_balls() const;
  double overlap_beyond(std::int64_t i, double gap, double& size) const;
  double deepest_drift() const;
  double grown_at(const cairn_batch& b, int lane, const Field<double>& stretch, const Field<double>& bend) const;
  double free_opening(const cairn_batch& b, int lane, double begin) const;
  void fill_law(const cairn_schedule& schedule, cairn_batch& b, int thread);
  void commit_batch(const cairn_schedule& schedule, std::size_t which, int thread);
  void keep_states(const cairn_batch& b, int lane, double* to) const;
  template <int d>
  void fill_packed(cairn_batch& b, double& deepest);
  void keep_for_commit(cairn_batch& b, const double* flight, int d);
  template <int d>
  void inherit_packed(cairn_batch& b) const;
  void flight_of(const cairn_batch& b, int lane, double out[3]) const;
  bool is_sound_bond(const cairn_batch& b, int lane) const;
  void flight_of_carried(const cairn_batch& b, int lane, double out[3]) const;
  void flight_of_surfaces(const cairn_batch& b, int lane, double out[3]) const; // rolling_flight.cpp
  void turn_of_bond(const cairn_batch& b, int lane, double out[3]) const;
  void flight_beside_mesh(const cairn_batch& b, int lane, double out[3]) const;
  void flight_of_anchored(const cairn_batch& b, int lane, double out[3]) const;
  bool fill_flight(const cairn_batch& b, double* flight) const;
  bool flies_as_round() const;
  static bool acts_along_tangents(const cairn_batch& b, const double* compliance);
  template <int d>
  void pack_columns(cairn_batch& b) const;
  void check_prepared(const cairn_batch& b, const double* bias, const double* compliance, const double* mu);
  void check_posed(const cairn_batch& b, const double* gap);
};

} // namespace cairn
