// Damping of modes, C = U D U' with U = M f and D the rates 2 zeta omega (Wilson & Penzien 1972): few columns beside
// the matrices of a mesh, which keep their pattern.
#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "mesh_body.hpp"

namespace cairn {

namespace {

// Lower factor of a symmetric positive definite matrix (n, n) in its place; false: it is none.
bool factor_small(std::size_t n, std::vector<double>& a) {
  for (std::size_t j = 0; j < n; ++j)
    for (std::size_t i = j; i < n; ++i) {
      double sum = a[j * n + i];
      for (std::size_t k = 0; k < j; ++k) sum -= a[k * n + i] * a[k * n + j];
      if (i == j && !(sum > 0)) return false;
      a[j * n + i] = i == j ? std::sqrt(sum) : sum / a[j * n + j];
    }
  return true;
}

void solve_small(std::size_t n, const std::vector<double>& l, double* b) {
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= l[k * n + i] * b[k];
    b[i] /= l[i * n + i];
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t k = i + 1; k < n; ++k) b[i] -= l[i * n + k] * b[k];
    b[i] /= l[i * n + i];
  }
}

double inner(const double* x, const double* y, std::int64_t n) {
  double sum = 0;
  for (std::int64_t i = 0; i < n; ++i) sum += x[i] * y[i];
  return sum;
}

} // namespace

void MeshBody::find_modal_momentum() {
  const std::int64_t n = model.dofs();
  const std::size_t modes = model.mode_rates.size();
  modal_momentum_.resize(std::size_t(n) * modes);
  modal_pull_.resize(modes);
  for (std::size_t k = 0; k < modes; ++k) {
    double* u = &modal_momentum_[std::size_t(n) * k];
    multiply(model.mass, &model.modes[std::size_t(n) * k], u);
    for (std::int64_t i = 0; i < n; ++i)
      if (model.held[std::size_t(i)]) u[i] = 0;
  }
}

void MeshBody::damp_modes(const double* v, double* out) const {
  const std::int64_t n = model.dofs();
  for (std::size_t k = 0; k < model.mode_rates.size(); ++k) {
    const double *u = &modal_momentum_[std::size_t(n) * k], pull = model.mode_rates[k] * inner(u, v, n);
    for (std::int64_t i = 0; i < n; ++i) out[i] += pull * u[i];
  }
}

// Z = A^-1 U without modes, and the factor of D^-1/damping + U'Z.
void MeshBody::factorise_modes(Factors& f) {
  const auto n = std::size_t(model.dofs());
  const std::size_t modes = model.mode_rates.size();
  f.modal_reach.assign(modal_momentum_.begin(), modal_momentum_.end());
  std::vector<double> small(modes * modes, 0.0);
  for (std::size_t k = 0; k < modes; ++k) {
    double* z = &f.modal_reach[n * k];
    model.ties.empty() ? f.soe->solve(z) : model.ties.solve(*f.soe, z);
    for (std::size_t l = 0; l < modes; ++l) small[k * modes + l] = inner(&modal_momentum_[n * l], z, std::int64_t(n));
    small[k * modes + k] += 1 / (f.damping * model.mode_rates[k]);
  }
  if (!factor_small(modes, small))
    throw Error("the damped modes of the mesh '" + model.name +
                "' leave no positive definite matrix: give modes of unit mass");
  f.modal_factor = std::move(small);
}

void MeshBody::solve_modes(double* b, std::int64_t columns) {
  const auto n = std::size_t(model.dofs());
  const std::size_t modes = model.mode_rates.size();
  std::vector<double>& pull = modal_pull_;
  for (std::int64_t c = 0; c < columns; ++c) {
    double* x = b + std::size_t(c) * n;
    for (std::size_t k = 0; k < modes; ++k) pull[k] = inner(&modal_momentum_[n * k], x, std::int64_t(n));
    solve_small(modes, now_->modal_factor, pull.data());
    for (std::size_t k = 0; k < modes; ++k) {
      const double* z = &now_->modal_reach[n * k];
      for (std::size_t i = 0; i < n; ++i) x[i] -= pull[k] * z[i];
    }
  }
}

// True if A less h/2 U D U' is positive definite, given that A is.
bool MeshBody::steady_with_modes(const Soe& soe, double h) {
  const auto n = std::size_t(model.dofs());
  const std::size_t modes = model.mode_rates.size();
  std::vector<double> small(modes * modes, 0.0), z(n);
  for (std::size_t k = 0; k < modes; ++k) {
    std::copy_n(&modal_momentum_[n * k], n, z.begin());
    model.ties.empty() ? soe.solve(z.data()) : model.ties.solve(soe, z.data());
    for (std::size_t l = 0; l < modes; ++l)
      small[k * modes + l] = -h / 2 * std::sqrt(model.mode_rates[k] * model.mode_rates[l]) *
                             inner(&modal_momentum_[n * l], z.data(), std::int64_t(n));
    small[k * modes + k] += 1;
  }
  return factor_small(modes, small);
}

} // namespace cairn
