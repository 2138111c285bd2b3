// Step of a mesh whose forces are linear.
#pragma once
#include <vector>

#include "mesh_jumps.hpp"
#include "mesh_works.hpp"

namespace cairn {

// Makes the step of a mesh with constant matrices.
class MeshLinearStep {
public:
  MeshLinearStep(const MeshModel& model, const MeshLoads& loads, const Array<double>& impulse,
                 std::vector<double>& reaction, MeshWork& work, const MeshMatrices& matrices, MeshStep& step,
                 MeshEquations& equations, MeshFactors& factors, MeshHistory& history, MeshJumps& jumps,
                 MeshWorks& works)
      : model_(model), loads_(loads), impulse_(impulse), reaction_(reaction), work_(work), matrices_(matrices),
        step_(step), equations_(equations), factors_(factors), history_(history), jumps_(jumps), works_(works) {}
  void start(); // once the model is known
  void find_free_velocity(Nodes& nodes);
  void account(Nodes& nodes, const double* gravity);
  double stored(const Nodes& nodes); // energy of the displacements at hand [J]
  void start_history(Nodes& nodes);  // derivatives of velocity under constant loads

private:
  void times_velocity(const double* v); // K, C and M of it, unless they are there
  void account_stored(Nodes& nodes, const std::vector<double>& end, const std::vector<double>& way);
  void account_means(const std::vector<double>& way, const std::vector<double>& pull);

  const MeshModel& model_;
  const MeshLoads& loads_;
  const Array<double>& impulse_;
  std::vector<double>& reaction_;
  MeshWork& work_;
  const MeshMatrices& matrices_;
  MeshStep& step_;
  MeshEquations& equations_;
  MeshFactors& factors_;
  MeshHistory& history_;
  MeshJumps& jumps_;
  MeshWorks& works_;
  std::vector<double> stiff_q_;                                     // K q of the step at hand [N]
  std::vector<double> moving_, stiff_, damped_, momentum_;          // v and K v, C v, M v, of the last v asked for
  std::vector<double> stiff_begin_, damped_begin_, momentum_begin_; // as the step began
};

} // namespace cairn
