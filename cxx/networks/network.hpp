// Networks of potential and temperature: an unknown on each rigid body and each node of a mesh, a branch over each
// contact, whose conductance is what the kernels of networks.def give together; further branches are given.
#pragma once
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "../base/scratch.hpp"
#include "../detection/candidates.hpp"
#include "cairn/core.h"
#include "conduction.hpp"

namespace cairn {

class Scene;
class Simulation;
struct StepReport;
struct Contactors;

// Row of networks.def.
struct ConductanceInfo {
  std::string name, python_name, parameters, reads, meaning;
  cairn_conductance* kernel = nullptr;
};
const std::vector<ConductanceInfo>& conductance_infos();

// A property that depends on temperature: piecewise linear, constant beyond its ends.
struct PropertyTable {
  std::vector<double> temperature, value; // one value without temperatures: constant
  bool constant() const { return value.size() <= 1; }
  double at(double t) const;
  double integral(double t) const; // from the first temperature, or 0, to t
};

// By number of material or group of the contactors.
struct NetworkMaterial {
  PropertyTable conductivity, capacity;     // [S/m | W/(m K)], [J/(kg K)]
  double latent = 0, melts = 0, molten = 0; // heat taken up between two temperatures [J/kg], [K]
  double density = 0, young = 0, poisson = 0, hardness = 0, expansion = 0;
  bool joint = false;              // of the ends of a joint, there or gone: they conduct nothing
  double enthalpy(double t) const; // [J/kg]
  double enthalpy_slope(double t) const;
};

// Values of one source for its bodies at the end of the step, and for powers their mean over it.
struct NetworkSource {
  enum Kind { held, flow, convection, radiation, gradient };
  Kind kind = flow;
  int axis = 0;                    // of the body that a gradient is along
  bool electrode = false;          // its bodies are one conductor; `value` is shared by all of them
  std::vector<std::int64_t> ids;   // of bodies
  std::vector<double> coefficient; // of convection h A [W/K] and of radiation epsilon A [m2]
  std::vector<double> value;       // [V | K], [A | W], outside temperature [K], [K/m]
};

struct OxideFilm {
  double conductance = 0; // in series with the spot [S]
  double power = 0;       // at which it breaks down [W]
  double ratio = 0;       // of that to effective radius times force [1/s]
  double sliding = 0;     // speed beyond which it is rubbed away [m/s]
};

// Amounts since the start, with their signs: their sum is the closure error.
struct NetworkBalance {
  double stored = 0, held = 0, given = 0, convection = 0, radiation = 0, friction = 0, joule = 0; // [J]
  double charge_in = 0, charge_out = 0, supplied = 0;                                             // [C], [C], [J]
  double closure = 0, in_play = 0;
};

// Forces of a mesh's thermal stress: rows of its dofs, of the temperatures of its nodes above the reference [N/K]. Of a
// mesh whose stresses are a material's: none of these, but its expansion [1/K].
struct ThermalStress {
  std::size_t mesh = 0;
  double expansion = 0;
  std::vector<std::int64_t> start;
  std::vector<std::int32_t> node;
  std::vector<double> value;
};

struct NetworkReport {
  ConductionReport solve;
  std::int64_t unfit = 0; // contacts that push and have no radius, which a kernel asks for
  std::int64_t branches = 0, rounds = 0, factorisations = 0, iterations = 0, broken = 0;
  double residual = 0; // of the last round, against the largest flow
  double closure = 0;  // of charge or heat in the step, relative to in_play
  double power = 0;    // dissipated [W]
  // How far the temperatures that mechanics saw in the step are from those at its end: of the loads of meshes that
  // expand, or else of the temperatures, above the reference, the share that was not seen.
  double coupling = 0;
  int passes = 1;  // of the whole step, where it is repeated
  double flow = 0; // inflow at held values and sources [A | W]
  const char* status = "none";
};

class Network {
public:
  enum class Kind { electrical, thermal };
  enum class Split { none, halves, effusivity };

  Kind kind = Kind::electrical;
  std::vector<NetworkMaterial> materials;
  struct Use {
    cairn_conductance* kernel = nullptr;
    std::vector<double> params;
  };
  std::vector<Use> kernels;  // side by side
  bool needs_radius = false; // of the contacts that push
  bool needs_bond = false;   // what laws remember of bonds: "beta", the share that is intact, and their area
  std::optional<OxideFilm> film;
  std::vector<NetworkSource> sources;
  // Branches that are given: conductance, and capacity that couples their ends [J/K]; nodes of meshes with theirs.
  std::vector<std::int64_t> branch_a, branch_b, node;
  std::vector<double> branch_conductance, branch_capacity, node_capacity;
  ConductionOptions options;
  double theta = 1, depth = 1, reference = 293.15; // [-], [m], temperature at which expansion counts from [K]
  std::vector<ThermalStress> stresses;
  bool steady = false;
  double coupling_tolerance = std::numeric_limits<double>::infinity(); // beyond which a step is made once more
  int most_rounds = 60, most_passes = 30;
  Split friction = Split::none, joule = Split::none;
  double switched_share = 0; // of the films that may break in the last round

  NetworkBalance balance;
  NetworkReport report;
  // Per contact of the step, in the order of the candidates.
  std::vector<double> conductance, flow, power; // flow from A to B; power on both sides [W]
  // Films that are gone, by the keys of their contacts, for the next step and for a checkpoint.
  std::vector<ContactKey> broken_keys;

  // Time of free flight at the begin of the step, before its contacts [s].
  double flown = 0;
  // Heat of impacts before those contacts, from the candidates as they stand, is that of the next advance_temperature.
  void keep_impact_heat(Simulation& s);
  void forget_flight() { flown = owed_friction_ = 0, owed_.clear(); }

  void advance_potential(Simulation& s, double h, const Network* thermal);
  void advance_temperature(Simulation& s, double h, const Network* electrical);
  void load_meshes(Simulation& s);
  void separate_hulls(Scene& scene);
  void remember_shapes(const Scene& scene, const Network* before); // before bodies bend
  // Temperatures that mechanics see in the step: those at its begin, or what the last pass found at its end.
  const double* seen(const double* at_begin) const { return expected_.empty() ? at_begin : expected_.data(); }
  void expect(std::vector<double> end) { expected_ = std::move(end); }
  void changed() { order_ = -1; } // sources or branches
  std::int64_t bytes() const;

private:
  const NetworkMaterial& material_at(const Scene& scene, std::int64_t contactor) const;
  bool grows(const Scene& scene, std::int64_t contactor) const;
  void grow(Simulation& s);
  void bend(Simulation& s);
  void move_anchors(Simulation& s) const;
  void bend_hull(Contactors& k, std::int64_t contactor, double factor, double expansion, const double* from,
                 const double* to) const;
  double coupling(const Simulation& s) const;
  void place(const Simulation& s);
  void gather(Simulation& s, double h);
  void attract(Simulation& s);
  void conduct(const Simulation& s, const double* temperature, std::vector<double>& out);
  void recall_films(const Simulation& s);
  void remember_films(const Simulation& s);
  void lay_branches(const Simulation& s);
  void weigh_branches(const std::vector<double>& of_contact);
  ConductionReport solve(double* x);
  void electrodes();
  void settle_current(const Simulation& s, double h, const std::vector<double>& potential);
  // of a step of heat
  void contact_heat(Simulation& s, double h, const Network* electrical);
  void begin_heat(const Simulation& s);
  double heat_residual(double h);
  void slopes(double h);
  void step_heat(const Simulation& s, double h);
  bool join_perfectly();
  void share_perfectly(double h);
  void settle_heat(Simulation& s, double h);
  double stored(std::size_t i) const; // by a body in the step [J]

  std::int64_t order_ = -1, unfit_ = 0;
  std::vector<std::int32_t> material_;  // of each unknown; -1: none, as of nodes, and of marks of joints in the world
  std::vector<double> capacity_, mass_; // lumped capacity of nodes, mass of rigid bodies; infinite: a reservoir
  std::vector<std::vector<std::int32_t>> source_body_; // unknowns
  std::vector<std::int32_t> fixed_a_, fixed_b_;
  // per contact
  std::vector<double> columns_, intact_, area_, lane_out_, force_, radius_, clean_, local_, sliding_, drawn_;
  std::vector<std::int8_t> broken_;
  std::vector<std::int32_t> side_a_, side_b_;
  // per branch: contacts first, then given branches, then those between bodies of an electrode
  std::vector<std::int32_t> a_, b_, of_contact_;
  std::vector<double> weight_, value_, through_;
  std::int64_t contact_branches_ = 0;
  // per unknown
  std::vector<double> x_, source_, leak_, potential_, warm_;
  std::vector<std::uint8_t> held_;
  // of heat
  std::vector<double> rise_low_, now_low_; // what the sums beside lost
  std::vector<double> begin_, now_, rise_, given_, out_begin_, out_now_, late_, early_, contact_heat_;
  std::vector<std::pair<std::int64_t, double>> owed_; // heat of impacts, by ids of bodies [J]
  double owed_friction_ = 0;
  std::vector<std::int32_t> joined_;   // who stands for a body among those that perfect conductors join; empty: none
  std::vector<double> lack_, perfect_; // of each body before its joined ones answer for it [W]; through each branch [W]
  std::vector<double> expected_;       // temperatures at the end of the step by its last pass
  std::vector<double> vertex_, offset_, gradient_; // of hulls and contactors before they bend; (dim, bodies) at the end
  Conduction conduction_;
  Scratch scratch_;
};

// Value of the body or mesh node that carries a contactor; value: per unknown.
double value_at(const Simulation& s, const double* value, std::int32_t contactor);

// Networks of a simulation.
struct Networks {
  std::optional<Network> electrical, thermal;
  void advance(Simulation& s, double h);
  void keep_flight(Simulation& s, double time); // bodies flew for that time; contacts act from now on
  void forget_flight();
  bool repeats() const { return thermal && thermal->coupling_tolerance < std::numeric_limits<double>::infinity(); }
  std::int64_t bytes() const;
};

// A step that is made again from its begin, mechanics and conductances each time at the temperatures that the last pass
// found at its end, until these stay. It keeps the whole state of the begin, as a checkpoint does.
const StepReport& step_coupled(Simulation& s, double h);

} // namespace cairn
