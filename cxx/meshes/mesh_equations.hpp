// Systems of equations of a mesh.
#pragma once
#include <memory>

#include "mesh_step.hpp"

namespace cairn {

// Factorises matrices on the sparsity pattern of a mesh.
class MeshEquations {
public:
  MeshEquations(MeshModel& model, const MeshMatrices& matrices, const MeshStep& step)
      : model_(model), matrices_(matrices), step_(step) {}
  std::unique_ptr<Soe> make_soe() const;
  SoeStatus factor(Soe& soe, const double* value) const;
  [[noreturn]] void refuse(const SoeStatus& status) const;
  void solve_mass(double* b);       // of held dofs: zero
  void solve_bound_mass(double* b); // held dofs bring their given x

private:
  bool lost_mass(std::int64_t row) const;

  MeshModel& model_;
  const MeshMatrices& matrices_;
  const MeshStep& step_;
  std::unique_ptr<Soe> mass_; // factors of M, for histories alone
};

} // namespace cairn
