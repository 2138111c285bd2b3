// A scene, the strategy that moves it, and what the last step did. step() is in step.cpp, one page; each stage can be
// called alone.
#pragma once
#include <array>
#include <chrono>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "../bodies/mesh_set.hpp"
#include "../contacts/interaction.hpp"
#include "../detection/interaction_handler.hpp"
#include "../scene/scene.hpp"
#include "cairn/plug.h"

namespace cairn {

// Non-Smooth Contact Dynamics by the theta-method: implicit, constrained, nonsmooth.
struct Nscd {
  double theta = 0.5;
  SolverOptions solver{};
  double margin = std::numeric_limits<double>::quiet_NaN(); // [m] of a pair; NaN: from sizes and speeds
  bool project_positions = false;
  bool warm_start = true;
  bool act_on_surfaces = false; // see Interactions
  int renumber_every = 200;     // steps between renumberings along the space-filling curve
  ContactPose pose{};           // Carpenter's scheme and the granular element method pose conditions of their own
  bool explicit_bulk = false;   // central differences in deformable bodies: A = M
  bool refuse_unstable = true;  // of these, steps beyond their limit
};

// Explicit dynamics with smooth contact laws (Cundall & Strack 1979): see smooth/smooth_dynamics.hpp.
struct SmoothDem {
  double skin = std::numeric_limits<double>::quiet_NaN(); // [m] of a pair, beyond the reach of its law; NaN: from sizes
  double overlap = 0.01; // of an effective radius, at which the stiffness is taken for the stable step
  bool refuse_unstable = true;
  bool energy = true; // keep the balance of energy
  int threads = 0;
  int renumber_every = 1000;
};
class SmoothDynamics;

// Terms of d(T + U) = W_driven + W_external - D_friction - D_normal - D_bulk - D_theta + closure [J], since the start.
struct Energy {
  double kinetic = 0, potential = 0, work_driven = 0, work_external = 0;
  double dissipated_friction = 0, dissipated_normal = 0, dissipated_bulk = 0, dissipated_theta = 0;
  double work_projection = 0; // potential energy that project_positions gave
  double stored = 0;          // in the springs of smooth contacts, now
  double closure = 0;
  double largest_kinetic = 0, turned_over = 0;
  double in_play = 0; // their sum: the scale of closure
};

struct StepReport {
  std::int64_t step = 0;
  double time = 0, time_detection = 0, h = 0;
  std::int64_t contacts = 0;
  std::int64_t unresolved_rotations =
      0; // bodies that turned too far in a step for their midpoint rule: they kept their spin
  SolveReport solve;
  double projection_error = 0;      // true error of the problem that project_positions solved
  double stable_step = 0;           // of smooth contacts, as last estimated [s]; 0 with NSCD
  std::int64_t neighbour_lists = 0; // made since the start
  Energy energy;
};

// See cairn/plug.h.
struct PluggedForce {
  std::string name;
  cairn_plug_body_force* routine;
  std::vector<double> params;
};
struct PluggedVelocity {
  std::string name;
  cairn_plug_free_velocity* routine;
  std::vector<double> params;
};

class Simulation {
public:
  Simulation(Scene scene, LawTable laws, Nscd strategy);
  ~Simulation();
  Simulation(Simulation&&) noexcept;

  Scene scene;
  LawTable laws;
  Nscd strategy;
  MeshSet meshes;
  InteractionHandler handler;
  Interactions interactions;
  Candidates candidates;
  Energy energy;
  StepReport report;
  std::int64_t steps = 0;
  double time = 0;

  // One step of length h. When it cannot be made, throws and leaves bodies, time and what contacts remember as they
  // were; the contacts of the last step can no longer be read.
  const StepReport& step(double h);

  // The stages of step(), in its order.
  void begin_step(double h);
  void predict_configuration();
  void compute_free_velocity();
  void detect_contacts();
  void prepare_contacts();
  void solve_contacts();
  void update_velocity();
  void update_configuration();
  void commit_contacts();
  void project_positions();
  void undo_step();

  // Routines of users' libraries: forces on bodies, which are added, and the free velocity, which is replaced.
  std::vector<PluggedForce> forces;
  std::optional<PluggedVelocity> free_velocity;

  // Contacts can be read until bodies go, numbers change or a step is undone.
  bool contacts_known() const { return contacts_known_; }
  // To be called after bodies were removed or fields restored.
  void forget_contacts();
  // Deformable bodies that the scene shows from now on.
  void add_mesh(MeshModel model);
  void place_meshes();  // among the bodies, when their order changed
  void follow_meshes(); // points, edges and faces to where the nodes are
  // What project_positions remembers between steps, for a checkpoint.
  ContactMemory projection_memory() const;
  void restore_projection(ContactMemory memory);

  // Seconds of wall clock spent in each stage since the start, in the order of the stages.
  const std::vector<std::pair<std::string, double>>& stage_seconds() const { return stage_seconds_; }
  // Bytes held for bodies (with contactors and the solver's records) and for contacts.
  std::pair<std::int64_t, std::int64_t> bytes();

  // Runs a stage and adds what it took to the seconds of its name.
  template <class Stage>
  void timed(const char* name, Stage&& stage) {
    const auto start = std::chrono::steady_clock::now();
    stage();
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    for (auto& [known, seconds] : stage_seconds_)
      if (known == name) {
        seconds += spent.count();
        return;
      }
    stage_seconds_.emplace_back(name, spent.count());
  }

  // Explicit dynamics with smooth contacts instead of NSCD from now on; the laws must have forces. Null: NSCD.
  void use(const Nscd& nscd);
  void use(const SmoothDem& dem);
  SmoothDynamics* smooth() const { return smooth_.get(); }
  // What contacts remember from step to step, whatever the strategy, for a checkpoint.
  ContactMemory contact_memory() const;
  void restore_contacts(ContactMemory memory);
  void check_laws() const; // throws Error naming a law that the strategy cannot use

private:
  friend class SmoothDynamics;
  void save_begin();
  void make_bonds();
  void wrap_into_cell();
  void move_images(const std::vector<std::array<int, 3>>& moved);
  void lean_images(int k, int i, int cells);
  void reduce_lean();
  std::int32_t contactor(std::int64_t id) const;
  void advance_cell(double time);
  void measure_margins();
  void check_free_velocity() const;
  void add_plugged_forces();
  void leave_plugged_forces();
  void account_for_meshes();
  void account(const ContactEnergy& contacts);
  const LawTable& projection_laws();

  double h_ = 0;
  bool begun_ = false, contacts_known_ = false;
  std::int64_t meshes_placed_ = -1; // the scene's order that meshes know
  std::vector<std::int64_t> facet_bodies_;
  std::vector<double> facet_vertices_;
  Cell cell_begin_;
  Array<double> margins_, force_given_;
  std::optional<Interactions> projector_; // of project_positions, with a memory of its own
  Candidates projection_candidates_;
  std::optional<LawTable> projection_laws_;
  Array<double> reaction_kept_;
  std::unique_ptr<SmoothDynamics> smooth_;
  std::vector<std::pair<std::string, double>> stage_seconds_;
};

} // namespace cairn
