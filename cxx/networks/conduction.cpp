#include "conduction.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace cairn {
namespace {

// Sources of a component that nothing anchors add up to nothing, up to this share of their sizes.
constexpr double unbalanced = 1e-10;
enum Kind : std::uint8_t { floating, open, anchored, grounded };

std::int32_t root_of(std::vector<std::int32_t>& parent, std::int32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

// The smaller number leads, so that components do not depend on the order of branches.
void join(std::vector<std::int32_t>& parent, std::int32_t a, std::int32_t b) {
  a = root_of(parent, a);
  b = root_of(parent, b);
  if (a != b) parent[std::max(a, b)] = std::min(a, b);
}

} // namespace

bool Conduction::joins(const ConductionGraph& g, std::int64_t k) const {
  return std::isfinite(g.conductance[k]) && std::abs(g.conductance[k]) > 0 && of_[g.a[k]] != of_[g.b[k]];
}

// Merges unknowns joined by perfect conductors.
void Conduction::merge(const ConductionGraph& g) {
  of_.resize(std::size_t(g.n));
  std::iota(of_.begin(), of_.end(), 0);
  merged_ = negative_ = false;
  for (std::int64_t k = 0; k < g.branches; ++k) {
    if (g.conductance[k] < 0) negative_ = true;
    if (!std::isinf(g.conductance[k])) continue;
    merged_ = true;
    join(of_, g.a[k], g.b[k]);
  }
  for (std::int64_t i = 0; merged_ && i < g.n; ++i) of_[i] = root_of(of_, std::int32_t(i));
}

void Conduction::find_components(const ConductionGraph& g, const double* source, const double* x,
                                 ConductionReport& report) {
  const auto n = std::size_t(g.n);
  parent_ = of_;
  for (std::int64_t k = 0; k < g.branches; ++k)
    if (joins(g, k)) join(parent_, of_[g.a[k]], of_[g.b[k]]);
  component_.resize(n);
  for (std::size_t i = 0; i < n; ++i) component_[i] = root_of(parent_, std::int32_t(i));
  for (auto* v : {&source_, &given_, &total_, &size_, &scale_}) v->assign(n, 0.0);
  kind_.assign(n, floating);
  constexpr double nothing = std::numeric_limits<double>::quiet_NaN();
  std::fill(given_.begin(), given_.end(), nothing);
  for (std::size_t i = 0; i < n; ++i) {
    const std::int32_t m = of_[i], c = component_[i];
    source_[m] += source[i];
    total_[c] += source[i];
    size_[c] += std::abs(source[i]);
    if (g.held && g.held[i]) {
      if (std::isnan(given_[m])) given_[m] = x[i];
      if (given_[m] != x[i]) report.status = ConductionReport::not_finite; // two values, perfectly joined
      kind_[c] = anchored;
    }
    if (g.leak && g.leak[i] > 0) kind_[c] = anchored;
  }
  for (std::size_t i = 0; i < n; ++i) {
    const std::int32_t c = component_[i];
    if (std::size_t(c) == i) {
      if (kind_[c] != anchored && size_[c] > 0)
        kind_[c] = std::abs(total_[c]) <= unbalanced * size_[c] ? grounded : open;
      report.components += kind_[c] >= anchored;
      if (kind_[c] == grounded) given_[c] = 0;
    }
    report.floating += kind_[c] == floating;
    report.open += kind_[c] == open;
  }
}

// Equations of the unknowns that are sought, rows by rising columns, none twice.
void Conduction::lay_out(const ConductionGraph& g) {
  const auto n = std::size_t(g.n);
  equation_.assign(n, -1);
  row_unknown_.clear();
  for (std::size_t i = 0; i < n; ++i)
    if (std::size_t(of_[i]) == i && kind_[component_[i]] >= anchored && std::isnan(given_[i])) {
      equation_[i] = std::int32_t(row_unknown_.size());
      row_unknown_.push_back(std::int32_t(i));
    }
  LaplacianMatrix& m = matrix_;
  m.n = std::int64_t(row_unknown_.size());
  m.leak.assign(row_unknown_.size(), 0.0);
  std::vector<std::int64_t> first(row_unknown_.size() + 1, 0), at;
  const auto ends = [&](std::int64_t k, std::int32_t& a, std::int32_t& b) {
    a = equation_[of_[g.a[k]]];
    b = equation_[of_[g.b[k]]];
    return joins(g, k);
  };
  std::int32_t a, b;
  for (std::int64_t k = 0; k < g.branches; ++k) {
    if (!ends(k, a, b)) continue;
    if (a >= 0 && b >= 0) ++first[a + 1], ++first[b + 1];
    if (a >= 0 && b < 0) m.leak[a] += g.conductance[k];
    if (b >= 0 && a < 0) m.leak[b] += g.conductance[k];
  }
  for (std::size_t i = 0; i < n && g.leak; ++i)
    if (equation_[of_[i]] >= 0) m.leak[equation_[of_[i]]] += g.leak[i];
  for (std::size_t r = 0; r < row_unknown_.size(); ++r) first[r + 1] += first[r];
  at.assign(first.begin(), first.end() - 1);
  std::vector<std::int32_t> column(std::size_t(first.back()));
  std::vector<double> value(column.size());
  for (std::int64_t k = 0; k < g.branches; ++k) {
    if (!ends(k, a, b) || a < 0 || b < 0) continue;
    column[at[a]] = b;
    value[at[a]++] = g.conductance[k];
    column[at[b]] = a;
    value[at[b]++] = g.conductance[k];
  }
  // transposed, the rows of a symmetric matrix rise
  m.column.resize(column.size());
  m.conductance.resize(column.size());
  at.assign(first.begin(), first.end() - 1);
  for (std::int64_t r = 0; r < m.n; ++r)
    for (std::int64_t e = first[r]; e < first[r + 1]; ++e) {
      m.column[at[column[e]]] = std::int32_t(r);
      m.conductance[at[column[e]]++] = value[e];
    }
  m.start.assign(1, 0);
  std::int64_t to = 0;
  for (std::int64_t r = 0; r < m.n; ++r) {
    const std::int64_t begin = to;
    for (std::int64_t e = first[r]; e < first[r + 1]; ++e) {
      if (to > begin && m.column[to - 1] == m.column[e]) {
        m.conductance[to - 1] += m.conductance[e];
        continue;
      }
      m.column[to] = m.column[e];
      m.conductance[to++] = m.conductance[e];
    }
    m.start.push_back(to);
  }
  m.column.resize(std::size_t(to));
  m.conductance.resize(std::size_t(to));
  m.sum_diagonal();
}

// Residual at each unknown; returns the largest relative to the flow in its component.
double Conduction::residual(const ConductionGraph& g, const double* source) {
  const auto n = std::size_t(g.n);
  left_ = source_;
  through_.resize(n);
  for (std::size_t i = 0; i < n; ++i) through_[i] = std::abs(source_[i]);
  for (std::size_t i = 0; i < n && g.leak; ++i) {
    const std::int32_t m = of_[i];
    if (kind_[component_[i]] < anchored) continue;
    const double flow = g.leak[i] * (high_[m] + low_[m]);
    left_[m] -= flow;
    through_[m] += std::abs(flow);
  }
  for (std::int64_t k = 0; k < g.branches; ++k) {
    if (!joins(g, k) || kind_[component_[g.a[k]]] < anchored) continue;
    const std::int32_t a = of_[g.a[k]], b = of_[g.b[k]];
    const double flow = g.conductance[k] * difference(a, b);
    left_[a] -= flow;
    left_[b] += flow;
    through_[a] += std::abs(flow);
    through_[b] += std::abs(flow);
  }
  std::fill(scale_.begin(), scale_.end(), 0.0);
  for (std::size_t i = 0; i < n; ++i) scale_[component_[i]] = std::max(scale_[component_[i]], through_[i]);
  double worst = 0;
  for (std::size_t r = 0; r < row_unknown_.size(); ++r) {
    const std::int32_t i = row_unknown_[r];
    const double scale = scale_[component_[i]];
    rest_[r] = scale > 0 ? left_[i] / scale : 0;
    if (!std::isfinite(rest_[r])) return std::numeric_limits<double>::infinity();
    worst = std::max(worst, std::abs(rest_[r]));
  }
  (void)source;
  return worst;
}

// In two parts (Knuth 1969), so that differences keep what sums lose.
void Conduction::add(const double* change) {
  for (std::size_t r = 0; r < row_unknown_.size(); ++r) {
    const std::int32_t i = row_unknown_[r];
    const double d = change[r] * scale_[component_[i]], h = high_[i], s = h + d, back = s - h;
    const double l = low_[i] + ((h - (s - back)) + (d - back));
    high_[i] = s + l;
    low_[i] = l - (high_[i] - s);
  }
}

bool Conduction::factorise(ConductionReport& report) {
  SparseMatrix lower;
  lower.n = matrix_.n;
  lower.row.reserve(matrix_.column.size() / 2 + row_unknown_.size());
  for (std::int64_t i = 0; i < matrix_.n; ++i) {
    lower.row.push_back(std::int32_t(i));
    lower.value.push_back(matrix_.diagonal[i]);
    for (std::int64_t k = matrix_.start[i]; k < matrix_.start[i + 1]; ++k) {
      if (matrix_.column[k] < i) continue;
      lower.row.push_back(matrix_.column[k]);
      lower.value.push_back(-matrix_.conductance[k]);
    }
    lower.start.push_back(std::int64_t(lower.row.size()));
  }
  report.reused = soe_ && lower.start == pattern_.start && lower.row == pattern_.row;
  if (!report.reused) soe_ = Soe::make(lower);
  pattern_ = std::move(lower);
  ++report.factorisations;
  return bool(soe_->factor(pattern_.value.data()));
}

// False where factors fail or lose too much.
bool Conduction::refine_direct(const ConductionGraph& g, const double* source, const ConductionOptions& o,
                               ConductionReport& report) {
  report.method = "direct";
  if (!factorise(report)) return false;
  double before = std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < 12; ++pass) {
    report.residual = residual(g, source);
    if (report.residual <= 0 || !(report.residual < before / 2)) break;
    before = report.residual;
    change_ = rest_;
    soe_->solve(change_.data());
    add(change_.data());
  }
  return report.residual <= o.tolerance;
}

bool Conduction::refine_multigrid(const ConductionGraph& g, const double* source, const ConductionOptions& o,
                                  ConductionReport& report) {
  report.method = "multigrid";
  multigrid_.prepare(matrix_);
  change_.resize(row_unknown_.size());
  int stalls = 0;
  for (double before = std::numeric_limits<double>::infinity();; before = report.residual) {
    report.residual = residual(g, source);
    if (report.residual <= o.tolerance) return true;
    stalls += !(report.residual < before / 2);
    if (report.iterations >= o.max_iterations || stalls > 3 || !std::isfinite(report.residual)) return false;
    const double reduction = std::clamp(0.1 * o.tolerance / report.residual, 1e-9, 0.1);
    report.iterations +=
        multigrid_.solve(rest_.data(), change_.data(), reduction, int(o.max_iterations - report.iterations));
    add(change_.data());
  }
}

void Conduction::flows(const ConductionGraph& g, double* flow) const {
  for (std::int64_t k = 0; k < g.branches; ++k)
    flow[k] = joins(g, k) && kind_[component_[g.a[k]]] >= anchored
                  ? g.conductance[k] * difference(of_[g.a[k]], of_[g.b[k]])
                  : 0;
}

// Distributes flows over perfect conductors such that the balance closes at their ends.
void Conduction::share(const ConductionGraph& g, const double* source, double* flow) {
  std::vector<double> unit(std::size_t(g.branches), 0.0), lack(source, source + g.n), x(std::size_t(g.n), 0.0);
  std::vector<double> through(std::size_t(g.branches));
  for (std::int64_t k = 0; k < g.branches; ++k) {
    if (std::isinf(g.conductance[k])) unit[k] = 1;
    lack[g.a[k]] -= flow[k];
    lack[g.b[k]] += flow[k];
  }
  for (std::int64_t i = 0; i < g.n; ++i) {
    const std::int32_t m = of_[i];
    if (kind_[component_[i]] < anchored)
      lack[i] = 0;
    else if (g.leak)
      lack[i] -= g.leak[i] * (high_[m] + low_[m]);
  }
  // what a cluster keeps for itself, rounding but for its ground, goes to its first unknown
  std::vector<double> kept(std::size_t(g.n), 0.0);
  for (std::int64_t i = 0; i < g.n; ++i) kept[of_[i]] += lack[i];
  std::vector<std::uint8_t> held(g.held ? std::vector<std::uint8_t>(g.held, g.held + g.n)
                                        : std::vector<std::uint8_t>(std::size_t(g.n), 0));
  for (std::int64_t i = 0; i < g.n; ++i)
    if (of_[i] == i) lack[i] -= kept[i];
  if (!perfect_) perfect_ = std::make_unique<Conduction>();
  ConductionGraph inner = g;
  inner.conductance = unit.data();
  inner.leak = nullptr;
  inner.held = held.data();
  perfect_->solve(inner, lack.data(), x.data(), through.data(), {});
  for (std::int64_t k = 0; k < g.branches; ++k)
    if (std::isinf(g.conductance[k])) flow[k] = through[k];
}

ConductionReport Conduction::solve(const ConductionGraph& g, const double* source, double* x, double* flow,
                                   const ConductionOptions& options) {
  ConductionReport report;
  const auto n = std::size_t(g.n);
  merge(g);
  find_components(g, source, x, report);
  lay_out(g);
  report.unknowns = matrix_.n;
  rest_.resize(row_unknown_.size());
  high_.assign(n, 0.0);
  low_.assign(n, 0.0);
  for (std::size_t i = 0; i < n; ++i)
    if (!std::isnan(given_[i])) high_[i] = given_[i];
  using Method = ConductionOptions::Method;
  const bool direct = negative_ || options.method == Method::direct ||
                      (options.method == Method::automatic && matrix_.n <= options.direct_most);
  const bool ok = report.status == ConductionReport::converged;
  bool done = matrix_.n == 0;
  if (ok && !done && direct) done = refine_direct(g, source, options, report);
  if (ok && !done && !negative_ && (!direct || options.method == Method::automatic)) {
    for (const std::int32_t i : row_unknown_) {
      const std::int32_t c = component_[i];
      const double zero = kind_[c] == grounded && std::isfinite(x[c]) ? x[c] : 0;
      high_[i] = !direct && std::isfinite(x[i]) ? x[i] - zero : 0;
      low_[i] = 0;
    }
    done = refine_multigrid(g, source, options, report);
  }
  if (ok && !done && !direct && options.method == Method::automatic) { // conductances too far apart for cycles
    for (const std::int32_t i : row_unknown_) high_[i] = low_[i] = 0;
    done = refine_direct(g, source, options, report);
  }
  if (!done && ok)
    report.status = !std::isfinite(report.residual) ? ConductionReport::not_finite
                    : negative_                     ? ConductionReport::indefinite
                                                    : ConductionReport::iteration_limit;
  flows(g, flow);
  if (merged_) share(g, source, flow);
  for (std::size_t i = 0; i < n; ++i)
    x[i] = kind_[component_[i]] >= anchored ? high_[of_[i]] + low_[of_[i]] : std::numeric_limits<double>::quiet_NaN();
  return report;
}

std::int64_t Conduction::bytes() const {
  std::int64_t sum = multigrid_.bytes() + (soe_ ? soe_->bytes() : 0) + (perfect_ ? perfect_->bytes() : 0);
  for (const auto* v :
       {&parent_, &of_, &component_, &equation_, &place_, &row_unknown_, &matrix_.column, &pattern_.row})
    sum += std::int64_t(4 * v->capacity());
  for (const auto* v : {&high_, &low_, &left_, &through_, &source_, &given_, &total_, &size_, &scale_, &rest_, &change_,
                        &matrix_.conductance, &matrix_.leak, &matrix_.diagonal, &pattern_.value})
    sum += std::int64_t(8 * v->capacity());
  return sum;
}

} // namespace cairn
