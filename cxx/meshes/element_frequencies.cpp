// Upper bound of the frequencies of a mesh with lumped masses: the lower of two bounds. By elements (Irons & Treharne
// 1971, Fried 1972): with K the sum of K_e and M that of any non-negative M_e, x'Kx <= max_e(w_e^2) x'Mx for all x,
// where w_e^2 is the largest eigenvalue of K_e x = w^2 M_e x. The lumped mass of a node is split among its elements in
// proportion to their stiffness (sums of absolute rows): beside a jump of stiffness this bound is closer than with the
// mass that each element brings. By rows: sums of absolute rows of K.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../fe/bulk_model.hpp"
#include "../fe/elements.hpp"
#include "../soe/lapack.hpp"
#include "mesh_rates.hpp"
#include "mesh_stability.hpp"

namespace cairn {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Largest eigenvalue of a symmetric matrix (n, n), which is lost; infinity: it was not found.
double largest_of(int n, std::vector<double>& a, std::vector<double>& eigenvalues, std::vector<double>& work) {
  const int size = 3 * n;
  int info = 0;
  eigenvalues.resize(std::size_t(n));
  work.resize(std::size_t(size));
  dsyev_("N", "L", &n, a.data(), &n, eigenvalues.data(), work.data(), &size, &info, 1, 1);
  return info == 0 ? eigenvalues.back() : infinity;
}

// True if all eigenvalues of a symmetric matrix (n, n) are below a number: Cholesky factors of the difference exist.
bool all_below(int n, double number, const std::vector<double>& a, std::vector<double>& l) {
  l.resize(std::size_t(n * n));
  for (int j = 0; j < n; ++j) {
    double pivot = number - a[std::size_t(j * n + j)];
    for (int k = 0; k < j; ++k) pivot -= l[std::size_t(j * n + k)] * l[std::size_t(j * n + k)];
    if (!(pivot > 8 * std::numeric_limits<double>::epsilon() * number)) return false;
    const double root = l[std::size_t(j * n + j)] = std::sqrt(pivot);
    for (int i = j + 1; i < n; ++i) {
      double sum = -a[std::size_t(j * n + i)];
      for (int k = 0; k < j; ++k) sum -= l[std::size_t(i * n + k)] * l[std::size_t(j * n + k)];
      l[std::size_t(i * n + j)] = sum / root;
    }
  }
  return true;
}

// Calls use(dofs of the cell, numbers of its dofs, K_e) for each linear cell.
template <class Use>
void each_elastic(const MeshModel& m, Use&& use) {
  std::vector<double> x, stiffness, mass;
  std::vector<std::int32_t> dof;
  for (const ElasticCells& c : m.cells) {
    const ElementInfo& e = *c.element;
    const ElementShape shape(e);
    const int dofs = m.dim * e.nodes;
    x.resize(std::size_t(dofs));
    dof.resize(std::size_t(dofs));
    stiffness.resize(std::size_t(dofs * dofs));
    mass.resize(stiffness.size());
    for (std::size_t first = 0; first < c.node.size(); first += std::size_t(e.nodes)) {
      for (int i = 0; i < dofs; ++i) {
        dof[std::size_t(i)] = m.dim * c.node[first + std::size_t(i / m.dim)] + i % m.dim;
        x[std::size_t(i)] = m.reference[std::size_t(dof[std::size_t(i)])];
      }
      std::int32_t wrong = 0;
      cairn_elastic_matrices(m.dim, e.nodes, e.points, shape.value.data(), shape.gradient.data(), shape.weight.data(),
                             1, x.data(), 1, c.elasticity.data(), stiffness.data(), mass.data(), &wrong);
      use(dofs, dof.data(), stiffness.data());
    }
  }
}

// The same of a material of solids, by its tangent at displacements `at` (null: none): that of a body whose cells have
// no node in common. False: it is not known there.
template <class Use>
bool each_solid(const MeshModel& m, const double* at, Use&& use) {
  const BulkModel& whole = *m.bulk->solid();
  std::vector<BulkCells> cells = whole.cells();
  std::vector<double> place;
  std::vector<std::int32_t> unknown;
  std::vector<std::int64_t> start{0};
  std::int32_t next = 0;
  for (BulkCells& c : cells)
    for (std::size_t i = 0; i < c.node.size(); ++i) {
      for (int k = 0; k < m.dim; ++k) {
        place.push_back(whole.place()[std::size_t(m.dim * c.node[i] + k)]);
        unknown.push_back(m.dim * next + k);
      }
      c.node[i] = next++;
      if ((i + 1) % std::size_t(c.element->nodes) == 0) start.push_back(std::int64_t(unknown.size()));
    }
  const SparseMatrix pattern = lower_pattern(std::int64_t(place.size()), start, unknown);
  std::vector<double> moved(place.size(), 0.0), force(place.size()), value(pattern.row.size(), 0.0), stiffness;
  std::size_t to = 0;
  for (const BulkCells& c : whole.cells())
    for (std::size_t i = 0; i < c.node.size() && at; ++i)
      for (int k = 0; k < m.dim; ++k) moved[to++] = at[std::size_t(m.dim * c.node[i] + k)];
  BulkModel apart(m.dim, std::move(place), std::move(cells));
  apart.fit(pattern);
  if (at) apart.take_history(whole.history());
  if (const BulkResult found = apart.evaluate(moved.data(), infinity, 1, force.data(), value.data()); !found.ok())
    return false;
  std::size_t cell = 0;
  std::vector<std::int32_t> dof;
  for (const BulkCells& c : whole.cells())
    for (std::size_t first = 0; first < c.node.size(); first += std::size_t(c.element->nodes), ++cell) {
      const int dofs = m.dim * c.element->nodes;
      const std::int32_t base = unknown[std::size_t(start[cell])];
      stiffness.assign(std::size_t(dofs * dofs), 0.0);
      dof.resize(std::size_t(dofs));
      for (int j = 0; j < dofs; ++j) {
        dof[std::size_t(j)] = m.dim * c.node[first + std::size_t(j / m.dim)] + j % m.dim;
        for (std::int64_t e = pattern.start[std::size_t(base + j)]; e < pattern.start[std::size_t(base + j) + 1]; ++e) {
          const int i = pattern.row[std::size_t(e)] - base;
          stiffness[std::size_t(j * dofs + i)] = stiffness[std::size_t(i * dofs + j)] = value[std::size_t(e)];
        }
      }
      use(dofs, dof.data(), stiffness.data());
    }
  return true;
}

template <class Use>
bool each_cell(const MeshModel& m, const double* at, Use&& use) {
  if (m.bulk) return m.bulk->solid() && each_solid(m, at, use);
  each_elastic(m, use);
  return !m.cells.empty();
}

} // namespace

// Bound of omega^2 by elements [1/s2]; infinity where element matrices are not known.
double MeshStability::element_bound(const std::vector<double>& mass, double slack) const {
  const std::size_t n = mass.size();
  if (model_.bulk ? !model_.bulk->solid() : model_.cells.empty()) return infinity;
  std::vector<double> hold(n, 0.0), diagonal(n, 0.0), a, l, eigenvalues, work, root;
  const auto free = [&](std::int32_t dof) { return !model_.held[std::size_t(dof)]; };
  const auto row = [&](int dofs, const std::int32_t* dof, const double* k, int i) {
    double sum = 0;
    for (int j = 0; j < dofs; ++j)
      if (free(dof[j])) sum += std::abs(k[j * dofs + i]);
    return sum;
  };
  const bool known = each_cell(model_, seen_at_, [&](int dofs, const std::int32_t* dof, const double* k) {
    for (int i = 0; i < dofs; ++i) {
      hold[std::size_t(dof[i])] += row(dofs, dof, k, i);
      diagonal[std::size_t(dof[i])] += k[i * dofs + i];
    }
  });
  if (!known) return infinity;
  const double largest = *std::max_element(diagonal.begin(), diagonal.end());
  for (std::size_t i = 0; i < n && !model_.bulk; ++i) // matrices may be others than those of the cells
    if (std::abs(diagonal[i] - matrices_.on_diagonal(model_.stiffness.value, std::int64_t(i))) > 1e-9 * largest)
      return infinity;
  std::vector<int> kept;
  double square = 0;
  bool finite = true;
  each_cell(model_, seen_at_, [&](int dofs, const std::int32_t* dof, const double* k) {
    root.clear();
    kept.clear();
    for (int i = 0; i < dofs; ++i) {
      const double own = free(dof[i]) ? row(dofs, dof, k, i) : 0;
      if (!(own > 0)) continue; // nothing pulls it
      kept.push_back(i);
      root.push_back(std::sqrt(hold[std::size_t(dof[i])] / (own * mass[std::size_t(dof[i])])));
    }
    const int m = int(kept.size());
    a.resize(std::size_t(m * m));
    for (int j = 0; j < m; ++j)
      for (int i = 0; i < m; ++i) {
        a[std::size_t(j * m + i)] =
            root[std::size_t(i)] * root[std::size_t(j)] * k[kept[std::size_t(j)] * dofs + kept[std::size_t(i)]];
        finite = finite && std::isfinite(a[std::size_t(j * m + i)]);
      }
    if (m == 0 || !finite || all_below(m, slack * square, a, l)) return;
    square = std::max(square, largest_of(m, a, eigenvalues, work));
  });
  return finite ? slack * square : infinity;
}

// No eigenvalue of M^-1 A is above the largest sum of a row of |M^-1 A|, scaled by any positive numbers (Collatz 1942,
// Wielandt 1950): by ones that make it small, as the power method finds them.
double MeshStability::row_bound(const SparseMatrix& a, const std::vector<double>& mass) const {
  const std::size_t n = mass.size();
  std::vector<double> x(n, 1.0), y(n);
  double bound = infinity;
  constexpr int passes = 24; // the bound is then within some percent of its limit
  for (int pass = 0; pass < passes; ++pass) {
    std::fill(y.begin(), y.end(), 0.0);
    for (std::int64_t column = 0; column < a.n; ++column)
      for (std::int64_t e = a.start[std::size_t(column)]; e < a.start[std::size_t(column) + 1]; ++e) {
        const auto i = std::size_t(a.row[std::size_t(e)]), j = std::size_t(column);
        if (model_.held[i] || model_.held[j]) continue;
        const double size = std::abs(a.value[std::size_t(e)]);
        y[i] += size * x[j];
        if (i != j) y[j] += size * x[i];
      }
    double largest = 0, greatest = 0;
    for (std::size_t i = 0; i < n; ++i) {
      y[i] /= mass[i];
      if (!std::isfinite(y[i])) return infinity;
      largest = std::max(largest, y[i] / x[i]);
      greatest = std::max(greatest, y[i]);
    }
    bound = std::min(bound, largest);
    if (!(greatest > 0)) break;
    for (std::size_t i = 0; i < n; ++i) x[i] = std::max(0.5 * (x[i] + y[i] / greatest), 1e-12); // positive, at least
  }
  return bound * (1 + 1e-12);
}

FrequencyBound MeshStability::frequency_bound(bool by_elements, double slack) const {
  FrequencyBound found;
  if (!matrices_.diagonal_mass() || model_.make_solver) return found;
  const auto n = std::size_t(model_.dofs());
  std::vector<double> mass(n);
  for (std::size_t i = 0; i < n; ++i) mass[i] = matrices_.on_diagonal(model_.mass.value, std::int64_t(i));
  const double by_rows = row_bound(model_.stiffness, mass);
  found.omega = std::sqrt(by_elements ? std::min(element_bound(mass, slack), by_rows) : by_rows);
  const double of_modes =
      model_.mode_rates.empty() ? 0 : *std::max_element(model_.mode_rates.begin(), model_.mode_rates.end());
  SparseMatrix rates = model_.mass;
  rates.value = rate_values(model_);
  found.rate = (rates.value.empty() ? 0 : row_bound(rates, mass)) + of_modes;
  return found;
}

} // namespace cairn
