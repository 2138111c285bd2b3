#include "turning_damping.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "bulk_model.hpp"

namespace cairn {
namespace {

using Matrix3 = double[3][3];

bool invert(int n, const Matrix3& a, Matrix3& out) {
  if (n == 1) {
    out[0][0] = 1 / a[0][0];
    return a[0][0] > 0;
  }
  if (n == 2) {
    const double determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    out[0][0] = a[1][1] / determinant;
    out[1][1] = a[0][0] / determinant;
    out[0][1] = -a[0][1] / determinant;
    out[1][0] = -a[1][0] / determinant;
    return std::abs(determinant) > 0;
  }
  double determinant = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      out[j][i] = a[i1][j1] * a[i2][j2] - a[i1][j2] * a[i2][j1];
      if (i == 0) determinant += a[0][j] * out[j][0];
    }
  for (auto& row : out)
    for (double& x : row) x /= determinant;
  return std::abs(determinant) > 0;
}

// The rotation of a mean gradient of deformation: the polar one, by Newton's method (Higham 1986).
void rotation_of(int dim, const Matrix3& f, Matrix3& r) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) r[i][j] = i == j;
  if (dim == 2) {
    const double c = f[0][0] + f[1][1], s = f[1][0] - f[0][1], size = std::hypot(c, s);
    if (!(size > 0)) return;
    r[0][0] = r[1][1] = c / size;
    r[1][0] = s / size;
    r[0][1] = -s / size;
    return;
  }
  Matrix3 inverse;
  std::copy_n(&f[0][0], 9, &r[0][0]);
  for (int pass = 0; pass < 30; ++pass) {
    if (!invert(3, r, inverse)) break;
    double change = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const double next = (r[i][j] + inverse[j][i]) / 2;
        inverse[j][i] = next - r[i][j];
        change = std::max(change, std::abs(inverse[j][i]));
      }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) r[i][j] += inverse[j][i];
    if (change < 1e-15) break;
  }
}

// The stiffness of each cell at the start, by a mesh of the same cells that share no nodes.
std::vector<double> cell_stiffness(int dim, const std::vector<double>& place, BulkCells cells) {
  const auto dofs = std::size_t(dim * cells.element->nodes);
  std::vector<double> apart(std::size_t(dim) * cells.node.size());
  for (std::size_t k = 0; k < cells.node.size(); ++k) {
    std::copy_n(&place[std::size_t(dim * cells.node[k])], dim, &apart[std::size_t(dim) * k]);
    cells.node[k] = std::int32_t(k);
  }
  SparseMatrix lower;
  lower.n = std::int64_t(apart.size());
  for (std::size_t first = 0; first < apart.size(); first += dofs)
    for (std::size_t j = 0; j < dofs; ++j) {
      for (std::size_t i = j; i < dofs; ++i) lower.row.push_back(std::int32_t(first + i));
      lower.start.push_back(std::int64_t(lower.row.size()));
    }
  lower.value.assign(lower.row.size(), 0.0);
  cells.damping = 0;
  const std::size_t count = std::size_t(cells.count());
  BulkModel model(dim, apart, {std::move(cells)});
  model.fit(lower);
  std::vector<double> force(apart.size(), 0.0);
  std::fill(apart.begin(), apart.end(), 0.0);
  const BulkResult found =
      model.evaluate(apart.data(), std::numeric_limits<double>::infinity(), 1, force.data(), lower.value.data());
  if (!found.ok()) throw Error(model.describe(found) + " at the start");
  std::vector<double> full(dofs * dofs * count);
  std::size_t at = 0;
  for (std::size_t cell = 0; cell < count; ++cell)
    for (std::size_t j = 0; j < dofs; ++j)
      for (std::size_t i = j; i < dofs; ++i, ++at)
        full[(cell * dofs + j) * dofs + i] = full[(cell * dofs + i) * dofs + j] = lower.value[at];
  return full;
}

} // namespace

bool TurningDamping::is_of(const BulkCells& cells) {
  return cells.damping > 0 && cells.kinematics != Kinematics::small &&
         !(cells.element->dim == 2 && cells.plane == Plane::axisymmetric);
}

TurningDamping::TurningDamping(const BulkModel& model, const SparseMatrix& damping)
    : dim_(model.cells().front().element->dim), place_(model.place()), still_(damping.value) {
  std::vector<double> taken(still_.size(), 0.0);
  for (const BulkCells& c : model.cells()) {
    if (!is_of(c)) continue;
    Cells& cells = cells_.emplace_back();
    cells.nodes = c.element->nodes;
    cells.node = c.node;
    cells.value = cell_stiffness(dim_, place_, c);
    for (double& k : cells.value) k *= c.damping;
    const int dofs = dim_ * cells.nodes;
    for (std::int64_t cell = 0; cell < c.count(); ++cell) {
      const std::int32_t* node = &cells.node[std::size_t(cell * cells.nodes)];
      for (int q = 0; q < dofs; ++q) {
        const std::int32_t column = dim_ * node[q / dim_] + q % dim_;
        const auto first = damping.row.begin() + damping.start[std::size_t(column)],
                   last = damping.row.begin() + damping.start[std::size_t(column) + 1];
        for (int a = 0; a < cells.nodes; ++a) {
          const std::int32_t row = node[a] == node[q / dim_] ? column : dim_ * node[a];
          cells.entry.push_back(node[a] < node[q / dim_] ? -1
                                                         : std::lower_bound(first, last, row) - damping.row.begin());
        }
      }
      each_entry(cells, cell, [&](std::int64_t entry, int p, int q) {
        taken[std::size_t(entry)] += cells.value[std::size_t((cell * dofs + q) * dofs + p)];
      });
    }
  }
  constexpr double rounding = 1e-13;
  for (std::size_t e = 0; e < still_.size(); ++e) {
    const double left = still_[e] - taken[e];
    still_[e] = std::abs(left) > rounding * (std::abs(still_[e]) + std::abs(taken[e])) ? left : 0;
  }
}

// Calls use(entry, p, q) for dofs p, q of a cell whose entry is in the lower triangle.
template <class Use>
void TurningDamping::each_entry(const Cells& cells, std::int64_t cell, Use&& use) const {
  const int dofs = dim_ * cells.nodes;
  const std::int32_t* node = &cells.node[std::size_t(cell * cells.nodes)];
  for (int q = 0; q < dofs; ++q)
    for (int a = 0; a < cells.nodes; ++a) {
      const std::int64_t entry = cells.entry[std::size_t((cell * dofs + q) * cells.nodes + a)];
      if (entry < 0) continue;
      const int from = node[a] == node[q / dim_] ? q % dim_ : 0;
      for (int i = from; i < dim_; ++i) use(entry + i - from, dim_ * a + i, q);
    }
}

void TurningDamping::at(const double* place, SparseMatrix& damping) const {
  damping.value = still_;
  const int turns = dim_ == 2 ? 1 : 3;
  std::vector<double> now, ways, turned, moved, back; // of a cell
  for (const Cells& cells : cells_) {
    const int dofs = dim_ * cells.nodes;
    now.resize(std::size_t(dofs));
    turned.resize(std::size_t(dofs * dofs));
    for (auto* of : {&ways, &moved, &back}) of->resize(std::size_t(dofs * turns));
    const std::int64_t count = std::int64_t(cells.node.size()) / cells.nodes;
    for (std::int64_t cell = 0; cell < count; ++cell) {
      const std::int32_t* node = &cells.node[std::size_t(cell * cells.nodes)];
      double middle[3] = {0, 0, 0}, start[3] = {0, 0, 0};
      for (int a = 0; a < cells.nodes; ++a)
        for (int k = 0; k < dim_; ++k) {
          middle[k] += place[dim_ * node[a] + k] / cells.nodes;
          start[k] += place_[std::size_t(dim_ * node[a] + k)] / cells.nodes;
        }
      Matrix3 both = {}, square = {}, inverse = {}, f = {}, r;
      for (int a = 0; a < cells.nodes; ++a)
        for (int i = 0; i < dim_; ++i) {
          now[std::size_t(dim_ * a + i)] = place[dim_ * node[a] + i] - middle[i];
          for (int j = 0; j < dim_; ++j) {
            const double x = place_[std::size_t(dim_ * node[a] + j)] - start[j];
            both[i][j] += now[std::size_t(dim_ * a + i)] * x;
            square[i][j] += (place_[std::size_t(dim_ * node[a] + i)] - start[i]) * x;
          }
        }
      invert(dim_, square, inverse);
      for (int i = 0; i < dim_; ++i)
        for (int j = 0; j < dim_; ++j)
          for (int k = 0; k < dim_; ++k) f[i][j] += both[i][k] * inverse[k][j];
      rotation_of(dim_, f, r);
      const double* value = &cells.value[std::size_t(cell * dofs * dofs)];
      for (int a = 0; a < cells.nodes; ++a)
        for (int b = 0; b < cells.nodes; ++b) { // R K R' of two nodes
          double half[3][3] = {};
          for (int i = 0; i < dim_; ++i)
            for (int j = 0; j < dim_; ++j)
              for (int k = 0; k < dim_; ++k) half[i][j] += r[i][k] * value[(dim_ * a + k) * dofs + dim_ * b + j];
          for (int i = 0; i < dim_; ++i)
            for (int j = 0; j < dim_; ++j) {
              double sum = 0;
              for (int k = 0; k < dim_; ++k) sum += half[i][k] * r[j][k];
              turned[std::size_t((dim_ * a + i) * dofs + dim_ * b + j)] = sum;
            }
        }
      // velocities less the rotation nearest to them: P K P with P = 1 - G (G'G)^-1 G', G the rotations
      std::fill(ways.begin(), ways.end(), 0.0);
      for (int a = 0; a < cells.nodes; ++a) {
        const double* x = &now[std::size_t(dim_ * a)];
        double* g = &ways[std::size_t(dim_ * a * turns)];
        if (dim_ == 2) {
          g[0] = -x[1];
          g[1] = x[0];
          continue;
        }
        for (int k = 0; k < 3; ++k) { // e_k x r
          g[3 * ((k + 1) % 3) + k] = -x[(k + 2) % 3];
          g[3 * ((k + 2) % 3) + k] = x[(k + 1) % 3];
        }
      }
      Matrix3 gram = {}, solved = {}, inner = {};
      std::fill(moved.begin(), moved.end(), 0.0);
      std::fill(back.begin(), back.end(), 0.0);
      for (int p = 0; p < dofs; ++p)
        for (int i = 0; i < turns; ++i)
          for (int j = 0; j < turns; ++j)
            gram[i][j] += ways[std::size_t(p * turns + i)] * ways[std::size_t(p * turns + j)];
      invert(turns, gram, solved);
      for (int p = 0; p < dofs; ++p)
        for (int i = 0; i < turns; ++i) {
          for (int q = 0; q < dofs; ++q)
            moved[std::size_t(p * turns + i)] += turned[std::size_t(p * dofs + q)] * ways[std::size_t(q * turns + i)];
          for (int j = 0; j < turns; ++j)
            back[std::size_t(p * turns + i)] += ways[std::size_t(p * turns + j)] * solved[j][i];
        }
      for (int p = 0; p < dofs; ++p)
        for (int i = 0; i < turns; ++i)
          for (int j = 0; j < turns; ++j)
            inner[i][j] += ways[std::size_t(p * turns + i)] * moved[std::size_t(p * turns + j)];
      each_entry(cells, cell, [&](std::int64_t entry, int p, int q) {
        double sum = turned[std::size_t(p * dofs + q)];
        for (int i = 0; i < turns; ++i) {
          const double bp = back[std::size_t(p * turns + i)], bq = back[std::size_t(q * turns + i)];
          sum -= bp * moved[std::size_t(q * turns + i)] + moved[std::size_t(p * turns + i)] * bq;
          for (int j = 0; j < turns; ++j) sum += bp * inner[i][j] * back[std::size_t(q * turns + j)];
        }
        damping.value[std::size_t(entry)] += sum;
      });
    }
  }
}

} // namespace cairn
