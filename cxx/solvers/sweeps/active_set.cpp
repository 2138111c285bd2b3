#include "active_set.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../../laws/law_info.hpp"
#include "batch.hpp"

namespace cairn {

namespace {

// f(batch, lane, component) for every impulse there is
template <class F>
void each(const ContactSystem& system, F&& f) {
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane)
      for (int k = 0; k < b.components; ++k) f(b, lane, k);
}

constexpr int most_iterations = 12, most_corrections = 6;
constexpr double epsilon = std::numeric_limits<double>::epsilon();
} // namespace

ActiveSetMemory& ActiveSet::room(ContactSystem& system) {
  if (!system.newton) system.newton = std::make_shared<ActiveSetMemory>();
  return *system.newton;
}

void ActiveSet::keep(std::vector<double>& all) const {
  all.clear();
  each(system_, [&](const cairn_batch& b, int lane, int k) { all.push_back(at(b, b.r, lane, k)); });
}

void ActiveSet::set(const std::vector<double>& all) {
  const double* from = all.data();
  each(system_, [&](const cairn_batch& b, int lane, int k) { at(b, b.r, lane, k) = *from++; });
}

// Relative velocities of all batches, by components, without biases.
void ActiveSet::read_velocities() {
  cairn_add_impulses(&schedule_);
  double* u = memory_.u.data();
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    const std::size_t size = std::size_t(b.count) * b.components;
    cairn_relative_velocities(&schedule_, std::int32_t(k), 0, u);
    for (std::size_t i = 0; i < size && b.compliance; ++i) u[i] += b.compliance[i] * b.r[i];
    u += size;
  }
}

void ActiveSet::refresh() {
  system_.load(velocity_free_);
  read_velocities();
  double* u = memory_.u.data();
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
    memory_.unknowns.push_back({&r(k), u + k * n + lane, {nullptr, nullptr}, {0, 0}, scale});
  };
  if (b.bonds && b.state[lane] > 0) {
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
  Unknown& normal = memory_.unknowns.back();
  for (int k = 1; k < dim; ++k) {
    normal.slip[k - 1] = &r(k);
    normal.along[k - 1] = mu * (z[k - 1] / size);
    r(k) = normal.along[k - 1] * r(0);
  }
  normal.scale *= 1 + mu;
}

bool ActiveSet::choose(int most) {
  memory_.unknowns.clear();
  double* u = memory_.u.data();
  for (const cairn_batch& b : system_.batches) {
    for (int lane = 0; lane < b.contacts; ++lane) {
      choose_contact(b, lane, u);
      if (memory_.unknowns.size() > std::size_t(most)) return false;
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

// Assembles the matrix by columns: velocities by a unit impulse of each unknown alone.
void ActiveSet::assemble() {
  keep(memory_.kept);
  const int n = int(memory_.unknowns.size());
  memory_.matrix.resize(std::size_t(n) * n);
  each(system_, [&](const cairn_batch& b, int lane, int k) { at(b, b.r, lane, k) = 0; });
  system_.clear_velocities();
  for (int j = 0; j < n; ++j) {
    apply(memory_.unknowns[j], 1);
    if (j > 0) system_.clear_touched();
    read_velocities();
    for (int i = 0; i < n; ++i) memory_.matrix[std::size_t(n) * i + j] = *memory_.unknowns[i].u;
    apply(memory_.unknowns[j], -1);
  }
  set(memory_.kept);
}

// Elimination with complete pivoting, each pivot measured by the diagonals of its row and column.
void ActiveSet::factor() {
  const int n = int(memory_.unknowns.size());
  memory_.row.resize(n);
  memory_.column.resize(n);
  for (int i = 0; i < n; ++i) memory_.row[i] = memory_.column[i] = i;
  double* a = memory_.matrix.data();
  const double least = 16 * n * epsilon;
  for (rank_ = 0; rank_ < n; ++rank_) {
    int p = -1, q = -1;
    double best = least * least;
    for (int i = rank_; i < n; ++i)
      for (int j = rank_; j < n; ++j) {
        const double value = a[std::size_t(n) * memory_.row[i] + memory_.column[j]];
        const double scale = memory_.unknowns[memory_.row[i]].scale * memory_.unknowns[memory_.column[j]].scale;
        if (scale > 0 && value * value > best * scale) best = value * value / scale, p = i, q = j;
      }
    if (p < 0) return;
    std::swap(memory_.row[rank_], memory_.row[p]);
    std::swap(memory_.column[rank_], memory_.column[q]);
    const double* pivot = a + std::size_t(n) * memory_.row[rank_];
    for (int i = rank_ + 1; i < n; ++i) {
      double* line = a + std::size_t(n) * memory_.row[i];
      const double factor = line[memory_.column[rank_]] / pivot[memory_.column[rank_]];
      line[memory_.column[rank_]] = factor;
      if (factor != 0)
        for (int j = rank_ + 1; j < n; ++j) line[memory_.column[j]] -= factor * pivot[memory_.column[j]];
    }
  }
}

bool ActiveSet::correct() {
  const int n = int(memory_.unknowns.size());
  memory_.right.resize(n);
  for (int i = 0; i < n; ++i) memory_.right[i] = -*memory_.unknowns[memory_.row[i]].u;
  for (int i = 0; i < rank_; ++i)
    for (int j = 0; j < i; ++j)
      memory_.right[i] -= memory_.matrix[std::size_t(n) * memory_.row[i] + memory_.column[j]] * memory_.right[j];
  bool changed = false;
  for (int i = rank_ - 1; i >= 0; --i) {
    const double* line = memory_.matrix.data() + std::size_t(n) * memory_.row[i];
    for (int j = i + 1; j < rank_; ++j) memory_.right[i] -= line[memory_.column[j]] * memory_.right[j];
    memory_.right[i] /= line[memory_.column[i]];
  }
  for (int i = 0; i < rank_; ++i) {
    const Unknown& x = memory_.unknowns[memory_.column[i]];
    changed = changed || std::abs(memory_.right[i]) > epsilon * std::abs(*x.r);
    apply(x, memory_.right[i]);
  }
  refresh();
  return changed;
}

double ActiveSet::improve(double error, double wanted, int most) {
  std::size_t numbers = 0;
  for (const cairn_batch& b : system_.batches) numbers += std::size_t(b.count) * b.components;
  if (numbers > 64 * std::size_t(most_unknowns)) return error;
  for (const cairn_batch& b : system_.batches) // neither Coulomb's cones nor held fast
    if (!b.relaxes && !(b.bonds && law_infos()[std::size_t(b.law)].parameters.size() == 1)) return error;
  if (memory_.matrix.capacity() == 0) { // of a size for all, since the unknowns change from step to step
    memory_.matrix.reserve(std::size_t(most_unknowns) * most_unknowns);
    memory_.unknowns.reserve(most_unknowns + 6);
    memory_.right.reserve(most_unknowns);
    memory_.row.reserve(most_unknowns);
    memory_.column.reserve(most_unknowns);
  }
  for (auto* values : {&memory_.best, &memory_.kept, &memory_.u})
    if (values->capacity() < numbers) values->reserve(numbers + numbers / 4);
  keep(memory_.best);
  memory_.u.resize(numbers);
  refresh();
  for (int iteration = 0; iteration < most_iterations && error > wanted; ++iteration) {
    if (!choose(most) || memory_.unknowns.empty()) break;
    assemble();
    factor();
    refresh();
    for (int k = 0; k < most_corrections && correct(); ++k) {}
    const double now = measure_();
    if (now < error) {
      error = now;
      keep(memory_.best);
    } else if (!std::isfinite(now)) {
      break;
    }
  }
  set(memory_.best);
  system_.load(velocity_free_);
  cairn_add_impulses(&schedule_);
  return error;
}

} // namespace cairn
