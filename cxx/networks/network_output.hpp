// Results of a network.
#pragma once
#include <cstdint>
#include <vector>

#include "../detection/candidates.hpp"
#include "conduction.hpp"

namespace cairn {

// Amounts since the start, with their signs: their sum is the closure error.
struct NetworkBalance {
  double stored = 0, held = 0, given = 0, convection = 0, radiation = 0, friction = 0, joule = 0; // [J]
  double charge_in = 0, charge_out = 0, supplied = 0;                                             // [C], [C], [J]
  double closure = 0, in_play = 0;
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

struct NetworkOutput {
  NetworkBalance balance;
  NetworkReport report;
  // Per contact of the step, in the order of the candidates.
  std::vector<double> conductance, flow, power; // flow from A to B; power on both sides [W]
  // Films that are gone, by the keys of their contacts, for the next step and for a checkpoint.
  std::vector<ContactKey> broken_keys;
};

} // namespace cairn
