// Balance of forces on a mesh.
#pragma once
#include <vector>

#include "mesh_stresses.hpp"

namespace cairn {

// Measures the residual of the balance by the inverse of the iteration matrix.
class MeshBalance {
public:
  MeshBalance(const MeshModel& model, const MeshLoads& loads, const Array<double>& impulse,
              const MeshMatrices& matrices, MeshStep& step, MeshFactors& factors, const MeshHistory& history,
              const MeshJumps& jumps, const MeshStresses& stresses)
      : model_(model), loads_(loads), impulse_(impulse), matrices_(matrices), step_(step), factors_(factors),
        history_(history), jumps_(jumps), stresses_(stresses) {}
  std::vector<double> damping, residual; // (dofs) C v_d [N]; of the balance without contacts [N s]
  std::vector<double> norms;             // (dofs, 8) of a measure

  void start();
  void damped_velocity(const std::vector<double>& v); // into step.a
  void find_residual(const std::vector<double>& v);
  double measure(double& scale, std::int64_t& node);
  double rounding();

private:
  double borne_by_held() const;

  const MeshModel& model_;
  const MeshLoads& loads_;
  const Array<double>& impulse_;
  const MeshMatrices& matrices_;
  MeshStep& step_;
  MeshFactors& factors_;
  const MeshHistory& history_;
  const MeshJumps& jumps_;
  const MeshStresses& stresses_;
};

} // namespace cairn
