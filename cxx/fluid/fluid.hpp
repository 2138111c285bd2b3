// A meshless liquid among the bodies of a scene: particles of one spacing, weakly compressible, by sub-steps within the
// step of the bodies. In a sub-step bodies move as they would without new contacts; the impulse of the liquid over the
// whole step is a force of their step.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "../scene/scene.hpp"
#include "cairn/fluid.h"
#include "fluid_skins.hpp"
#include "particle_list.hpp"
#include "particle_shares.hpp"

namespace cairn {

struct FluidSettings {
  double spacing = 0, density = 0, viscosity = 0, sound_speed = 0; // [m], [kg/m3], [Pa s], [m/s]
  double smoothing = 1.5;                                          // length of the kernel over the spacing
  double diffusion = 0.1, limiter = 3, artificial = 0;             // see fluid_rates.f90 [-]
  double bulk = 0;                                                 // viscosity of volume over rho c h [-]
  double drift = 4;                                                // of particles towards an even spread [-]
  double courant = 0.25;                                           // sub-step over h / (c + v)
  double depth = 1;                                                // of a plane scene [m]
  double surface_tension = 0;                                      // [N/m]
  int threads = 0;                                                 // 0: those of the program
  // The incompressible form takes the step of the bodies; a sound speed is its compressibility, 0: none.
  bool incompressible = false;
  double filter = 0.1;     // share of the compact Laplacian, which filters null modes of the pressure [-]
  double correction = 0.2; // share of a compression that a step takes back [-]
  double tolerance = 1e-3; // of the divergence over that without pressure [-]
  int iterations = 2000;   // of the solver at most
};

enum class Slip : std::int8_t { none = 0, holds = 1, slides = 2 };

// Points on the surfaces of bodies, in the axes of these; a half-space has one, of no depth and volume.
struct FluidSurface {
  std::vector<std::int64_t> body;     // ids (n)
  std::vector<double> offset, normal; // (3, n) from the centre of mass [m], out of the body
  std::vector<double> depth, volume;  // (n) [m], [m3 | m2]
  std::vector<std::int8_t> slip;      // (n) Slip
  // How far below a point, along its normal, the centre of curvature lies, where pressure acts (n) [m]; 0: on a flat
  // side, whose pressure acts at the point; empty: all are on flat sides.
  std::vector<double> centre;
  std::int64_t count() const { return std::int64_t(body.size()); }
};

// Bodies smaller than a particle, which feel the liquid by the share of space that they take about them.
struct FluidGrains {
  std::vector<std::int64_t> body;       // ids (n)
  std::vector<double> diameter, volume; // (n) of a sphere of its volume [m], [m3 | m2]
  std::vector<std::int8_t> law;         // (n) of drag, see fluid_grains.f90
  std::int64_t count() const { return std::int64_t(body.size()); }
};

// Rows of particles that come in, one behind the other, in a buffer before the liquid (n each).
struct FluidLanes {
  std::vector<std::int32_t> axis;          // along which they move
  std::vector<double> sign;                // 1: up the axis, -1: down
  std::vector<double> face, length, speed; // end of the buffer times the sign [m], length of it [m], [m/s]
};

// A box in which particles leave, along an axis. pressure: NaN lets that of each go on [Pa].
struct FluidOutflow {
  std::array<double, 3> low{}, high{};
  int axis = 0;
  double sign = 1, pressure = 0;
};

class Fluid {
public:
  Fluid(int dim, const FluidSettings& settings);
  ~Fluid();

  FluidSettings settings;
  // (3, n) relative to the origin of the scene [m], [m/s], (n) [Pa].
  void set_particles(std::span<const double> position, std::span<const double> velocity,
                     std::span<const double> pressure);
  void set_surfaces(FluidSurface points, FluidSurface planes, FluidGrains grains = {});
  // Sides of deformable bodies; size: (n) measure of each at the start.
  void set_skins(FluidSkin points, std::vector<double> size);
  bool meets_meshes() const { return !skins_.empty(); }
  template <class F>
  void each_met_body(F&& f) const { // f(id), of those that it does not flow through
    for (const Body& b : bodies_) f(b.id);
  }
  // Open ends, for the weakly compressible form; lane_of: number of the lane of each particle, -1: in the liquid.
  void set_ends(FluidLanes lanes, std::vector<FluidOutflow> outflows, std::vector<std::int32_t> lane_of);
  bool has_ends() const { return ends_ != nullptr; }
  std::array<double, 2> passed() const; // masses that came in and left since the start [kg]
  std::int64_t back_flow() const;       // particles of the liquid that stand in an inflow
  // report.volume of the first step
  double volume_begin() const { return volume_begin_.empty() ? 0 : volume_begin_[0]; }
  std::vector<std::int32_t> ends() const; // 1 and more: in that lane of an inflow, -1 and less: in that outflow (n)
  std::int64_t count() const { return std::int64_t(density_.size()); }
  double mass() const; // of a particle [kg | kg/m]

  // Porosity about each particle without these grains over the porosity with them (n) [-]; empty if none of them is a
  // grain in the liquid. fill_room() takes these ratios once the grains are gone, and gives the particles about them
  // mass at the pressure that they have.
  std::vector<double> room_without(const Scene& scene, std::span<const std::int64_t> grains_sorted);
  void fill_room(std::span<const double> room);

  // Ranks that share the sums over particles from now on; null: this process makes all.
  void use(std::shared_ptr<ParticleShares> ranks);
  double imbalance() const { return of_particles_.imbalance(); } // largest share of these sums over the mean

  // Moves the liquid over a step of h, and adds its mean forces to those of the bodies. step: needed beside meshes.
  void advance(Scene& scene, double h, const FluidStep& step = {});
  void add_force_again(Scene& scene, std::int64_t body); // its force was written anew within the step
  void end(Scene& scene, double h);                      // the step of the bodies was made
  void undo(Scene& scene);                               // it was not: all is as before

  // The incompressible form, within the step of the bodies, whose free velocities and inverse masses are known:
  // predicts the liquid to where contacts are detected; solves for the pressure, with bodies that have the impulses of
  // contacts as last known, and gives bodies their free velocity by it, with the mass of the liquid about them, so that
  // passes converge; takes the velocities that contacts left, and says by how much they differ from those that the
  // pressure saw; gives bodies the sum of both impulses; goes on to the end of the step.
  bool incompressible() const { return settings.incompressible; }
  void predict(Scene& scene, double h, double ahead, MeshSet& meshes);
  void press(Scene& scene, bool other_matrices = false); // of meshes than in the pass before
  // velocity: (dofs, bodies of the scene); meshes have the impulses of contacts.
  double misfit(const Scene& scene, const Array<double>& velocity);
  void settle(Scene& scene);
  void finish(Scene& scene);

  // In the order in which particles were given.
  std::vector<double> position() const, velocity() const, pressure() const, density() const; // (3, n), (n)
  std::vector<double> masses() const, porosity() const;                                      // (n) [kg | kg/m], [-]
  std::vector<std::int8_t> at_surface() const;
  std::array<double, 6> force_on(std::int64_t body) const; // mean of the last step, torque about its centre [N, N m]
  // On the nodes of a mesh, by the id of its first one (dim, nodes) [N]; empty: the liquid does not meet it.
  std::vector<double> forces_on_mesh(std::int64_t first_node) const { return skins_.forces(first_node); }
  // Gauges at a place (3) relative to the origin of the scene: the mean pressure about it, with what gravity adds from
  // particles to it, 0 where there is no liquid [Pa]; height against gravity, or along the last axis, to which half of
  // space is filled above or below it, NaN where no liquid is [m].
  double pressure_at(const Scene& scene, const double* place) const;
  double level_at(const Scene& scene, const double* place) const;
  double stable_step(const Scene& scene) const; // of a sub-step [s]
  double surface_energy() const;                // of surface tension [J]

  struct Report {
    int sub_steps = 0;      // of the last step
    int passes = 0;         // of pressure and contacts in turn
    int products = 0;       // of the pressure solver
    double misfit = 0;      // of the velocities of bodies between both, over their speed
    double residual = 0;    // of the pressure
    std::int64_t lists = 0; // of neighbours, made since the start
    double speed = 0;       // greatest [m/s]
    double compression = 0; // greatest |rho - rho0| / rho0
    double neighbours = 0;  // mean number listed
    std::int64_t surface_points = 0;
    double drag_loss = 0; // of energy by drag of grains, in the last step [J]
    double volume = 1;    // of the liquid over that of its mass at rest
    // The lightest body beside the liquid about it shortened sub-steps by this factor, 1: none; its id.
    double light_factor = 1;
    std::int64_t light_body = -1;
    std::string too_fast; // the body that moves faster than the sound of the liquid about it, empty: none
  };
  Report report;
  std::int64_t bytes() const;

  // f(name, array) for each array of a checkpoint.
  template <class F>
  void each_state_array(F&& f) {
    f("position", position_);
    f("velocity", velocity_);
    f("density", density_);
    f("acceleration", acceleration_);
    f("listed", list_.at);
    f("number", number_);
    f("open", open_);
    f("force", force_);
    f("contact", contact_);
    f("contact_before", contact_before_);
    f("pose_listed", pose_listed_);
    f("volume_begin", volume_begin_);
    if (!mass_.empty()) {
      f("mass", mass_);
      f("solid", solid_);
    }
    if (ends_) {
      f("end", end_);
      f("passed", passed_);
    }
    if (!skins_.empty()) {
      f("mesh_force", skins_.state.force);
      f("mesh_contact", skins_.state.contact);
      f("mesh_contact_before", skins_.state.contact_before);
      f("mesh_listed", skins_.state.listed);
    }
    if (!settings.incompressible) return;
    f("held_pressure", pressure_);
    f("norm", norm_);
  }
  void state_restored();

private:
  // A body that the liquid meets, as it moves within the step.
  struct Body {
    std::int64_t id;
    std::int32_t at = -1; // in the scene; -1: it is gone
    double position[3], velocity[6], turn[9];
    double inverse_mass[3], inverse_inertia[9];
    double constant[6]; // acceleration that is no liquid's
    double kept[6];     // its part by lasting contacts
    double impulse[6];  // of the liquid, in this step
    double surface = 0; // area or length of it that meets the liquid
    double volume = 0;  // within it [m3 | m2]
    double reach = 0;   // farthest point of it from the centre
    double seen = 0;    // farthest place whose velocity by its spin the liquid feels
    bool flat = false;  // it has a half-space
    double belt[6];     // velocity and spin of its surface relative to it, in space axes
  };

  void load_bodies(const Scene& scene, double h);
  void accelerate(double dt);
  void move_bodies(double dt);
  void place_surfaces();
  void hide_points_in_planes();
  double fastest() const; // [m/s]
  double lightness(const Body& body) const;
  std::string too_fast() const;
  void measure_flow();
  void renew_list();
  void renew_as_listed();
  void keep_before();
  void restore_before();
  void give_forces(Scene& scene, double h);
  void add_force(Scene& scene, std::size_t body);
  void put_forces_back(Scene& scene);
  bool list_is_old();
  bool is_borne() const;
  void sub_step(const Scene& scene, double dt);
  void pack();
  bool spreads() const { return closed_ && settings.drift != 0; } // at a free surface the drift would lift the liquid
  bool corrects_pressure() const;                                 // see fluid_viscosity.cpp
  void find_forces(const Scene& scene);
  void add_surface_forces();
  void cut_shares();
  // Numbers of own particles or points (size a particle) to the other ranks.
  template <class T>
  void tell(std::vector<T>& numbers, std::size_t size, const std::vector<std::int64_t>& first) {
    if (ranks_ && ranks_->ranks() > 1) ranks_->share(numbers.data(), size * sizeof(T), first);
  }
  cairn_fluid view(const Scene& scene) const;
  void check(const Scene& scene);
  double skin() const { return 0.5 * settings.spacing; }
  double reach() const { return 2 * settings.smoothing * settings.spacing; }
  std::array<double, 3> period_{}, corner_{};
  std::vector<double> in_order(const std::vector<double>& values, int components) const;

  struct Implicit; // see fluid_implicit.cpp
  std::unique_ptr<Implicit> implicit_;
  void lay_rows(const Scene& scene);
  cairn_fluid_rows rows() const;
  void shear(double h);
  void shear_at_middle(const Scene& scene);
  void refuse_not_finite() const;
  void move_ahead(const Scene& scene);
  void begin_changes(const Scene& scene);
  void free_bodies(const Scene& scene);
  void add_mass();
  void damp_noise(); // see fluid_damping.cpp
  void spread();
  void begin_rows();
  void product(const std::vector<double>& p, std::vector<double>& out);
  double stiffness() const;
  void give_pressed(Scene& scene);
  void divergence(const std::vector<double>& velocity, const std::vector<double>& of_body, std::vector<double>& out);
  void impulses_on_bodies(const std::vector<double>& p, std::vector<double>& out) const;
  void push(const std::vector<double>& p);
  double inverse_of_body(std::size_t body, const double* impulse, double* change) const;
  double scale_of_speed(const Scene& scene) const;
  std::size_t sides() const; // bodies, and points of meshes behind them
  double* tail(std::vector<double>& of_sides) const;
  void velocities_begin(std::vector<double>& out) const;
  void free_skins(const Scene& scene);
  void mix_contacts(bool other_matrices);

  void measure_volume(const Scene& scene); // see fluid_surface.cpp
  bool stands_alone(std::size_t i) const;
  void pull_surface(const Scene& scene);
  double color_of_lattice() const;

  struct Granular;                     // see fluid_grains.cpp
  std::shared_ptr<Granular> granular_; // of this alone
  void set_grains(FluidGrains grains, const std::vector<std::int32_t>& body);
  std::int64_t bytes_of_grains() const;
  double fluid_density(std::size_t i) const { // within the pores
    return solid_.empty() ? density_[i] : density_[i] / (1 - solid_[i]);
  }
  double pressure_of(std::size_t i) const { // in the order of lists [Pa]
    if (settings.incompressible) return pressure_[i];
    return settings.sound_speed * settings.sound_speed * (fluid_density(i) - settings.density);
  }
  double swiftness_of_grains() const; // speed of sound with grains over that of the liquid
  double least_porosity() const;
  void place_grains();
  void list_grains();
  void weigh_grains(const Scene& scene);
  void make_room(const Scene& scene);
  void align_among_grains(const Scene& scene);
  void spread_among_grains(double dt);
  void push_grains(const Scene& scene);
  void drag_grains(const Scene& scene, double dt);
  cairn_fluid_grains grains() const;

  struct Ends; // see fluid_ends.cpp
  static constexpr std::int32_t gone = INT32_MIN;
  std::shared_ptr<Ends> ends_; // of this alone
  void check_ends(double h) const;
  void hold_ends();
  void fill_ends(const Scene& scene);
  void pass_ends();
  void add_particle(const double* place, const double* velocity, double density, std::int32_t end);
  void drop_gone();

  FluidSkins skins_;
  double burden_ = 0, burden_step_ = 0; // of meshes by the liquid at their sides, and the step that it is of [-], [s]
  std::int64_t all_points() const { return points_.count() + skins_.count(); }
  double* skin_records() { return surface_.data() + cairn_fluid_surface_record * points_.count(); }
  void load_meshes(Scene& scene, const FluidStep& step);

  int dim_;
  FluidSurface points_, planes_;
  std::vector<std::int32_t> body_of_point_, body_of_plane_;
  std::vector<Body> bodies_;
  std::vector<double> position_, velocity_, density_, acceleration_, drift_, record_, surface_, plane_, rate_;
  std::vector<double> gradient_correction_; // corrections of gradients, none where pressure takes none (6, n)
  std::vector<double> on_points_, shear_on_points_, side_of_points_, on_planes_, fill_, color_, normal_, curvature_;
  std::vector<std::int32_t> number_;
  std::vector<std::int8_t> open_, open_new_;
  std::vector<std::int32_t> end_;       // see ends (n), none without open ends
  std::vector<double> volume_begin_;    // see volume_begin (1)
  std::vector<double> passed_;          // particles that came in and left since the start (2)
  std::vector<double> mass_, solid_;    // beside grains (n)
  std::vector<double> pressure_, norm_; // of the incompressible form (n), (1)
  std::vector<double> force_, contact_, contact_before_, pose_listed_; // (6, bodies), (12, bodies)
  ParticleList list_;
  std::shared_ptr<ParticleShares> ranks_;
  TileShares of_particles_, of_points_; // of the list at hand
  double lattice_color_ = 0;            // see color_of_lattice
  double fastest_ = 0;                  // at the begin of the step [m/s]
  double raised_ = 0;                   // of all pressures where there is no free surface [Pa]
  bool closed_ = false;                 // no particle is at a free surface
  bool borne_ = true;                   // a wall or body is within reach of a particle
  bool known_ = false, list_known_ = false, added_ = false;
  bool within_ = false; // a step of the incompressible form

  struct Before { // of a step that may be undone
    std::vector<double> position, velocity, density, acceleration, listed, force, pose, pressure, norm, mass, solid;
    std::vector<double> passed, volume_begin;
    std::vector<std::int32_t> number, end;
    std::vector<std::int8_t> open;
    FluidSkins::State skins;
    bool known = false;
  };
  Before before_;
  std::vector<double> given_, mean_; // (6, bodies) forces of bodies before the liquid's, and the liquid's
};

} // namespace cairn
