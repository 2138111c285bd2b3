// Explicit dynamics with smooth contacts: a list of neighbours with a skin, force laws on it, velocity Verlet. Results
// are independent of the age of the list and of threads: pairs out of reach exert no force. Sums run in the order of
// the list, that of detection within tiles of bodies.
#pragma once
#include <array>
#include <optional>

#include "../../detection/shaped_pairs.hpp"
#include "../../simulation/simulation.hpp"
#include "../../simulation/strategy.hpp"
#include "cairn/core.h"
#include "neighbour_list.hpp"
#include "smooth_dem_options.hpp"

namespace cairn {

class SmoothDem final : public Strategy {
public:
  explicit SmoothDem(const SmoothDemOptions& options);
  ~SmoothDem() override;

  SmoothDemOptions settings;
  // Where ranks share the scene: forces on bodies that are everywhere, damping and the stress of the cell are left to
  // whoever adds up forces over ranks.
  std::optional<SharedBodies> shared;
  bool keeps_loss = false; // what contacts dissipate is asked for beside the balance of energy

  // Throws before anything moves if a law or option is refused. A step that ends in velocities that are not finite
  // throws and does not restore bodies: go back to a checkpoint.
  const StepReport& step(Simulation& s, double h) override;

  // Rates of a cell that follows a stress, by sums over the contacts across its sides: forces times shifts (9) [N m],
  // effective masses [kg].
  void follow_stress(Cell& cell, const double sum[10]) const;

  // The stages of step(), in its order.
  void begin_step(Simulation& s, double h);
  void kick_and_drift(Simulation& s);
  void find_neighbours(Simulation& s);
  void compute_forces(Simulation& s);
  void kick(Simulation& s);
  // Damping of the forces on bodies, once these are added up.
  void damp(Simulation& s);
  const NeighbourList& list() const { return list_; }
  const NeighbourList& contacts_of_shapes() const { return shaped_; } // found anew in each step
  std::int64_t lists_made() const { return lists_made_; }
  static bool is_uneven(const Bodies& bodies, std::int64_t body); // in 3D, if it moves
  double way() const { return way_; }                             // greatest of a body in the step [m]
  double smallest() const { return smallest_; } // size of a bounded contactor; infinite: there is none [m]
  double speed() const { return speed_; } // of no body it was greater at the end of the step, where ranks share [m/s]

  std::vector<std::string_view> stages(const Simulation& s) const override;
  std::vector<Option> options() override;
  std::unique_ptr<Strategy> fresh() const override;
  bool take_settings(Simulation& s, const Strategy& other) override;
  void check_scene(const Simulation& s) const override;
  void check_laws(const Simulation& s) const override;
  bool serves(const LawInfo& law) const override { return law.force != nullptr; }
  void changed(Simulation& s, bool places) override;
  void check_options() const override;
  std::vector<std::string> texts_of(std::string_view option) const override;
  double stable_step(Simulation& s) override;
  double end_share(double h) const override {
    return settings.integrator.name == "velocity_verlet" ? 0.5 : settings.integrator.scheme(h).end_share;
  }
  std::vector<std::pair<std::string_view, double>> figures(Simulation& s) override;

  // Pairs that act, as candidates: gap, normal and point of now. Their forces are those of the last step.
  void view(Simulation& s) override;
  bool has(const ContactFieldInfo& field) const override;
  void read(Simulation& s, std::string_view field, int components, double* out) override;
  void force_space(double* out) const; // (dim, count) on A [N]
  bool has_moments() const { return turns_; }
  void moment_space(double* out) const;                           // (1 | 3, count) on A, where laws have moments [N m]
  void force_local(const Simulation& s, double* out) const;       // along n, t [, s]
  void relative_velocity(const Simulation& s, double* out) const; // (dim, count) local [m/s]
  void status(Simulation& s, std::int32_t* out) override;

  // Steps beyond which motion is unstable: of a pair of the lightest bodies, and of the contacts as they stand [s].
  double pair_limit(const Simulation& s) const;
  double contact_limit(Simulation& s);
  double skin() const;

  ContactMemory memory(const Simulation& s) const override;
  void restore(Simulation& s, ContactMemory memory) override;
  void move_images(const Simulation& s, const std::vector<std::array<int, 3>>& moved) override;
  void lean_images(int k, int i, int cells) override;
  std::int64_t body_bytes() const override;
  std::int64_t contact_bytes() const override;

private:
  struct Lanes;
  // of a tile: greatest squares of velocity and spin, deepest overlap / effective radius, contacts, T, dU, W external
  // and driven, D bulk, 9: D of local damping; 12: greatest correction, works of moving and of growing surfaces; 15:
  // bound on speeds; 16: energy stored, dissipated by damping, by friction, released by springs; 24: forces times
  // shifts of images, 33: effective masses of contacts with images
  static constexpr int sums_of_tile = 40;
  struct EntryShape {
    int scalars = 0, vectors = 0;
    bool bonds = false; // the law joins bodies that came in touching
    bool turns = false; // the law sees relative spins and gives moments
    double reach = 0;   // gap at which the force of the law begins [m]
  };
  struct Target { // of the forces of a batch
    const std::int32_t* body_a;
    double *force, *other;
  };
  void read_laws(const Simulation& s);
  void make_list(Simulation& s);
  void read_contactors(const Simulation& s);
  void choose_records(const Simulation& s);
  void reach_of_walls(const Simulation& s);
  void lay_out(const Simulation& s, const Candidates& found, bool shaped, NeighbourList& list) const;
  void join_first(const Simulation& s, NeighbourList& list) const;
  void add_cell_forces(const Simulation& s, NeighbourList& list, const NeighbourList::Batch& batch, int count, int m,
                       const Lanes& w, double* sums) const;
  void damp_locally(Simulation& s, std::int64_t first, std::int64_t last, double* spent) const;
  void add_memory(const NeighbourList& list, ContactMemory& m) const;
  ContactKey key_of(const NeighbourList& list, std::int64_t p) const;
  void remember(Simulation& s);
  void recall(const Simulation& s);
  bool list_is_old(const Simulation& s) const;
  double walls_move(const Simulation& s) const;
  void place_contactors(Simulation& s, bool sides = true);
  void place_centres(const Simulation& s, std::int64_t first, std::int64_t last);
  void place_clumps(const Simulation& s);
  void place_sides(const Simulation& s);
  bool is_facet(const Simulation& s, std::int64_t contactor) const;
  static double curvature(const Contactors& c, std::int32_t contactor); // seen from outside [1/m]
  double bounded_size(const Simulation& s, std::int64_t contactor) const;
  void batch_geometry(const Simulation& s, const NeighbourList& list, const NeighbourList::Batch& batch,
                      Lanes& w) const;
  // Contacts of polygons, polyhedra, surfaces and round shapes: see shaped_contacts.cpp.
  void look_at_shapes(const Simulation& s);
  void find_shaped(Simulation& s);
  void search_shapes(Simulation& s, double margin);
  void pass_on_springs(const ContactMemory& before);
  double farthest_way(const Simulation& s) const;
  void shaped_geometry(const Simulation& s, const NeighbourList& list, const NeighbourList::Batch& batch,
                       Lanes& w) const;
  void shaped_grains(const Simulation& s, const NeighbourList& list, const NeighbourList::Batch& batch, Lanes& w) const;
  double flat_curvature(const Simulation& s, std::int32_t contactor) const;
  double arm_of(const Simulation& s, std::int64_t contactor) const;
  template <class F>
  void each_list(F&& f) {
    f(list_);
    if (has_shaped_) f(shaped_);
  }
  // Bodies of unequal moments of inertia: see uneven_bodies.cpp.
  void list_uneven(Simulation& s);
  void check_uneven(const Simulation& s) const;
  std::span<const std::int64_t> uneven_of(std::int64_t tile) const;
  void begin_uneven(Simulation& s, std::int64_t tile, double* fastest, std::int64_t& unsolved);
  void turn_uneven(Simulation& s, std::int64_t tile);
  void end_uneven(Simulation& s, std::int64_t tile, std::int64_t& wrong, double* terms);
  void fill_records(const Simulation& s, std::int64_t first, std::int64_t last);
  double stiffness_over_mass(const Simulation& s, const double k[4], std::int64_t body, double arm) const;
  double inverse_inertia(const Simulation& s, std::int64_t body) const;
  bool held(const Simulation& s, std::int64_t body) const;
  void follow_drives(const Simulation& s);
  bool weigh_grains(const Simulation& s);
  void follow_growth(Simulation& s);
  void count_growth(Simulation& s) const;
  double growth_work(const Simulation& s, const NeighbourList& list, const NeighbourList::Batch& batch, int count,
                     const Lanes& w) const;
  double kinetic_of(const Simulation& s) const;
  int sphere_forces(Simulation& s, NeighbourList& list, const NeighbourList::Batch& batch, const Target& to, Lanes& w,
                    double h, double* sums);
  void add_pushes(const NeighbourList& list, const NeighbourList::Batch& batch, std::int32_t count, int dofs,
                  const Lanes& w, const Target& to) const;
  Target target_of(Simulation& s, NeighbourList& list, const NeighbourList::Batch& batch) const;
  void clear_kept(const NeighbourList::Batch& batch, const Target& to, const Lanes& w, std::int32_t count,
                  int dofs) const;
  void add_to_roaming(NeighbourList& list, const NeighbourList::Batch& batch, std::int32_t count, const Lanes& w,
                      Bodies& bodies) const;
  bool has_belts(const Simulation& s, const NeighbourList& list, const NeighbourList::Batch& batch) const;
  void add_belts(const Simulation& s, const NeighbourList& list, const NeighbourList::Batch& batch, int count,
                 bool first, Lanes& w) const;
  void batch_jumps(const Simulation& s, const NeighbourList& list, const NeighbourList::Batch& batch, int count,
                   bool belts, Lanes& w) const;
  void load_rows(const NeighbourList& list, const NeighbourList::Batch& batch, int count, int numbers, Lanes& w) const;
  void store_rows(NeighbourList& list, const NeighbourList::Batch& batch, int count, int numbers, const Lanes& w) const;
  void batch_forces(Simulation& s, NeighbourList& list, const NeighbourList::Batch& batch, Lanes& w, double h,
                    double* sums);
  void keep_loss(NeighbourList& list, const NeighbourList::Batch& batch, std::int32_t count, std::int32_t m,
                 const Lanes& w);
  void tile_forces(Simulation& s, std::int64_t tile, Lanes& w, double h, double* sums);
  void view_batch(Simulation& s, const NeighbourList& list, const NeighbourList::Batch& batch, std::int64_t number,
                  Lanes& w);
  std::pair<const NeighbourList*, std::int64_t> viewed(std::size_t i) const;
  const double* force_of(std::size_t i) const {
    const auto [list, p] = viewed(i);
    return &list->force[p * dim_];
  }
  void to_local(const double* n, const double* v, double* out) const;
  void begin_tile(Simulation& s, std::int64_t first, std::int64_t last, double* fastest);
  void end_tile(Simulation& s, std::int64_t first, std::int64_t last, std::int64_t& wrong, double* terms);
  // Calls f(first, last, plain) for each run of bodies of a kind: plain ones are bodies in 3D that contacts and
  // gravity alone move.
  template <class F>
  void each_run(const Simulation& s, std::int64_t first, std::int64_t last, F&& f) const {
    const Bodies& b = s.scene.bodies;
    const bool plain = records_ && !predicts() && !b.force.active && !b.damping.active;
    if (!plain || !b.driven.active) return f(first, last, plain);
    const std::uint8_t* driven = b.driven.values.data();
    for (std::int64_t from = first, to = first; from < last; from = to) {
      const bool free = driven[from] == 0;
      while (to < last && (driven[to] == 0) == free) ++to;
      f(from, to, free);
    }
  }
  // The balance of energy: see energy.cpp.
  void begin_balance(Simulation& s);
  void half_step_works(Simulation& s, std::int64_t tile, bool second);
  void account(Simulation& s, std::int64_t n);
  // Predictor-corrector integrators with histories: see histories.cpp.
  bool predicts() const { return scheme_.histories > 0; }
  void take_scheme(Simulation& s, double h);
  void start_histories(Simulation& s);
  void forget_histories(Simulation& s);
  void predict(Simulation& s, std::int64_t first, std::int64_t last, double* sums);
  void correct(Simulation& s, std::int64_t first, std::int64_t last, std::int64_t& wrong, double* sums);
  double limit_share() const;
  void check_bodies(const Simulation& s) const;
  [[noreturn]] void refuse_step(double h) const;
  BodyTiles tiles(const Simulation& s) const { return {s.scene.bodies.count, shared ? &*shared : nullptr}; }

  int dim_ = 0;
  cairn_scheme scheme_{}; // of the step at hand, where it keeps a history; velocity Verlet has kernels of its own
  Array<double> push_;    // of contacts and forces, as histories start
  Array<double> works_;   // of a tile: of contacts, of squares, of damping, of drives, see verlet_works.f90
  std::array<double, 3> weight_{}; // over the inertia of bodies [m/s2]
  double driven_before_ = 0;       // work of drives before the step [J]
  double h_ = 0, way_ = 0;         // greatest way of a body in the step [m]
  double speed_ = 0;               // bound on those of bodies at the end of the step [m/s]
  double moved_ = 0;               // way that bodies may have gone since the list was made [m]
  bool forces_known_ = false;
  std::int64_t lists_made_ = 0;
  NeighbourList list_;
  Candidates found_;
  ContactMemory memory_;    // between lists
  Array<double> lost_;      // of its contacts [J]
  bool counts_loss_ = true; // dissipation of contacts is recorded, for the balance or a network of heat
  std::vector<EntryShape> entries_;
  std::int64_t contactors_seen_ = 0;               // ids below it can no longer bond on first sight
  int states_ = 0;                                 // numbers of a pair
  bool turns_ = false;                             // some law gives moments
  bool has_shaped_ = false, lone_spheres_ = false; // lone: each sphere is the only contactor of its body, at its centre
  Array<double> body_arm_;                         // from a body to its farthest point, beside lone balls [m]
  bool surfaces_known_ = false;                    // contactors and their hulls are those of the last list
  ContactMemory shaped_before_;
  NeighbourList shaped_;
  Candidates shaped_found_;
  Array<std::int32_t> shaped_place_;
  Scratch shaped_scratch_;
  detection::ShapedPairs shaped_pairs_;
  std::vector<std::pair<std::int64_t, std::int32_t>> ids_;  // of contactors, rising, with their bodies
  std::vector<std::pair<std::int64_t, std::int32_t>> ends_; // contacts that have ended, by the id of A
  std::vector<std::uint8_t> ended_;
  Array<std::int64_t> uneven_, uneven_start_;                 // bodies, and the first of each tile
  Array<double> turned_;                                      // their orientations after the step
  std::vector<std::pair<std::int64_t, std::int64_t>> placed_; // runs of contactors that are no triangles
  Array<double> grain_, centre_, direction_, margins_, sums_;
  Array<std::int32_t> directed_, viewed_; // viewed_: pairs of the list, then of the contacts of shapes
  std::vector<std::int32_t> walls_;
  Array<std::uint8_t> driven_seen_; // of bodies, as their masses were weighed
  bool centred_ = true;             // contactor i is on the centre of body i
  bool records_ = false;            // bodies have records, see smooth_spheres3.f90
  bool spheres_alone_ = false;      // contacts of spheres may go the way of these records
  bool clumps_ = false;             // so they may, but records are of contactors, which stand beside their bodies
  Array<double> record_, body_radius_;
  Array<double> offset_; // of contactors from their bodies in space axes, if they have records [m]
  double smallest_ = 0;  // size of a bounded contactor [m]
  double widest_ = 0, farthest_ = 0, arm_ = 0, pair_limit_ = 0;
  std::vector<std::unique_ptr<Lanes>> lanes_;
};

} // namespace cairn
