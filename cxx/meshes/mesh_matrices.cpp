#include "mesh_matrices.hpp"
#include "../base/vectors.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

void MeshMatrices::start() {
  const auto n = std::size_t(model_.dofs());
  const int dim = model_.dim;
  lumped.assign(n, 0);
  for (std::int64_t column = 0; column < model_.mass.n; ++column)
    for (std::int64_t e = model_.mass.start[column]; e < model_.mass.start[column + 1]; ++e) {
      lumped[model_.mass.row[e]] += model_.mass.value[e];
      if (model_.mass.row[e] != column) lumped[column] += model_.mass.value[e];
    }
  for (std::size_t i = 0; i < n && !model_.node_mass.empty(); ++i) lumped[i] = model_.node_mass[i / dim];
  for (const double mass : lumped) mean_mass += mass / double(n);
  lumped_mass = model_.node_mass.empty();
  const auto vanishes = [](double x) { return !(x < 0 || x > 0); };
  for (std::int64_t column = 0; column < model_.mass.n; ++column)
    for (std::int64_t e = model_.mass.start[column]; e < model_.mass.start[column + 1]; ++e)
      lumped_mass = lumped_mass && (model_.mass.row[e] == column || vanishes(model_.mass.value[e]));
  if (!model_.mode_rates.empty()) find_modal_momentum();
  damps = model_.times_damping || !model_.mode_rates.empty() ||
          !std::all_of(model_.damping.value.begin(), model_.damping.value.end(), vanishes);
  find_rayleigh();
}

bool MeshMatrices::diagonal_mass() const {
  bool alone = true;
  for (std::int64_t column = 0; column < model_.mass.n; ++column)
    for (std::int64_t e = model_.mass.start[column]; e < model_.mass.start[column + 1]; ++e)
      alone = alone && (model_.mass.row[e] == column || !(std::abs(model_.mass.value[e]) > 0));
  return alone;
}

void MeshMatrices::multiply(const SparseMatrix& a, const double* x, double* out) const {
  std::fill_n(out, model_.dofs(), 0.0);
  for (std::int64_t column = 0; column < a.n; ++column) {
    double sum = 0;
    for (std::int64_t e = a.start[column]; e < a.start[column + 1]; ++e) {
      const std::int32_t row = a.row[e];
      out[row] += a.value[e] * x[column];
      if (row != column) sum += a.value[e] * x[row];
    }
    out[column] += sum;
  }
}

void MeshMatrices::multiply_mass(const double* x, double* out) const {
  if (!lumped_mass) return multiply(model_.mass, x, out);
  for (std::int64_t i = 0; i < model_.dofs(); ++i) out[i] = lumped[i] * x[i];
}

void MeshMatrices::stiffness_times(const double* x, double* out) const {
  model_.times_stiffness ? model_.times_stiffness(x, out) : multiply(model_.stiffness, x, out);
}

void MeshMatrices::damping_times(const double* x, double* out) const {
  model_.times_damping ? model_.times_damping(x, out) : multiply(model_.damping, x, out);
  if (!model_.mode_rates.empty()) damp_modes(x, out);
}

// Diagonal entry of values on the pattern of A; 0 where the pattern has none.
double MeshMatrices::on_diagonal(const std::vector<double>& value, std::int64_t row) const {
  for (std::int64_t e = model_.mass.start[row]; e < model_.mass.start[row + 1]; ++e)
    if (model_.mass.row[e] == row) return value[std::size_t(e)];
  return 0;
}

// a and b of Rayleigh's damping, by least squares over the entries of M and K; whether C is that to rounding.
void MeshMatrices::find_rayleigh() {
  constexpr double rounding = 1e-12;
  rayleigh[0] = rayleigh[1] = 0;
  by_rayleigh = !damps;
  if (!damps || !model_.mode_rates.empty() || model_.times_damping ||
      model_.damping.value.size() != model_.mass.value.size())
    return;
  double mm = 0, mk = 0, kk = 0, cm = 0, ck = 0, largest = 0, worst = 0;
  for (std::size_t e = 0; e < model_.mass.value.size(); ++e) {
    const double m = model_.mass.value[e], k = model_.stiffness.value[e], c = model_.damping.value[e];
    mm += m * m, mk += m * k, kk += k * k, cm += c * m, ck += c * k;
    largest = std::max(largest, std::abs(c));
  }
  const double det = mm * kk - mk * mk;
  if (!(mm > 0)) return;
  if (det > 1e-14 * mm * kk)
    rayleigh[0] = (cm * kk - ck * mk) / det, rayleigh[1] = (ck * mm - cm * mk) / det;
  else
    rayleigh[0] = cm / mm;
  for (std::size_t e = 0; e < model_.mass.value.size(); ++e)
    worst = std::max(worst, std::abs(model_.damping.value[e] - rayleigh[0] * model_.mass.value[e] -
                                     rayleigh[1] * model_.stiffness.value[e]));
  by_rayleigh = worst <= rounding * largest;
}

void MeshMatrices::find_modal_momentum() {
  const std::int64_t n = model_.dofs();
  const std::size_t modes = model_.mode_rates.size();
  modal_momentum.resize(std::size_t(n) * modes);
  for (std::size_t k = 0; k < modes; ++k) {
    double* u = &modal_momentum[std::size_t(n) * k];
    multiply(model_.mass, &model_.modes[std::size_t(n) * k], u);
    for (std::int64_t i = 0; i < n; ++i)
      if (model_.held[std::size_t(i)]) u[i] = 0;
  }
}

void MeshMatrices::damp_modes(const double* v, double* out) const {
  const std::int64_t n = model_.dofs();
  for (std::size_t k = 0; k < model_.mode_rates.size(); ++k) {
    const double *u = &modal_momentum[std::size_t(n) * k], pull = model_.mode_rates[k] * dot(u, v, n);
    for (std::int64_t i = 0; i < n; ++i) out[i] += pull * u[i];
  }
}

// By which forces of a dof are kept [kg]: any that stays, where rows of a consistent mass have none.
double MeshMatrices::force_weight(std::int64_t i) const {
  return lumped[std::size_t(i)] > 0 ? lumped[std::size_t(i)] : mean_mass;
}

} // namespace cairn
