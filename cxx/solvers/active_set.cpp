#include "active_set.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../interaction_state.hpp"

namespace cairn {

namespace {

// f(batch, lane, component) for every impulse there is
template <class F>
void each(const ContactSystem& system, F&& f) {
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane)
      for (int k = 0; k < b.components; ++k) f(b, lane, k);
}

constexpr int most_unknowns = 256, most_iterations = 12, most_corrections = 6;
constexpr double epsilon = std::numeric_limits<double>::epsilon();
} // namespace

std::vector<double> ActiveSet::impulses() const {
  std::vector<double> all;
  each(system_, [&](const cairn_batch& b, int lane, int k) { all.push_back(at(b, b.r, lane, k)); });
  return all;
}

void ActiveSet::set(const std::vector<double>& all) {
  const double* from = all.data();
  each(system_, [&](const cairn_batch& b, int lane, int k) { at(b, b.r, lane, k) = *from++; });
}

// Of all batches, component by component, without biases.
void ActiveSet::read_velocities() {
  cairn_add_impulses(&schedule_);
  double* u = u_.data();
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    cairn_relative_velocities(&schedule_, std::int32_t(k), 0, u);
    u += std::size_t(system_.batches[k].count) * system_.batches[k].components;
  }
}

void ActiveSet::refresh() {
  system_.load(velocity_free_);
  read_velocities();
  double* u = u_.data();
  for (const cairn_batch& b : system_.batches) {
    for (int k = 0; k < (b.pack ? 1 : b.components); ++k) // a pack has a bias of the normal velocity alone
      for (int lane = 0; lane < b.contacts; ++lane) u[k * b.count + lane] += at(b, b.bias, lane, k);
    u += std::size_t(b.count) * b.components;
  }
}

void ActiveSet::choose_contact(const cairn_batch& b, int lane, double* u) {
  const int n = b.count, c = b.components, dim = system_.dim;
  const auto r = [&](int k) -> double& { return at(b, b.r, lane, k); };
  const double w = 1 / b.rho[lane];
  const auto stick = [&](int k, double scale) {
    unknowns_.push_back({&r(k), u + k * n + lane, {nullptr, nullptr}, {0, 0}, scale});
  };
  if (b.state && b.state[lane] < std::numeric_limits<double>::max()) {
    for (int k = 0; k < c; ++k) stick(k, b.delassus[n * (k * c + k) + lane]);
    return;
  }
  for (int k = dim; k < c; ++k) r(k) = 0;
  const double zn = r(0) - b.rho[lane] * u[lane];
  if (!(zn > 0)) {
    for (int k = 0; k < dim; ++k) r(k) = 0;
    return;
  }
  double z[2] = {0, 0}, square = 0;
  for (int k = 1; k < dim; ++k) {
    z[k - 1] = r(k) - b.rho[lane] * u[k * n + lane];
    square += z[k - 1] * z[k - 1];
  }
  const double mu = at(b, b.params, lane, 0), limit = mu * zn, size = std::sqrt(square);
  stick(0, w);
  if (size <= limit) {
    for (int k = 1; k < dim; ++k) stick(k, w);
    return;
  }
  Unknown& normal = unknowns_.back();
  for (int k = 1; k < dim; ++k) {
    normal.slip[k - 1] = &r(k);
    normal.along[k - 1] = mu * (z[k - 1] / size);
    r(k) = normal.along[k - 1] * r(0);
  }
  normal.scale *= 1 + mu;
}

bool ActiveSet::choose() {
  unknowns_.clear();
  double* u = u_.data();
  for (const cairn_batch& b : system_.batches) {
    for (int lane = 0; lane < b.contacts; ++lane) {
      choose_contact(b, lane, u);
      if (unknowns_.size() > most_unknowns) return false;
    }
    u += std::size_t(b.count) * b.components;
  }
  return true;
}

void ActiveSet::apply(const Unknown& unknown, double change) {
  *unknown.r += change;
  for (int k = 0; k < 2; ++k)
    if (unknown.slip[k]) *unknown.slip[k] = unknown.along[k] * *unknown.r;
}

// Column by column: what an impulse of each unknown alone makes of the velocities.
void ActiveSet::assemble() {
  const std::vector<double> kept = impulses();
  const int n = int(unknowns_.size());
  matrix_.resize(std::size_t(n) * n);
  each(system_, [&](const cairn_batch& b, int lane, int k) { at(b, b.r, lane, k) = 0; });
  const auto velocities = system_.velocities();
  for (int j = 0; j < n; ++j) {
    apply(unknowns_[j], 1);
    for (std::int64_t b = 0; b < system_.bodies; ++b) std::fill_n(system_.record[b].x, velocities, 0.0);
    read_velocities();
    for (int i = 0; i < n; ++i) matrix_[std::size_t(n) * i + j] = *unknowns_[i].u;
    apply(unknowns_[j], -1);
  }
  set(kept);
}

// Elimination with complete pivoting, each pivot measured by the diagonals of its row and column.
void ActiveSet::factor() {
  const int n = int(unknowns_.size());
  row_.resize(n);
  column_.resize(n);
  for (int i = 0; i < n; ++i) row_[i] = column_[i] = i;
  double* a = matrix_.data();
  const double least = 16 * n * epsilon;
  for (rank_ = 0; rank_ < n; ++rank_) {
    int p = -1, q = -1;
    double best = least * least;
    for (int i = rank_; i < n; ++i)
      for (int j = rank_; j < n; ++j) {
        const double value = a[std::size_t(n) * row_[i] + column_[j]];
        const double scale = unknowns_[row_[i]].scale * unknowns_[column_[j]].scale;
        if (scale > 0 && value * value > best * scale) best = value * value / scale, p = i, q = j;
      }
    if (p < 0) return;
    std::swap(row_[rank_], row_[p]);
    std::swap(column_[rank_], column_[q]);
    const double* pivot = a + std::size_t(n) * row_[rank_];
    for (int i = rank_ + 1; i < n; ++i) {
      double* line = a + std::size_t(n) * row_[i];
      const double factor = line[column_[rank_]] / pivot[column_[rank_]];
      line[column_[rank_]] = factor;
      if (factor != 0)
        for (int j = rank_ + 1; j < n; ++j) line[column_[j]] -= factor * pivot[column_[j]];
    }
  }
}

bool ActiveSet::correct() {
  const int n = int(unknowns_.size());
  right_.resize(n);
  for (int i = 0; i < n; ++i) right_[i] = -*unknowns_[row_[i]].u;
  for (int i = 0; i < rank_; ++i)
    for (int j = 0; j < i; ++j) right_[i] -= matrix_[std::size_t(n) * row_[i] + column_[j]] * right_[j];
  bool changed = false;
  for (int i = rank_ - 1; i >= 0; --i) {
    const double* line = matrix_.data() + std::size_t(n) * row_[i];
    for (int j = i + 1; j < rank_; ++j) right_[i] -= line[column_[j]] * right_[j];
    right_[i] /= line[column_[i]];
  }
  for (int i = 0; i < rank_; ++i) {
    const Unknown& x = unknowns_[column_[i]];
    changed = changed || std::abs(right_[i]) > epsilon * std::abs(*x.r);
    apply(x, right_[i]);
  }
  refresh();
  return changed;
}

double ActiveSet::improve(double error, double wanted) {
  std::size_t numbers = 0;
  for (const cairn_batch& b : system_.batches) numbers += std::size_t(b.count) * b.components;
  if (numbers > 64 * std::size_t(most_unknowns)) return error;
  std::vector<double> best = impulses();
  u_.resize(numbers);
  refresh();
  for (int iteration = 0; iteration < most_iterations && error > wanted; ++iteration) {
    if (!choose() || unknowns_.empty()) break;
    assemble();
    factor();
    refresh();
    for (int k = 0; k < most_corrections && correct(); ++k) {}
    const double now = measure_();
    if (now < error) {
      error = now;
      best = impulses();
    } else if (!std::isfinite(now)) {
      break;
    }
  }
  set(best);
  system_.load(velocity_free_);
  cairn_add_impulses(&schedule_);
  return error;
}

} // namespace cairn
