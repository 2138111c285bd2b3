// Damping of modes, C = U D U' with U = M f and D the rates 2 zeta omega (Wilson & Penzien 1972): few columns beside
// the matrices of a mesh, which keep their pattern.
#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "../base/small_matrices.hpp"
#include "../base/vectors.hpp"
#include "mesh_factors.hpp"

namespace cairn {

// Z = A^-1 U without modes, and the factor of D^-1/damping + U'Z.
void MeshFactors::factorise_modes(IterationFactors& f) {
  const auto n = std::size_t(model_.dofs());
  const std::size_t modes = model_.mode_rates.size();
  f.modal_reach.assign(matrices_.modal_momentum.begin(), matrices_.modal_momentum.end());
  std::vector<double> small(modes * modes, 0.0);
  for (std::size_t k = 0; k < modes; ++k) {
    double* z = &f.modal_reach[n * k];
    model_.ties.empty() ? f.soe->solve(z) : model_.ties.solve(*f.soe, z);
    for (std::size_t l = 0; l < modes; ++l)
      small[k * modes + l] = dot(&matrices_.modal_momentum[n * l], z, std::int64_t(n));
    small[k * modes + k] += 1 / (f.damping * model_.mode_rates[k]);
  }
  if (!factor_symmetric(modes, small.data(), 0))
    throw Error("the damped modes of the mesh '" + model_.name +
                "' leave no positive definite matrix: give modes of unit mass");
  f.modal_factor = std::move(small);
}

void MeshFactors::solve_modes(double* b, std::int64_t columns) {
  const auto n = std::size_t(model_.dofs());
  const std::size_t modes = model_.mode_rates.size();
  std::vector<double>& pull = modal_pull_;
  pull.resize(modes);
  for (std::int64_t c = 0; c < columns; ++c) {
    double* x = b + std::size_t(c) * n;
    for (std::size_t k = 0; k < modes; ++k) pull[k] = dot(&matrices_.modal_momentum[n * k], x, std::int64_t(n));
    solve_symmetric(modes, now->modal_factor.data(), pull.data());
    for (std::size_t k = 0; k < modes; ++k) {
      const double* z = &now->modal_reach[n * k];
      for (std::size_t i = 0; i < n; ++i) x[i] -= pull[k] * z[i];
    }
  }
}

} // namespace cairn
