// Contacts of the step as conductors: force, curvature and sliding of each, and the conductance by the kernels.
#pragma once
#include <cstdint>
#include <vector>

#include "network_input.hpp"

namespace cairn {

class Simulation;

class ContactSpots {
public:
  std::vector<double> force, radius, sliding; // [N], [m] not a number where the contact has none, [m/s]
  std::int64_t unfit = 0;                     // contacts that push and have no radius, which a kernel asks for

  void gather(Simulation& s, double h, const NetworkInput& in);
  // Conductances by the kernels, at temperatures of the unknowns, or null.
  void conduct(const Simulation& s, const NetworkInput& in, const double* temperature, std::vector<double>& out);
  std::int64_t bytes() const;

private:
  void attract(Simulation& s);
  void gather_bonds(Simulation& s);
  void gather_sliding(Simulation& s);

  std::vector<double> columns_, intact_, area_, lane_out_, local_, drawn_;
};

} // namespace cairn
