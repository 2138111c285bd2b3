#include "mesh_step.hpp"

#include <algorithm>

namespace cairn {

void MeshStep::weigh(const double* gravity) {
  const auto dim = std::size_t(model_.dim);
  if (!weight.empty() && std::equal(gravity_.begin(), gravity_.end(), gravity)) return;
  gravity_.assign(gravity, gravity + dim);
  weight.resize(matrices_.lumped.size());
  for (std::size_t i = 0; i < matrices_.lumped.size(); ++i) a[i] = gravity[i % dim];
  matrices_.multiply_mass(a.data(), weight.data());
}

void MeshStep::gather(const Field<double>& field, double* out) const {
  std::copy_n(field[first_node], model_.dofs(), out);
}

void MeshStep::scatter(const double* v, Field<double>& field) const {
  std::copy_n(v, model_.dofs(), field[first_node]);
}

} // namespace cairn
