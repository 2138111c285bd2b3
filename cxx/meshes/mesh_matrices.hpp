// Products with the matrices of a mesh.
#pragma once
#include <cstdint>
#include <vector>

#include "mesh_model.hpp"

namespace cairn {

// Multiplies by the mass, stiffness or damping of a mesh.
class MeshMatrices {
public:
  explicit MeshMatrices(const MeshModel& model) : model_(model) {}
  void start();                       // once the model is known
  std::vector<double> lumped;         // (dofs) [kg]
  double mean_mass = 0;               // of a dof [kg]
  bool lumped_mass = false;           // M is diagonal
  bool damps = false;                 // C is not zero
  bool by_rayleigh = false;           // C is rayleigh[0] M + rayleigh[1] K
  double rayleigh[2] = {0, 0};        // [1/s], [s]
  std::vector<double> modal_momentum; // (dofs, modes) M f, zero on held dofs

  void multiply(const SparseMatrix& a, const double* x, double* out) const;
  void multiply_mass(const double* x, double* out) const;
  void stiffness_times(const double* x, double* out) const;
  void damping_times(const double* x, double* out) const;
  double on_diagonal(const std::vector<double>& value, std::int64_t row) const;
  bool diagonal_mass() const; // M as it is given
  double force_weight(std::int64_t i) const;

private:
  void find_rayleigh();
  void find_modal_momentum();
  void damp_modes(const double* v, double* out) const; // adds C v of modes

  const MeshModel& model_;
};

} // namespace cairn
