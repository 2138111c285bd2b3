#include "soe.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "../base/call.hpp"
#include "factors.hpp"
#include "unit_fronts.hpp"

namespace cairn {

namespace {

constexpr int sides_at_once = 8;
constexpr std::int64_t dense_up_to = 60, band_up_to = 24;

void check_pattern(const SparseMatrix& a, bool symmetric) {
  if (a.n < 0 || std::int64_t(a.start.size()) != a.n + 1 || a.start.front() != 0 ||
      a.start.back() != std::int64_t(a.row.size()))
    throw Error("a sparse matrix of " + std::to_string(a.n) + " unknowns needs " + std::to_string(a.n + 1) +
                " starts, from 0 to the number of its entries");
  for (std::int64_t j = 0; j < a.n; ++j)
    for (std::int64_t k = a.start[j], least = symmetric ? j : 0; k < a.start[j + 1]; ++k) {
      if (a.row[k] < least || a.row[k] >= a.n)
        throw Error("column " + std::to_string(j) + " of the matrix has row " + std::to_string(a.row[k]) +
                    ": rows rise, none twice, " + (symmetric ? "from the diagonal down" : "from 0") + ", below " +
                    std::to_string(a.n));
      least = a.row[k] + 1;
    }
}

bool is_diagonal(const SparseMatrix& a) {
  for (std::int64_t j = 0; j < a.n; ++j)
    for (std::int64_t k = a.start[j]; k < a.start[j + 1]; ++k)
      if (a.row[k] != j) return false;
  return true;
}

std::unique_ptr<SoeFactors> make_sparse(const SparseMatrix& a, const SoeOptions& options) {
  if (a.n == 0) return make_diagonal(a, "sparse"); // which the libraries do not take
  if (auto made = make_cholmod(a, options)) return made;
  if (auto made = make_ldlt(a, options)) return made;
  return make_banded(a, cuthill_mckee(a));
}

std::unique_ptr<SoeFactors> make_fitting(const SparseMatrix& a, const SoeOptions& options) {
  if (is_diagonal(a)) return make_diagonal(a);
  if (a.n <= dense_up_to) return make_dense(a);
  std::vector<std::int32_t> order = cuthill_mckee(a);
  if (half_band(a, order) <= band_up_to) return make_banded(a, std::move(order));
  return make_sparse(a, options);
}

std::unique_ptr<SoeFactors> make_factors(const SparseMatrix& a, const SoeOptions& options) {
  switch (options.storage) {
  case SoeStorage::diagonal:
    if (!is_diagonal(a)) throw Error("the matrix has entries off its diagonal: give another storage than 'diagonal'");
    return make_diagonal(a);
  case SoeStorage::banded: return make_banded(a, cuthill_mckee(a));
  case SoeStorage::dense: return make_dense(a);
  case SoeStorage::sparse: return make_sparse(a, options);
  case SoeStorage::unsymmetric: return make_unsymmetric(a, options);
  default: return make_fitting(a, options);
  }
}

} // namespace

SoeStatus judge_pivot(double pivot, double diagonal, std::int64_t row) {
  const double zero = 8 * 0x1p-52 * diagonal;
  if (pivot > zero && pivot <= 0x1p1000) return {};
  return {std::abs(pivot) <= zero ? SoeStatus::singular : SoeStatus::indefinite, row};
}

std::unique_ptr<Soe> Soe::make(const SparseMatrix& pattern, const SoeOptions& options) {
  std::unique_ptr<Soe> made(new Soe);
  made->n_ = pattern.n;
  made->symmetric_ = options.storage != SoeStorage::unsymmetric;
  check_pattern(pattern, made->symmetric_);
  if (!options.held.empty() && std::int64_t(options.held.size()) != pattern.n)
    throw Error("held has " + std::to_string(options.held.size()) + " marks for " + std::to_string(pattern.n) +
                " unknowns: give one for each, or none");
  made->take_equations(pattern, options.held);
  if (!options.last.empty() && std::int64_t(options.last.size()) != pattern.n)
    throw Error("last has " + std::to_string(options.last.size()) + " marks for " + std::to_string(pattern.n) +
                " unknowns: give one for each, or none");
  SoeOptions of_equations = options;
  of_equations.last.clear();
  for (const std::int32_t i : made->unknown_)
    if (!options.last.empty()) of_equations.last.push_back(options.last[i]);
  made->factors_ = make_factors(made->scaled_, of_equations);
  const std::span<const std::int32_t> order = made->factors_->order();
  made->place_.resize(made->unknown_.size());
  std::iota(made->place_.begin(), made->place_.end(), 0);
  for (std::size_t i = 0; i < order.size(); ++i) made->place_[order[i]] = std::int32_t(i);
  made->left_.resize(made->unknown_.size());
  made->right_.resize(made->unknown_.size());
  made->work_.resize(made->work_size());
  return made;
}

Soe::~Soe() = default;

// Unknowns that are held are no equations; their columns move to the right side.
void Soe::take_equations(const SparseMatrix& pattern, const std::vector<std::uint8_t>& held) {
  equation_.resize(n_);
  for (std::int32_t i = 0; i < n_; ++i) {
    const bool free = held.empty() || !held[i];
    equation_[i] = free ? std::int32_t(unknown_.size()) : -1;
    if (free) unknown_.push_back(i);
  }
  scaled_.n = std::int64_t(unknown_.size());
  const auto pull = [&](std::int32_t equation, std::int32_t unknown, std::int64_t k) {
    pulled_.push_back(equation);
    pull_.push_back(unknown);
    pull_place_.push_back(k);
  };
  for (std::int32_t j = 0; j < n_; ++j) {
    for (std::int64_t k = pattern.start[j]; k < pattern.start[j + 1]; ++k) {
      const std::int32_t i = pattern.row[k];
      if (equation_[i] >= 0 && equation_[j] >= 0) {
        scaled_.row.push_back(equation_[i]);
        value_place_.push_back(k);
      } else if (equation_[i] >= 0) {
        pull(equation_[i], j, k);
      } else if (symmetric_ && equation_[j] >= 0) {
        pull(equation_[j], i, k);
      }
    }
    if (equation_[j] >= 0) scaled_.start.push_back(std::int64_t(scaled_.row.size()));
  }
  scaled_.value.resize(scaled_.row.size());
  pull_value_.resize(pulled_.size());
}

SoeStatus Soe::gather(const double* value) {
  for (std::size_t e = 0; e < pull_value_.size(); ++e) {
    pull_value_[e] = value[pull_place_[e]];
    if (!std::isfinite(pull_value_[e])) return {SoeStatus::not_finite, pulled_[e]};
  }
  for (std::size_t k = 0; k < scaled_.value.size(); ++k) {
    scaled_.value[k] = value[value_place_[k]];
    if (!std::isfinite(scaled_.value[k])) return {SoeStatus::not_finite, scaled_.row[k]};
  }
  return {};
}

// Scales each unknown by a power of two that brings its diagonal entry to between 1 and 4. No entry is then out of
// range, and a matrix in other units, or times a power of two, gives the same bits. Square roots of odd powers of two
// would change bits, so the whole matrix is first scaled such that the first exponent is even.
SoeStatus Soe::scale_symmetric() {
  int odd = 0;
  for (std::int64_t j = 0; j < scaled_.n; ++j) {
    const std::int64_t k = scaled_.start[j];
    const bool there = k < scaled_.start[j + 1] && scaled_.row[k] == j;
    const double entry = there ? scaled_.value[k] : 0.0;
    if (!(entry > 0)) return {entry < 0 ? SoeStatus::indefinite : SoeStatus::singular, j};
    const int exponent = std::ilogb(entry);
    if (j == 0) odd = exponent & 1;
    const int half = (exponent - odd) >> 1;
    right_[j] = std::ldexp(1.0, -half);
    left_[j] = std::ldexp(1.0, -half - odd);
  }
  return {};
}

SoeStatus Soe::scale() {
  if (symmetric_) {
    if (const SoeStatus status = scale_symmetric(); !status) return status;
  } else { // rows by their largest entry
    std::fill(left_.begin(), left_.end(), 0.0);
    std::fill(right_.begin(), right_.end(), 1.0);
    for (std::size_t k = 0; k < scaled_.value.size(); ++k)
      left_[scaled_.row[k]] = std::max(left_[scaled_.row[k]], std::abs(scaled_.value[k]));
    for (std::size_t i = 0; i < left_.size(); ++i) {
      if (!(left_[i] > 0)) return {SoeStatus::singular, std::int64_t(i)};
      left_[i] = std::ldexp(1.0, -std::clamp(std::ilogb(left_[i]), -1022, 1022));
    }
  }
  for (std::int64_t j = 0; j < scaled_.n; ++j)
    for (std::int64_t k = scaled_.start[j]; k < scaled_.start[j + 1]; ++k)
      scaled_.value[k] = scaled_.value[k] * left_[scaled_.row[k]] * right_[j];
  return {};
}

SoeStatus Soe::factor(const double* value) {
  factorised_ = false;
  units_.reset();
  SoeStatus status = gather(value);
  if (status) status = scale();
  if (status) status = factors_->factor(scaled_);
  factorised_ = bool(status);
  if (status.row >= 0) status.row = unknown_[status.row];
  return status;
}

std::int64_t Soe::work_size() const { return sides_at_once * (scaled_.n + factors_->work_per_lane()); }

// Subtracts the contribution of held unknowns from the right side.
void Soe::lift(double* b) const {
  for (std::size_t e = 0; e < pulled_.size(); ++e) b[unknown_[pulled_[e]]] -= pull_value_[e] * b[pull_[e]];
}

// One column, or up to eight side by side.
void Soe::solve_lanes(double* b, std::int64_t columns, double* work) const {
  const std::int64_t equations = scaled_.n;
  const int side = columns == 1 ? 1 : sides_at_once;
  for (std::int64_t c = 0; c < columns; ++c) {
    lift(b + c * n_);
    for (std::int64_t e = 0; e < equations; ++e) work[place_[e] * side + c] = left_[e] * b[c * n_ + unknown_[e]];
  }
  for (std::int64_t c = columns; c < side; ++c)
    for (std::int64_t p = 0; p < equations; ++p) work[p * side + c] = 0;
  factors_->solve(side, work, work + side * equations);
  for (std::int64_t c = 0; c < columns; ++c)
    for (std::int64_t e = 0; e < equations; ++e) b[c * n_ + unknown_[e]] = right_[e] * work[place_[e] * side + c];
}

void Soe::solve(double* b, std::int64_t columns, int threads) const {
  if (!factorised_) throw Error("there are no factors to solve with: give values that can be factorised first");
  const std::int64_t groups = (columns + sides_at_once - 1) / sides_at_once, size = work_size();
  const int team = int(std::clamp<std::int64_t>(groups, 1, std::max(threads, 1)));
  if (std::int64_t(work_.size()) < team * size) work_.resize(team * size);
#pragma omp parallel for num_threads(team) schedule(dynamic) if (team > 1)
  for (std::int64_t g = 0; g < groups; ++g)
    solve_lanes(b + g * sides_at_once * n_, std::min<std::int64_t>(columns - g * sides_at_once, sides_at_once),
                work_.data() + omp_get_thread_num() * size);
}

std::int64_t Soe::entries() const { return factors_->entries(); }
const char* Soe::storage() const { return factors_->storage(); }
const char* Soe::library() const { return factors_->library(); }

std::int64_t Soe::bytes() const {
  const auto of = [](const auto& v) { return std::int64_t(v.size() * sizeof v[0]); };
  return factors_->bytes() + of(unknown_) + of(equation_) + of(place_) + of(value_place_) + of(pulled_) + of(pull_) +
         of(pull_place_) + of(pull_value_) + of(scaled_.start) + of(scaled_.row) + of(scaled_.value) + of(left_) +
         of(right_) + of(work_) + (units_ ? units_->bytes() : 0);
}

} // namespace cairn
