// The state of bodies of a simulation over ranks, which steps may leave with these.
#pragma once
#include "ranks/over_ranks.hpp"

// The simulation, with the state of all bodies; with `workspace` what a step leaves besides.
inline cairn::Simulation& known(cairn::Simulation& s, bool workspace = false) {
  if (auto* ranked = dynamic_cast<cairn::OverRanks*>(&s.strategy())) ranked->fetch(s, workspace);
  return s;
}

// To be called before loads and drives are written.
inline void write_loads(cairn::Simulation& s) {
  if (auto* ranked = dynamic_cast<cairn::OverRanks*>(&s.strategy())) ranked->write_loads(s);
}
