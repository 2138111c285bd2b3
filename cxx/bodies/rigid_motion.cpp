#include "rigid_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "../base/small_matrices.hpp"
#include "../base/vectors.hpp"

namespace cairn {
namespace {

// The quaternion whose rotation is nearest to a matrix, by rows.
std::array<double, 4> nearest_quaternion(const Rotation& b) {
  const double trace = b[0] + b[4] + b[8], z[3] = {b[7] - b[5], b[2] - b[6], b[3] - b[1]};
  double k[4][4], axes[4][4];
  k[0][0] = trace;
  for (std::size_t i = 0; i < 3; ++i) {
    k[0][i + 1] = k[i + 1][0] = z[i];
    for (std::size_t j = 0; j < 3; ++j) k[i + 1][j + 1] = b[3 * i + j] + b[3 * j + i] - (i == j ? trace : 0);
  }
  diagonalise(k, axes);
  std::size_t best = 0;
  for (std::size_t i = 1; i < 4; ++i)
    if (k[i][i] > k[best][best]) best = i;
  std::array<double, 4> q{axes[0][best], axes[1][best], axes[2][best], axes[3][best]};
  const double size = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (double& x : q) x /= size;
  return q;
}

void multiply(const SparseMatrix& lower, const double* x, double* out) {
  std::fill_n(out, lower.n, 0.0);
  for (std::int64_t c = 0; c < lower.n; ++c)
    for (std::int64_t e = lower.start[c]; e < lower.start[c + 1]; ++e) {
      const std::int32_t r = lower.row[e];
      out[r] += lower.value[e] * x[c];
      if (r != c) out[c] += lower.value[e] * x[r];
    }
}

// Velocities (nd, dim n) of nodes by those of a rigid body: along the axes, then spins.
std::vector<std::vector<double>> rates_of(int dim, std::span<const double> arm) {
  std::vector<std::vector<double>> out(std::size_t(3 * dim - 3), std::vector<double>(arm.size(), 0.0));
  for (std::size_t i = 0; i < arm.size(); i += std::size_t(dim)) {
    const double* a = &arm[i];
    for (std::size_t k = 0; k < std::size_t(dim); ++k) out[k][i + k] = 1;
    if (dim == 2) {
      out[2][i] = -a[1];
      out[2][i + 1] = a[0];
      continue;
    }
    for (std::size_t k = 0; k < 3; ++k) { // of a unit spin along axis k
      out[3 + k][i + (k + 1) % 3] = -a[(k + 2) % 3];
      out[3 + k][i + (k + 2) % 3] = a[(k + 1) % 3];
    }
  }
  return out;
}

// Same as velocities_with_momentum; with `forces` the forces of this motion taken as accelerations.
std::vector<double> rigid(int dim, const SparseMatrix& mass, std::span<const double> arm,
                          std::span<const double> momentum, bool forces) {
  const auto rates = rates_of(dim, arm);
  const std::size_t n = rates.size();
  std::vector<std::vector<double>> moving(n, std::vector<double>(arm.size()));
  for (std::size_t k = 0; k < n; ++k) multiply(mass, rates[k].data(), moving[k].data());
  std::vector<double> gram(n * n), of(momentum.begin(), momentum.end());
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) gram[n * i + j] = dot(rates[i], moving[j]);
  constexpr double least = 64 * std::numeric_limits<double>::epsilon();
  if (!factor_symmetric(n, gram.data(), least))
    throw Error(
        "the nodes of the mesh have no inertia about an axis, so that no motion has the angular momentum of the "
        "body: give a mesh whose nodes are not on a line");
  solve_symmetric(n, gram.data(), of.data());
  std::vector<double> out(arm.size(), 0.0);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t i = 0; i < out.size(); ++i) out[i] += (forces ? moving : rates)[k][i] * of[k];
  return out;
}

std::vector<double> arms_of(int dim, std::span<const double> x, const std::array<double, 3>& centre) {
  std::vector<double> out(x.begin(), x.end());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] -= centre[i % std::size_t(dim)];
  return out;
}

} // namespace

Rotation rotation_of(int dim, const double* stored) {
  if (dim == 2) {
    const double c = std::cos(stored[0]), s = std::sin(stored[0]);
    return {c, -s, 0, s, c, 0, 0, 0, 1};
  }
  const double size =
      std::sqrt(stored[0] * stored[0] + stored[1] * stored[1] + stored[2] * stored[2] + stored[3] * stored[3]);
  const double w = stored[0] / size, x = stored[1] / size, y = stored[2] / size, z = stored[3] / size;
  return {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
          2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
          2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
}

void stored_rotation(int dim, const Rotation& r, double* stored) {
  if (dim == 2) {
    stored[0] = std::atan2(r[3], r[0]);
    return;
  }
  const auto q = nearest_quaternion(r);
  std::copy(q.begin(), q.end(), stored);
}

Rotation times(const Rotation& a, const Rotation& b) {
  Rotation out{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k) out[3 * i + j] += a[3 * i + k] * b[3 * k + j];
  return out;
}

Rotation transposed(const Rotation& a) { return {a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8]}; }

void turn(int dim, const Rotation& r, std::span<const double> from, double* to) {
  const auto d = std::size_t(dim);
  for (std::size_t i = 0; i < from.size(); i += d)
    for (std::size_t k = 0; k < d; ++k) {
      double sum = 0;
      for (std::size_t j = 0; j < d; ++j) sum += r[3 * k + j] * from[i + j];
      to[i + k] = sum;
    }
}

std::vector<double> node_weights(int dim, const SparseMatrix& mass) {
  std::vector<double> out(std::size_t(mass.n / dim), 0.0);
  for (std::int64_t c = 0; c < mass.n; c += dim)
    for (std::int64_t e = mass.start[c]; e < mass.start[c + 1]; ++e) {
      const std::int32_t r = mass.row[e];
      if (r % dim != 0) continue;
      out[std::size_t(r / dim)] += mass.value[e];
      if (r != c) out[std::size_t(c / dim)] += mass.value[e];
    }
  return out;
}

std::array<double, 3> centre_of(int dim, std::span<const double> weight, std::span<const double> x) {
  std::array<double, 3> out{};
  double mass = 0;
  for (std::size_t i = 0; i < weight.size(); ++i) {
    mass += weight[i];
    for (std::size_t k = 0; k < std::size_t(dim); ++k) out[k] += weight[i] * x[std::size_t(dim) * i + k];
  }
  for (double& c : out) c /= mass;
  return out;
}

NodesMotion motion_of_nodes(int dim, const SparseMatrix& mass, std::span<const double> x, std::span<const double> v) {
  NodesMotion out;
  const std::vector<double> weight = node_weights(dim, mass);
  for (const double w : weight) out.mass += w;
  out.centre = centre_of(dim, weight, x);
  std::vector<double> given(v.begin(), v.end()), moving(v.size());
  multiply(mass, given.data(), moving.data());
  out.kinetic = 0.5 * dot(given, moving);
  const auto rates = rates_of(dim, arms_of(dim, x, out.centre));
  for (std::size_t k = 0; k < rates.size(); ++k) out.momentum[k] = dot(rates[k], moving);
  return out;
}

std::vector<double> velocities_with_momentum(int dim, const SparseMatrix& mass, std::span<const double> arm,
                                             std::span<const double> momentum) {
  return rigid(dim, mass, arm, momentum, false);
}

std::vector<double> forces_of_wrench(int dim, const SparseMatrix& mass, std::span<const double> x,
                                     std::span<const double> wrench) {
  return rigid(dim, mass, arms_of(dim, x, centre_of(dim, node_weights(dim, mass), x)), wrench, true);
}

Rotation nearest_turn(int dim, std::span<const double> own, std::span<const double> x, std::span<const double> weight) {
  Rotation b{};
  for (std::size_t i = 0; i < weight.size(); ++i)
    for (std::size_t k = 0; k < std::size_t(dim); ++k)
      for (std::size_t j = 0; j < std::size_t(dim); ++j)
        b[3 * k + j] += weight[i] * x[std::size_t(dim) * i + k] * own[std::size_t(dim) * i + j];
  if (dim == 2) {
    const double c = b[0] + b[4], s = b[3] - b[1], size = std::hypot(c, s);
    return size > 0 ? Rotation{c / size, -s / size, 0, s / size, c / size, 0, 0, 0, 1} : upright;
  }
  return rotation_of(3, nearest_quaternion(b).data());
}

} // namespace cairn
