#include "mesh_rates.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "../fe/bulk_model.hpp"

namespace cairn {

namespace {

// Tangent of a body at rest in a step of a second beyond that of one without end: what rates of strain bear. Users'
// routines are asked for steps of a second alone, and give none.
std::vector<double> tangent_of_rates(BulkModel& body, const SparseMatrix& pattern) {
  std::vector<double> none(body.place().size(), 0.0), force(none.size()), rate(pattern.row.size(), 0.0), rest(rate);
  body.fit(pattern);
  constexpr double endless = std::numeric_limits<double>::infinity();
  const bool known = body.evaluate(none.data(), 1, 1, force.data(), rate.data()).ok() &&
                     body.evaluate(none.data(), endless, 1, force.data(), rest.data()).ok();
  for (std::size_t e = 0; e < rate.size(); ++e) rate[e] = known ? rate[e] - rest[e] : 0;
  return rate;
}

// By the first cell of each block, so that bodies that see no rate are not assembled for it.
bool sees_rates(int dim, const BulkModel& whole) {
  return std::any_of(whole.cells().begin(), whole.cells().end(), [&](const BulkCells& cells) {
    if (cells.count() == 0) return false;
    BulkCells first = cells;
    const auto nodes = std::size_t(cells.element->nodes), dofs = std::size_t(dim) * nodes;
    first.node.resize(nodes);
    first.initial_stress.clear();
    std::vector<double> place;
    for (std::int32_t& node : first.node) {
      for (int k = 0; k < dim; ++k) place.push_back(whole.place()[std::size_t(dim * node + k)]);
      node = std::int32_t(&node - first.node.data());
    }
    std::vector<std::int32_t> unknown(dofs);
    std::iota(unknown.begin(), unknown.end(), 0);
    const std::int64_t start[2] = {0, std::int64_t(dofs)};
    const SparseMatrix pattern = lower_pattern(std::int64_t(dofs), start, unknown);
    BulkModel one(dim, std::move(place), {std::move(first)});
    const std::vector<double> rate = tangent_of_rates(one, pattern);
    return std::any_of(rate.begin(), rate.end(), [](double value) { return value < 0 || value > 0; });
  });
}

} // namespace

// Without stiffness a step multiplies the velocity and what is kept by A - c b d', where A of them is [1 velocity; 0
// update], b = impulse [1; gain], and d = [1; damping_history] gives the velocity that drag is of: the step is at its
// limit where -1 is an eigenvalue, 1/c = d' (A + 1)^-1 b. Drag at the end of the step has none.
double rate_share(const cairn_scheme& scheme) {
  constexpr int most = 1 + cairn_most_history;
  if (scheme.damping > 0 || !std::isfinite(scheme.largest)) return 1;
  const int n = 1 + scheme.histories;
  double a[most][most + 1] = {};
  for (int j = 0; j < n; ++j) {
    for (int k = 1; k < n; ++k)
      a[j][k] = j == 0 ? scheme.velocity[k - 1] : scheme.update[cairn_most_history * (k - 1) + j - 1];
    a[j][j] += j == 0 ? 2 : 1;
    a[j][n] = scheme.impulse * (j == 0 ? 1 : scheme.gain[j - 1]);
  }
  for (int k = 0; k < n; ++k) { // Gauss's elimination
    int pivot = k;
    for (int j = k; j < n; ++j)
      if (std::abs(a[j][k]) > std::abs(a[pivot][k])) pivot = j;
    std::swap(a[k], a[pivot]);
    for (int j = 0; j < n; ++j) {
      const double share = j == k ? 0 : a[j][k] / a[k][k];
      for (int l = k; l <= n; ++l) a[j][l] -= share * a[k][l];
    }
  }
  double inverse = a[0][n] / a[0][0]; // of the largest rate [s]
  for (int k = 1; k < n; ++k) inverse += scheme.damping_history[k - 1] * a[k][n] / a[k][k];
  return scheme.largest * inverse / scheme.h;
}

std::vector<double> rate_values(const MeshModel& model) {
  std::vector<double> out = model.damping.value;
  if (!model.bulk || !model.bulk->solid() || !sees_rates(model.dim, *model.bulk->solid())) return out;
  const std::shared_ptr<InternalForces> apart = model.bulk->another(); // the one at hand is within a step
  const std::vector<double> rate = tangent_of_rates(*apart->solid(), model.mass);
  out.resize(rate.size());
  for (std::size_t e = 0; e < rate.size(); ++e) out[e] += rate[e];
  return out;
}

} // namespace cairn
