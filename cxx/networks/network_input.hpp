// Input of a network: materials, conductances of contacts, sources, branches that are given.
#pragma once
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "cairn/core.h"
#include "conduction.hpp"

namespace cairn {

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

// Forces of a mesh's thermal stress: rows of its dofs, of the temperatures of its nodes above the reference [N/K]. Of a
// mesh whose stresses are a material's: none of these, but its expansion [1/K].
struct ThermalStress {
  std::size_t mesh = 0;
  double expansion = 0;
  std::vector<std::int64_t> start;
  std::vector<std::int32_t> node;
  std::vector<double> value;
};

struct NetworkInput {
  enum class Kind { electrical, thermal };
  enum class Split { none, halves, effusivity }; // of the heat of a contact among its sides

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
};

} // namespace cairn
