// Stable step of a mesh.
#pragma once
#include "mesh_equations.hpp"

namespace cairn {

// Finds the stability limit of explicit integrators on a mesh.
class MeshStability {
public:
  MeshStability(MeshModel& model, const MeshLoads& loads, const MeshMatrices& matrices, const MeshStep& step,
                const MeshEquations& equations)
      : model_(model), loads_(loads), matrices_(matrices), step_(step), equations_(equations) {}
  // Lower bound of the critical step of central differences [s]. rate_share: factor of the damping forces, which the
  // integrator evaluates at velocities of its own (drag_bound).
  double stable_step(double rate_share, const Field<double>& position);
  void check_step(const cairn_scheme& scheme);     // throws Error beyond the limit of an explicit scheme
  void check_if_asked(const cairn_scheme& scheme); // where h over its limit changed since
  // Requests a new check where a body has stiffened or its cells have become thin. Both show in the change of internal
  // forces along the displacement (dofs) of a step.
  void watch(const std::vector<double>& force_begin, const std::vector<double>& force_end,
             const std::vector<double>& way);

private:
  static constexpr double quick =
      1 + 1e-6; // ratio by which a bound of omega^2 may exceed it: factors of most elements then suffice
  FrequencyBound frequency_bound(bool by_elements,
                                 double slack = quick) const;                // the lower of two, or that of rows alone
  double element_bound(const std::vector<double>& mass, double slack) const; // of omega^2 [1/s2]
  double row_bound(const SparseMatrix& a, const std::vector<double>& mass) const; // of eigenvalues of M^-1 A
  double frequency_estimate(double* xi) const; // lower bound of the highest frequency [1/s], and its damping ratio xi
  bool steady(double h, double rate_share);    // whether central differences of h [s] are stable, by factors
  bool steady_with_modes(const Soe& soe, double h) const; // by factors without them
  double stable_step_there(double rate_share);
  void check_step_there(const cairn_scheme& scheme);
  template <class Use>
  auto with_stiffness_at(const std::vector<double>& u, Use&& use); // for bodies that are not linear

  MeshModel& model_;
  const MeshLoads& loads_;
  const MeshMatrices& matrices_;
  const MeshStep& step_;
  const MeshEquations& equations_;
  const double* seen_at_ = nullptr; // displacements by which frequencies are judged; null: none
  double judged_ = 0;               // share of the limit at which stability was judged last, squared
  std::int64_t since_judged_ = 0;   // [steps]
  double checked_ = 0;              // step over its limit that is known to be stable
};

} // namespace cairn
