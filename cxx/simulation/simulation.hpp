// A scene, the strategy that moves it, and the report of the last step.
#pragma once
#include <chrono>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "../contacts/interaction.hpp"
#include "../detection/interaction_handler.hpp"
#include "../meshes/mesh_set.hpp"
#include "../scene/scene.hpp"
#include "cairn/plug.h"
#include "held_motions.hpp"
#include "integrators.hpp"
#include "strategy.hpp"

namespace cairn {

struct NscdOptions; // see nscd/nscd_options.hpp
struct Networks;
class Controls;
class Fluid;
class Probes;

// Terms of d(T + U + stored) = W_driven + W_external + W_growth - D_friction - D_normal - D_bulk - D_material -
// D_integrator - D_reshaping - absorbed - released + closure [J], since the start.
struct Energy {
  double kinetic = 0, potential = 0, work_driven = 0, work_external = 0;
  double work_growth = 0; // of rigid bodies whose lengths follow their temperature
  double dissipated_friction = 0, dissipated_normal = 0, dissipated_bulk = 0, dissipated_integrator = 0;
  double stored = 0;               // in the springs of contacts and in bodies that deform, now
  double released = 0;             // by contact laws: damage, viscosity, wear
  double dissipated_material = 0;  // at the points of materials of deformable bodies
  double dissipated_reshaping = 0; // by bodies that were made rigid or deformable between steps
  double absorbed = 0;             // by bodies of another code or law that does not report its stored energy
  double work_projection = 0;      // potential energy that project_positions gave
  double closure = 0;
  double largest_kinetic = 0, turned_over = 0;
  double in_play = 0; // their sum: the scale of closure
};

struct StepReport {
  std::int64_t step = 0;
  double time = 0, time_detection = 0, h = 0;
  std::int64_t contacts = 0;
  double way = 0; // largest displacement of a body in the step / size of its smallest contactor; 0 if margins are given
  std::int64_t unresolved_rotations =
      0; // bodies that turned too far in a step for their midpoint rule: they kept their spin
  SolveReport solve;
  int newton_passes = 0;       // of the last step, 0: all is linear
  double newton_error = 0;     // residual of the balance of the worst mesh [-]
  int sub_steps = 1;           // parts that the step was made in; h, and what contacts show, is of the last one
  double mesh_depth = 0;       // deepest overlap on a mesh before the step / size of a cell there
  double mesh_way = 0;         // farthest way along a normal on a mesh in the step / that size; 0: none so far
  std::string mesh_hint;       // warning about contacts on meshes; empty: none
  std::string mesh_within;     // bodies that began wholly within a mesh, in the step that they came in with, or empty
  std::string mesh_turned;     // the mesh that turned though its displacements count as small, or empty
  std::string unjoined;        // bodies that a law did not join, in the step that they came in with, or empty
  double projection_error = 0; // true error of the problem that project_positions solved
  double stable_step = 0;      // of smooth contacts, as last estimated [s]; 0 with NSCD
  std::int64_t neighbour_lists = 0; // made since the start
  std::int64_t events = -1;         // impacts of the step, of EventDriven; -1 of others
  double persistent = 0;            // its part that NSCD made, where bodies rest on each other [s]
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
  Simulation(Scene scene, LawTable laws, const NscdOptions& options);
  Simulation(Scene scene, LawTable laws, std::unique_ptr<Strategy> strategy);
  ~Simulation();
  Simulation(Simulation&&) noexcept;

  Scene scene;
  LawTable laws;
  MeshSet meshes;
  InteractionHandler handler;
  Interactions interactions;
  Candidates candidates;
  Energy energy;
  StepReport report;
  std::int64_t steps = 0;
  double time = 0;
  // Contacts can be read until bodies go, numbers change or a step is undone.
  bool contacts_known = false;

  // Strategy that moves the scene. use() with another of the same class takes over its settings alone; any other class
  // forgets contact memory.
  Strategy& strategy() { return *strategy_; }
  const Strategy& strategy() const { return *strategy_; }
  void use(std::unique_ptr<Strategy> strategy);
  // Replaces the laws; keeps the old ones if it throws.
  void use(LawTable table);

  // One step of length h, as the strategy makes it.
  const StepReport& step(double h);

  // Called before each part of a step that is made in parts: loads and motions of its own time, over a length h [s].
  // Empty: loads of meshes go along a straight line from their begin to their end, all else stays.
  std::function<void(double h)> before_part;

  // Velocities of held dofs of meshes that are functions of time, written before each step and each of its parts.
  std::vector<HeldMotion> held_motions;

  // Controls of bodies and of the cell, applied at the begin of a step, and probes, read at its end; null: none.
  std::unique_ptr<Controls> controls;
  std::unique_ptr<Probes> probes;
  Controls& controlled(); // made, if there are none
  void apply_controls(double h, double end_share, bool cell_may_follow);

  // Networks of potential and temperature; null: none. The strategy advances them in its step, after the contacts.
  std::unique_ptr<Networks> networks;
  void advance_networks(double h);
  bool expands() const; // bodies grow with their temperature

  // Particles of a liquid among the bodies; null: none. They move first, and bodies take their impulses as forces.
  std::unique_ptr<Fluid> fluid;

  // Routines of users' libraries: forces on bodies, which are added, and the free velocity, which is replaced.
  std::vector<PluggedForce> forces;
  std::optional<PluggedVelocity> free_velocity;

  // To be called after bodies were removed or fields restored.
  void forget_contacts();
  // All or nothing; a mesh goes with all of its bodies.
  void remove_bodies(std::span<const std::int64_t> ids);
  // Accounts for the kinetic and stored energy [J] gained when bodies replaced others between steps; a loss is a term
  // of the balance.
  void account_for_reshaping(double kinetic, double stored);
  // Deformable bodies that the scene shows from now on.
  void add_mesh(MeshModel model);
  void place_meshes();        // among nodes and contactors, when their order changed
  void follow_meshes();       // mapped contactors to where the nodes are
  void tell_of_small_turns(); // in the report
  void account_for_meshes();  // in the balance of energy, beside their nodes

  // Bodies back into a periodic cell, and the cell on its way over a duration [s].
  void wrap_into_cell();
  void advance_cell(double duration);
  // Contact memory with its keys updated after bodies moved by whole cells.
  ContactMemory after_move(ContactMemory memory, const std::vector<std::array<int, 3>>& moved) const;
  // Internal number of a contactor, -1 if it is gone.
  std::int32_t contactor(std::int64_t id) const;
  bool laws_keep() const; // a law keeps pairs: their contacts have beta, stored and released energy

  // Seconds of wall clock spent in each stage since the start, in the order of the stages.
  const std::vector<std::pair<std::string, double>>& stage_seconds() const { return stage_seconds_; }
  NewtonSeconds newton_seconds() const; // of bodies whose stresses are a material's, since the start or their coming
  NewtonSeconds pass_seconds;           // time of Newton's method outside the bodies: contacts and the rest
  // Bytes held for bodies (with contactors and the solver's records) and for contacts.
  std::pair<std::int64_t, std::int64_t> bytes();

  // Runs a stage and adds its wall-clock time to that of its name.
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

private:
  void reduce_lean();
  void grow_bodies(double h); // see controls.hpp
  const StepReport& step_of_bodies(double h);

  std::unique_ptr<Strategy> strategy_;
  std::int64_t meshes_placed_ = -1; // the scene's order that meshes know
  std::vector<std::pair<std::string, double>> stage_seconds_;
};

// Contact memory with its keys updated after cell vector k was reduced by a multiple of vector i.
ContactMemory after_lean(ContactMemory memory, int k, int i, int cells);

} // namespace cairn
