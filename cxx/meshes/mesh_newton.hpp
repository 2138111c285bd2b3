// Newton's method of a mesh.
#pragma once
#include <vector>

#include "mesh_balance.hpp"
#include "mesh_works.hpp"

namespace cairn {

// Makes the step of a mesh that is not linear by Newton's method round the solution of contacts.
class MeshNewton {
public:
  MeshNewton(MeshModel& model, MeshLoads& loads, const Array<double>& impulse, std::vector<double>& reaction,
             MeshWork& work, NewtonSeconds& seconds, const MeshMatrices& matrices, MeshStep& step,
             MeshEquations& equations, MeshStability& stability, MeshFactors& factors, MeshHistory& history,
             MeshJumps& jumps, MeshWorks& works, MeshStresses& stresses)
      : model_(model), loads_(loads), impulse_(impulse), reaction_(reaction), work_(work), seconds_(seconds),
        matrices_(matrices), step_(step), equations_(equations), stability_(stability), factors_(factors),
        history_(history), jumps_(jumps), works_(works), stresses_(stresses),
        balance_(model, loads, impulse, matrices, step, factors, history, jumps, stresses) {}
  void start(Nodes& nodes, double size); // size: of a cell [m]
  void turn_iterate();
  NewtonError judge(double tolerance);
  void linearise(Nodes& nodes);
  void account(Nodes& nodes, const double* gravity);
  void commit() { stresses_.commit(trial_); }
  void start_history(Nodes& nodes, const cairn_scheme& scheme);
  double smooth_change(std::int64_t i) const; // of velocity by forces alone, where rigid parts turn [m/s]

private:
  NewtonError find_change(bool with_tangent, double tolerance);
  void find_free_velocity();
  void account_means(const std::vector<double>& end);

  MeshModel& model_;
  MeshLoads& loads_;
  const Array<double>& impulse_;
  std::vector<double>& reaction_;
  MeshWork& work_;
  NewtonSeconds& seconds_;
  const MeshMatrices& matrices_;
  MeshStep& step_;
  MeshEquations& equations_;
  MeshStability& stability_;
  MeshFactors& factors_;
  MeshHistory& history_;
  MeshJumps& jumps_;
  MeshWorks& works_;
  MeshStresses& stresses_;
  MeshBalance balance_;
  std::vector<double> trial_, start_, way_, jump_before_, jump_now_;
  double error_before_ = 0;    // of the pass before
  bool tangent_known_ = false; // at the iterate, with its stresses
  bool goes_on_ = false;       // a pass is expected after the next one
  bool went_on_ = false;       // the step took several passes
};

} // namespace cairn
