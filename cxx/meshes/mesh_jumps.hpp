// Jumps of velocity in a step.
#pragma once
#include <vector>

#include "mesh_factors.hpp"
#include "mesh_history.hpp"

namespace cairn {

// Finds the displacements that jumps of velocity make beside the velocities of a step.
class MeshJumps {
public:
  MeshJumps(const MeshModel& model, const MeshLoads& loads, const Array<double>& impulse, const MeshMatrices& matrices,
            MeshStep& step, MeshEquations& equations, MeshFactors& factors, MeshHistory& history)
      : model_(model), loads_(loads), impulse_(impulse), matrices_(matrices), step_(step), equations_(equations),
        factors_(factors), history_(history) {}
  std::vector<double> all;                // (dofs) by contacts and drives on the mass alone [m/s]
  std::vector<double> given, by_impulses; // (dofs) of them; empty where the integrator has no displacement jumps
  std::vector<double> beyond_scheme;      // (dofs) surplus of reactions to jumps by the impulse of the scheme [N]

  void start();
  void add_forces(const std::vector<double>& jump, double* x);
  void take(double* x);
  void find(const std::vector<double>& end);
  void add_known();
  double way_of(std::size_t i) const;
  double undamped(std::size_t i) const;

private:
  double undamped_share() const;

  const MeshModel& model_;
  const MeshLoads& loads_;
  const Array<double>& impulse_;
  const MeshMatrices& matrices_;
  MeshStep& step_;
  MeshEquations& equations_;
  MeshFactors& factors_;
  MeshHistory& history_;
  std::vector<double> scratch_;
};

} // namespace cairn
