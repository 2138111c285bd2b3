#include "multigrid.hpp"

#include <algorithm>
#include <cmath>

#include "../base/vectors.hpp"

namespace cairn {
namespace {

constexpr std::int64_t coarsest_most = 200; // equations that are factorised
// A row whose leak is so much more than its conductances is left to the smoother.
constexpr double mostly_leak = 5;

// One sweep of Gauss and Seidel, forward from x = 0 or backward from the x that is there.
void smooth_forward(const LaplacianMatrix& a, const double* b, double* x) {
  std::fill(x, x + a.n, 0.0);
  for (std::int64_t i = 0; i < a.n; ++i) {
    double sum = b[i];
    for (std::int64_t k = a.start[i]; k < a.start[i + 1]; ++k)
      if (a.column[k] < i) sum += a.conductance[k] * x[a.column[k]];
    x[i] = sum / a.diagonal[i];
  }
}

void smooth_backward(const LaplacianMatrix& a, const double* b, double* x) {
  for (std::int64_t i = a.n - 1; i >= 0; --i) {
    double sum = b[i];
    for (std::int64_t k = a.start[i]; k < a.start[i + 1]; ++k) sum += a.conductance[k] * x[a.column[k]];
    x[i] = sum / a.diagonal[i];
  }
}

} // namespace

void LaplacianMatrix::multiply(const double* x, double* out) const {
  for (std::int64_t i = 0; i < n; ++i) {
    double sum = leak[i] * x[i];
    for (std::int64_t k = start[i]; k < start[i + 1]; ++k) sum += conductance[k] * (x[i] - x[column[k]]);
    out[i] = sum;
  }
}

void LaplacianMatrix::sum_diagonal() {
  diagonal.resize(std::size_t(n));
  for (std::int64_t i = 0; i < n; ++i) {
    double sum = leak[i];
    for (std::int64_t k = start[i]; k < start[i + 1]; ++k) sum += conductance[k];
    diagonal[i] = sum;
  }
}

// Pairs unknowns along the strongest conductances first, then each remaining unknown with its strongest neighbour.
// Returns the number of aggregates.
std::int64_t Multigrid::pair(const LaplacianMatrix& a, std::vector<std::int32_t>& aggregate, bool leave_out) {
  aggregate.assign(std::size_t(a.n), -2);
  struct Edge {
    double conductance;
    std::int32_t from, to;
  };
  std::vector<Edge> edges;
  edges.reserve(a.column.size() / 2);
  for (std::int64_t i = 0; i < a.n; ++i) {
    if (leave_out && a.leak[i] >= mostly_leak * (a.diagonal[i] - a.leak[i])) aggregate[i] = -1;
    for (std::int64_t k = a.start[i]; k < a.start[i + 1]; ++k)
      if (a.column[k] > i && a.conductance[k] > 0) edges.push_back({a.conductance[k], std::int32_t(i), a.column[k]});
  }
  std::stable_sort(edges.begin(), edges.end(),
                   [](const Edge& one, const Edge& other) { return one.conductance > other.conductance; });
  std::int64_t count = 0;
  for (const Edge& e : edges)
    if (aggregate[e.from] == -2 && aggregate[e.to] == -2) {
      aggregate[e.from] = aggregate[e.to] = std::int32_t(count);
      ++count;
    }
  const std::int64_t pairs = count;
  for (const Edge& e : edges) { // strongest first, so that each goes where it is joined most
    for (const auto& [one, other] : {std::pair(e.from, e.to), std::pair(e.to, e.from)})
      if (aggregate[one] == -2 && aggregate[other] >= 0 && aggregate[other] < pairs) aggregate[one] = aggregate[other];
  }
  for (std::int64_t i = 0; i < a.n; ++i)
    if (aggregate[i] == -2) aggregate[i] = std::int32_t(count++);
  return count;
}

// Sums of conductances between aggregates; those to rows that are left out leak, as if these were at zero.
void Multigrid::contract(const LaplacianMatrix& a, const std::vector<std::int32_t>& aggregate, std::int64_t count,
                         LaplacianMatrix& out) {
  std::vector<std::int64_t> first(std::size_t(count) + 1, 0);
  for (std::int64_t i = 0; i < a.n; ++i)
    if (aggregate[i] >= 0) ++first[aggregate[i] + 1];
  for (std::int64_t k = 0; k < count; ++k) first[k + 1] += first[k];
  std::vector<std::int32_t> member;
  member.resize(std::size_t(first[count]));
  std::vector<std::int64_t> at(first.begin(), first.end() - 1);
  for (std::int64_t i = 0; i < a.n; ++i)
    if (aggregate[i] >= 0) member[at[aggregate[i]]++] = std::int32_t(i);
  out.n = count;
  out.start.assign(1, 0);
  out.column.clear();
  out.conductance.clear();
  out.leak.assign(std::size_t(count), 0.0);
  std::vector<std::int64_t> place(std::size_t(count), -1);
  for (std::int64_t k = 0; k < count; ++k) {
    const auto row = std::int64_t(out.column.size());
    for (std::int64_t m = first[k]; m < first[k + 1]; ++m) {
      const std::int32_t i = member[m];
      out.leak[k] += a.leak[i];
      for (std::int64_t e = a.start[i]; e < a.start[i + 1]; ++e) {
        const std::int32_t to = aggregate[a.column[e]];
        if (to == k) continue;
        if (to < 0) {
          out.leak[k] += a.conductance[e];
          continue;
        }
        if (place[to] < row) {
          place[to] = std::int64_t(out.column.size());
          out.column.push_back(to);
          out.conductance.push_back(0);
        }
        out.conductance[place[to]] += a.conductance[e];
      }
    }
    out.start.push_back(std::int64_t(out.column.size()));
  }
  out.sum_diagonal();
}

void Multigrid::prepare(const LaplacianMatrix& matrix) {
  used_ = 0;
  const auto next = [&]() -> Level& {
    if (used_ == levels_.size()) levels_.push_back(std::make_unique<Level>());
    return *levels_[used_++];
  };
  next().matrix = &matrix;
  LaplacianMatrix half;
  std::vector<std::int32_t> once, twice;
  while (levels_[used_ - 1]->matrix->n > coarsest_most) {
    Level& fine = *levels_[used_ - 1];
    const LaplacianMatrix& a = *fine.matrix;
    const std::int64_t pairs = pair(a, once, true);
    contract(a, once, pairs, half);
    const std::int64_t fours = pair(half, twice, false);
    if (fours == 0 || fours > a.n * 4 / 5) break;
    fine.aggregate.resize(std::size_t(a.n));
    for (std::int64_t i = 0; i < a.n; ++i) fine.aggregate[i] = once[i] < 0 ? -1 : twice[once[i]];
    Level& coarse = next();
    contract(half, twice, fours, coarse.own);
    coarse.matrix = &coarse.own;
  }
  for (std::size_t l = 0; l < used_; ++l) {
    Level& level = *levels_[l];
    for (auto* v : {&level.r, &level.x, &level.c, &level.v, &level.d, &level.w, &level.s})
      v->resize(std::size_t(level.matrix->n));
  }
  for (auto* v : {&r_, &z_, &p_, &q_, &z_before_}) v->resize(std::size_t(matrix.n));
  factor_coarsest();
}

void Multigrid::factor_coarsest() {
  const LaplacianMatrix& a = *levels_[used_ - 1]->matrix;
  SparseMatrix lower;
  lower.n = a.n;
  for (std::int64_t i = 0; i < a.n; ++i) {
    std::vector<std::pair<std::int32_t, double>> below;
    for (std::int64_t k = a.start[i]; k < a.start[i + 1]; ++k)
      if (a.column[k] > i) below.emplace_back(a.column[k], -a.conductance[k]);
    std::sort(below.begin(), below.end());
    lower.row.push_back(std::int32_t(i));
    lower.value.push_back(a.diagonal[i]);
    for (const auto& [row, value] : below) {
      lower.row.push_back(row);
      lower.value.push_back(value);
    }
    lower.start.push_back(std::int64_t(lower.row.size()));
  }
  coarsest_ = Soe::make(lower);
  factored_ = bool(coarsest_->factor(lower.value.data()));
}

// Where conductances are so far apart that the factors fail, sweeps take their place: these weigh no sums.
void Multigrid::solve_coarsest(Level& level) {
  const LaplacianMatrix& a = *level.matrix;
  if (factored_) {
    std::copy(level.r.begin(), level.r.begin() + a.n, level.x.begin());
    coarsest_->solve(level.x.data());
    return;
  }
  smooth_forward(a, level.r.data(), level.x.data());
  for (int k = 0; k < 20; ++k) smooth_backward(a, level.r.data(), level.x.data());
}

void Multigrid::cycle(std::size_t l, const double* r, double* z) {
  Level& level = *levels_[l];
  const LaplacianMatrix& a = *level.matrix;
  if (l + 1 == used_) {
    if (r != level.r.data()) std::copy(r, r + a.n, level.r.begin());
    solve_coarsest(level);
    if (z != level.x.data()) std::copy(level.x.begin(), level.x.begin() + a.n, z);
    return;
  }
  smooth_forward(a, r, z);
  a.multiply(z, level.s.data());
  Level& coarse = *levels_[l + 1];
  std::fill(coarse.r.begin(), coarse.r.end(), 0.0);
  for (std::int64_t i = 0; i < a.n; ++i)
    if (level.aggregate[i] >= 0) coarse.r[level.aggregate[i]] += r[i] - level.s[i];
  kcycle(l + 1);
  for (std::int64_t i = 0; i < a.n; ++i)
    if (level.aggregate[i] >= 0) z[i] += coarse.x[level.aggregate[i]];
  smooth_backward(a, r, z);
}

// Up to two steps of conjugate gradients on a coarse level, each with a cycle.
void Multigrid::kcycle(std::size_t l) {
  Level& level = *levels_[l];
  if (l + 1 == used_) return solve_coarsest(level);
  const LaplacianMatrix& a = *level.matrix;
  const std::int64_t n = a.n;
  const double before = dot(level.r.data(), level.r.data(), n);
  cycle(l, level.r.data(), level.c.data());
  a.multiply(level.c.data(), level.v.data());
  const double rho = dot(level.c.data(), level.v.data(), n), alpha = dot(level.c.data(), level.r.data(), n);
  if (!(rho > 0)) {
    std::copy(level.c.begin(), level.c.end(), level.x.begin());
    return;
  }
  for (std::int64_t i = 0; i < n; ++i) level.r[i] -= alpha / rho * level.v[i];
  for (std::int64_t i = 0; i < n; ++i) level.x[i] = alpha / rho * level.c[i];
  if (dot(level.r.data(), level.r.data(), n) <= 0.0625 * before) return;
  cycle(l, level.r.data(), level.d.data());
  a.multiply(level.d.data(), level.w.data());
  const double gamma = dot(level.d.data(), level.v.data(), n), beta = dot(level.d.data(), level.w.data(), n),
               second = dot(level.d.data(), level.r.data(), n), rho2 = beta - gamma * gamma / rho;
  if (!(rho2 > 0)) return;
  for (std::int64_t i = 0; i < n; ++i)
    level.x[i] += second / rho2 * level.d[i] - gamma * second / (rho * rho2) * level.c[i];
}

// Flexible conjugate gradients: a cycle is no fixed matrix.
int Multigrid::solve(const double* b, double* x, double reduction, int max_iterations) {
  const LaplacianMatrix& a = *levels_[0]->matrix;
  const std::int64_t n = a.n;
  std::fill(x, x + n, 0.0);
  std::copy(b, b + n, r_.begin());
  const double first = dot(b, b, n);
  if (!(first > 0)) return 0;
  double rho_before = 1;
  int k = 0;
  while (k < max_iterations) {
    cycle(0, r_.data(), z_.data());
    double beta = 0;
    if (k > 0) beta = -dot(z_.data(), q_.data(), n) / rho_before;
    for (std::int64_t i = 0; i < n; ++i) p_[i] = z_[i] + beta * (k > 0 ? p_[i] : 0);
    a.multiply(p_.data(), q_.data());
    const double rho = dot(p_.data(), q_.data(), n);
    ++k;
    if (!(rho > 0) || !std::isfinite(rho)) break;
    const double step = dot(p_.data(), r_.data(), n) / rho;
    for (std::int64_t i = 0; i < n; ++i) x[i] += step * p_[i];
    for (std::int64_t i = 0; i < n; ++i) r_[i] -= step * q_[i];
    rho_before = rho;
    if (dot(r_.data(), r_.data(), n) <= reduction * reduction * first) break;
  }
  return k;
}

std::int64_t Multigrid::bytes() const {
  std::int64_t sum = 8 * std::int64_t(5 * r_.capacity());
  for (const auto& l : levels_)
    sum += std::int64_t(8 * (7 * l->r.capacity() + l->own.conductance.capacity() + 2 * l->own.leak.capacity()) +
                        4 * (l->own.column.capacity() + l->aggregate.capacity()));
  return sum;
}

} // namespace cairn
