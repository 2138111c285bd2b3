// Derivatives that an integrator keeps.
#pragma once
#include <vector>

#include "mesh_equations.hpp"

namespace cairn {

struct Nodes;

// Adds the stored derivatives of an integrator to the step of a mesh.
class MeshHistory {
public:
  MeshHistory(MeshModel& model, const MeshMatrices& matrices, MeshStep& step, MeshEquations& equations)
      : model_(model), matrices_(matrices), step_(step), equations_(equations) {}
  // Linear bodies: products of stored derivatives with K, C and M, zero without such a matrix [N].
  std::vector<double> stiff, damped, momentum; // momentum: of M [m/s times kg]
  // Other bodies: stored derivatives in displacements, predicted ones, damped velocities and velocities; empty: none.
  std::vector<double> past, elastic_past, damped_past, kicked_past;

  void sum(Nodes& nodes, const double* factors, double* out) const; // the derivatives, each with its factor
  void multiply(Nodes& nodes);
  void take(Nodes& nodes);
  void follow_leaders(Nodes& nodes); // applies ties to stored derivatives
  void kept_momentum(double* out) const;

private:
  void find_kept_way(Nodes& nodes);

  MeshModel& model_;
  const MeshMatrices& matrices_;
  MeshStep& step_;
  MeshEquations& equations_;
};

} // namespace cairn
