// Geometric stiffness of loaded joints: bodies that it stiffens against turns in a step.
#pragma once
#include <vector>

#include "../../simulation/simulation.hpp"

namespace cairn {

class StiffJoints {
public:
  // Stiffens bodies for the loads of joints by the impulses at hand. True: contacts have to be assembled anew, with
  // other inverse inertias.
  bool stiffen(Simulation& s, double h);
  // Gives bodies their own inertia back.
  void restore(Simulation& s);
  // Begins a step, whose inertias are computed anew.
  void begin() { stiffened_.clear(); }
  // True if joints swing by the impulses at hand faster than the step was stiffened for.
  bool swing(Simulation& s, double h);
  // Energy that the stiffness took in the step from bodies and contacts [J].
  double energy(const Simulation& s) const;

private:
  // Numbers of a body without the loads of its joints, and the inertia that these add.
  struct Stiffened {
    std::int32_t body;
    double spin[3], inverse_mass[3], inverse_inertia[6], added[6];
  };
  std::vector<Stiffened> stiffened_;
  std::vector<JointLoad> loads_;
};

} // namespace cairn
