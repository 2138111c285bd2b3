#include "mesh_rates.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "../fe/bulk_model.hpp"

namespace cairn {

namespace {

// Tangent of strain-rate terms: tangent of a body at rest over a step of 1 s less that over an infinite step. UMATs are
// asked for steps of 1 s alone, and give zero.
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

// Stability limit by drag. A step of an oscillator multiplies displacement, velocity and history by A - b (k e' + c
// d'): k stiffness, c drag, A the motion without both, b the effect of a force, e and d the rows of displacement and
// velocity. At the limit -1 is an eigenvalue: k e'x + c d'x = 1 with (A + 1) x = b; `largest` is the limit without
// drag. Drag taken at the end of the step has no such limit.
DragBound drag_bound(const cairn_scheme& scheme) {
  constexpr int most = 2 + cairn_most_history;
  if (scheme.damping > 0 || !std::isfinite(scheme.largest)) return {};
  const int n = 2 + scheme.histories;
  double a[most][most + 1] = {}, place[most] = {1, scheme.elastic_velocity}, velocity[most] = {0, 1};
  a[0][1] = scheme.h;
  for (int k = 2; k < n; ++k) {
    a[0][k] = scheme.position[k - 2] + scheme.h * scheme.share * scheme.velocity[k - 2];
    a[1][k] = scheme.velocity[k - 2];
    for (int j = 2; j < n; ++j) a[j][k] = scheme.update[cairn_most_history * (k - 2) + j - 2];
    place[k] = scheme.elastic[k - 2];
    velocity[k] = scheme.damping_history[k - 2];
  }
  for (int j = 0; j < n; ++j) {
    a[j][j] += j < 2 ? 2 : 1;
    a[j][n] = scheme.impulse * (j == 0 ? scheme.h * scheme.share : j == 1 ? 1 : scheme.gain[j - 2]);
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
  double of_place = 0, of_velocity = 0; // 1/k [s2], 1/c [s] at the limit
  for (int k = 0; k < n; ++k) {
    of_place += place[k] * a[k][n] / a[k][k];
    of_velocity += velocity[k] * a[k][n] / a[k][k];
  }
  constexpr double rounding = 0x1p-40; // of a ratio, in a solution of six equations at most: both limits are one
  DragBound out{scheme.largest * std::sqrt(of_place) / scheme.h, 1};
  if (std::abs(out.frequency - 1) < rounding) out.frequency = 1;
  out.rate = scheme.largest * of_velocity / scheme.h / out.frequency;
  return out;
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
