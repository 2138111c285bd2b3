// Scale of the error over ranks, by the rules of solvers/sweeps/step_error.hpp, with exact sums over the bodies of all
// ranks.
#pragma once
#include <vector>

#include "exchange.hpp"
#include "part.hpp"

namespace cairn {

class RankedScale {
public:
  // Once contacts are prepared. mesh_rank: the rank that has the contacts of deformable bodies.
  void begin(std::vector<Part>& parts, int mesh_rank, double tolerance, Exchange& exchange);
  // Records hold the velocity that the impulses leave. by_impulses: scale that they and the free velocity give [J]
  double measure(double by_impulses, const std::vector<Part>& parts, Exchange& exchange);
  // What the errors of contacts may add up to in velocities, over their size, as in SolidCorrection::amplification:
  // residual, size: sums of |F|^2/rho and |r|^2/rho over the contacts that were measured last [J]. 0: not known
  double of_velocities(double residual, double size) const;
  bool bends() const { return bends_; } // contacts rest on deformable bodies

private:
  bool holds_ = false, bends_ = false, turns_ = true;
  double least_ = 1;                   // see FreeScale
  double by_loads_ = 0, of_nodes_ = 0; // see ContactSystem: weight_speed_square, mesh_speed_square [J]
  double speed_square_ = 0;            // of ContactSystem::speed(), where bonds or joints hold [J]
};

} // namespace cairn
