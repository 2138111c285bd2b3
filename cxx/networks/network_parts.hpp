// Parts of a Network. No source but those of Network reads this.
#pragma once
#include "current_step.hpp"
#include "heat_step.hpp"
#include "network.hpp"
#include "thermal_growth.hpp"
#include "thermal_loads.hpp"

namespace cairn {

struct Network::Parts {
  NetworkUnknowns rows;
  ContactSpots spots;
  OxideFilms films;
  NetworkBranches branches{rows};
  CurrentStep current{rows, spots, films, branches};
  HeatStep heat{rows, spots, branches};
  ThermalLoads loads;
  ThermalGrowth growth{rows};
  std::vector<double> warm; // temperatures that conductances of currents see, where there are nodes
};

} // namespace cairn
