#include "held_rows.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace cairn {

HeldRows::HeldRows(SparseMatrix matrix) : matrix_(std::move(matrix)) {
  constexpr double delta = 0x1p-33; // far above the rounding of S, far below what long chains need of it
  find_assemblies();
  if (matrix_.n == 0) return;
  std::vector<double> value = matrix_.value;
  for (std::int64_t j = 0; j < matrix_.n; ++j) value[std::size_t(matrix_.start[j])] *= 1 + delta;
  soe_ = Soe::make(matrix_);
  factored_ = bool(soe_->factor(value.data()));
}

void HeldRows::find_assemblies() {
  std::vector<std::int32_t> root(std::size_t(matrix_.n));
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](std::int32_t i) {
    while (root[std::size_t(i)] != i) i = root[std::size_t(i)] = root[std::size_t(root[std::size_t(i)])];
    return i;
  };
  for (std::int64_t j = 0; j < matrix_.n; ++j)
    for (std::int64_t k = matrix_.start[j]; k < matrix_.start[j + 1]; ++k) {
      const std::int32_t one = find(matrix_.row[std::size_t(k)]), other = find(std::int32_t(j));
      root[std::size_t(std::max(one, other))] = std::min(one, other);
    }
  assembly_.assign(std::size_t(matrix_.n), -1);
  for (std::int32_t j = 0; j < matrix_.n; ++j) {
    std::int32_t& number = assembly_[std::size_t(find(j))]; // roots come before all others of theirs
    if (number < 0) number = assemblies_++;
    assembly_[std::size_t(j)] = number;
  }
}

void HeldRows::subtract_product(const double* x, double* from) const {
  for (std::int64_t j = 0; j < matrix_.n; ++j) {
    from[j] -= matrix_.value[std::size_t(matrix_.start[j])] * x[j];
    for (std::int64_t k = matrix_.start[j] + 1; k < matrix_.start[j + 1]; ++k) {
      const std::int32_t i = matrix_.row[std::size_t(k)];
      const double s = matrix_.value[std::size_t(k)];
      from[i] -= s * x[j];
      from[j] -= s * x[i];
    }
  }
}

double HeldRows::size(const double* b) const {
  double sum = 0;
  for (std::int64_t j = 0; j < matrix_.n; ++j) sum += b[j] * b[j] / matrix_.value[std::size_t(matrix_.start[j])];
  return sum;
}

void HeldRows::solve(double* b, std::int64_t columns) {
  constexpr std::int64_t together = 8; // that Soe takes at once
  for (std::int64_t c = 0; c < columns && matrix_.n > 0; c += together)
    refine(b + c * matrix_.n, std::min(columns - c, together));
}

// Refines as long as a step leaves less than half of the residual; keeps the best of each column.
void HeldRows::refine(double* b, std::int64_t columns) {
  constexpr int most = 40;
  constexpr double rounding = std::numeric_limits<double>::epsilon();
  const std::int64_t n = matrix_.n;
  left_.assign(b, b + columns * n);
  best_.assign(std::size_t(columns * n), 0.0);
  double before[8];
  bool open[8];
  for (std::int64_t c = 0; c < columns; ++c) {
    before[c] = size(&left_[std::size_t(c * n)]);
    open[c] = before[c] > 0;
  }
  double wanted[8];
  for (std::int64_t c = 0; c < columns; ++c) wanted[c] = rounding * rounding * before[c];
  for (int pass = 0; pass < most && std::any_of(open, open + columns, [](bool x) { return x; }); ++pass) {
    step_ = left_;
    soe_->solve(step_.data(), columns);
    for (std::int64_t c = 0; c < columns; ++c) {
      if (!open[c]) continue;
      double *x = &best_[std::size_t(c * n)], *left = &left_[std::size_t(c * n)];
      const double* dx = &step_[std::size_t(c * n)];
      for (std::int64_t i = 0; i < n; ++i) x[i] += dx[i];
      std::copy_n(b + c * n, n, left);
      subtract_product(x, left);
      const double now = size(left);
      if (pass > 0 && !(now < before[c])) // the rest is out of reach of these impulses
        for (std::int64_t i = 0; i < n; ++i) x[i] -= dx[i];
      open[c] = now < 0.25 * before[c] && now > wanted[c];
      before[c] = now;
    }
  }
  std::copy_n(best_.data(), columns * n, b);
}

} // namespace cairn
