// Configuration of bodies, nodes and cell at the begin of a step, to which an undone step goes back.
#pragma once
#include "../../simulation/simulation.hpp"

namespace cairn {

class StepBegin {
public:
  void save(Simulation& s);
  void restore(Simulation& s) const;
  const Cell& cell() const { return cell_; }

private:
  Cell cell_; // bodies and nodes have fields of their own for it
};

} // namespace cairn
