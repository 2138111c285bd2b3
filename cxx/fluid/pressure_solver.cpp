#include "pressure_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cairn {
namespace {

constexpr std::int64_t chunk = 1024; // particles that are summed together

template <class F>
double summed(std::int64_t n, F&& f) {
  const std::int64_t parts = (n + chunk - 1) / chunk;
  std::vector<double> part(static_cast<std::size_t>(parts), 0.0);
#pragma omp parallel for schedule(static) if (parts > 1)
  for (std::int64_t t = 0; t < parts; ++t) {
    double sum = 0;
    for (std::int64_t i = chunk * t; i < std::min(n, chunk * (t + 1)); ++i) sum += f(std::size_t(i));
    part[std::size_t(t)] = sum;
  }
  double sum = 0;
  for (const double one : part) sum += one;
  return sum;
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  return summed(std::int64_t(a.size()), [&](std::size_t i) { return a[i] * b[i]; });
}

bool is_finite(const std::vector<double>& a) {
  return std::all_of(a.begin(), a.end(), [](double x) { return std::isfinite(x); });
}

// a + share * b
void add(std::vector<double>& a, double share, const std::vector<double>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] += share * b[i];
}

} // namespace

void PressureSolver::product(const std::vector<double>& x, std::vector<double>& out) {
  for (std::size_t i = 0; i < x.size(); ++i) pressure_[i] = scale_[i] * x[i];
  problem_->apply(pressure_, out);
  for (std::size_t i = 0; i < x.size(); ++i) out[i] *= scale_[i];
  ++products_;
}

double PressureSolver::split(const std::vector<double>& x, bool unilateral) {
  return summed(std::int64_t(x.size()), [&](std::size_t i) {
    const bool held = unilateral && !(x[i] > 0);
    free_[i] = held ? 0 : gradient_[i];
    chopped_[i] = held ? std::min(gradient_[i], 0.0) : 0;
    return free_[i] * free_[i] + chopped_[i] * chopped_[i];
  });
}

void PressureSolver::measure_norm(double& norm) {
  constexpr int rounds = 8;
  for (std::size_t i = 0; i < way_.size(); ++i) way_[i] = (i % 2 ? -1.0 : 1.0) * (1 + double(i % 7));
  for (int k = 0; k < rounds; ++k) {
    const double size = std::sqrt(dot(way_, way_));
    if (!(size > 0)) return;
    for (double& w : way_) w /= size;
    product(way_, product_);
    norm = std::max(norm, dot(way_, product_));
    way_ = product_;
  }
}

PressureSolver::Report PressureSolver::solve(const Problem& problem, std::vector<double>& p, double& norm) {
  problem_ = &problem;
  products_ = 0;
  const std::size_t n = p.size();
  for (auto* v : {&scale_, &gradient_, &free_, &chopped_, &way_, &product_, &pressure_, &x_}) v->resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double d = (*problem.diagonal)[i];
    scale_[i] = d > 0 ? 1 / std::sqrt(d) : 0;
    x_[i] = scale_[i] > 0 ? p[i] / scale_[i] : 0;
    if (problem.unilateral) x_[i] = std::max(x_[i], 0.0);
    gradient_[i] = scale_[i] * (*problem.constant)[i];
  }
  if (!(norm > 0)) measure_norm(norm);
  const std::vector<double> nothing(n, 0.0);
  std::vector<double> constant = gradient_;
  Report report;
  if (!is_finite(gradient_)) { // velocities are not finite: pressures say so
    report.residual = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t i = 0; i < n; ++i)
      if (!std::isfinite(gradient_[i])) p[i] = report.residual;
    return report;
  }
  double reference = std::sqrt(split(nothing, problem.unilateral));
  for (std::size_t i = 0; i < n; ++i) gradient_[i] = scale_[i] * (*problem.measure)[i];
  if (const double found = std::sqrt(split(nothing, problem.unilateral)); found > 0)
    reference = std::min(reference, found);
  gradient_ = constant;
  if (!std::isfinite(reference)) { // squares of velocities are beyond the range of numbers
    report.residual = std::numeric_limits<double>::quiet_NaN();
    std::fill(p.begin(), p.end(), report.residual);
    return report;
  }
  if (!(reference > 0)) { // nothing presses
    std::fill(p.begin(), p.end(), 0.0);
    report.products = products_;
    report.converged = reference == 0;
    return report;
  }
  const double enough = problem.tolerance * reference;
  product(x_, product_);
  add(gradient_, 1, product_);
  double size = std::sqrt(split(x_, problem.unilateral));
  way_ = free_;
  while (size > enough && products_ < problem.most) {
    const double step = 1 / std::max(norm, std::numeric_limits<double>::min()); // below 2 / norm
    const double of_chopped = dot(chopped_, chopped_);
    const double of_free = summed(std::int64_t(n), [&](std::size_t i) {
      const double reduced = problem.unilateral ? std::min(x_[i] / step, free_[i]) : free_[i];
      return reduced * free_[i];
    });
    if (of_chopped > of_free) { // lets particles go that pull
      product(chopped_, product_);
      const double curve = dot(chopped_, product_);
      if (!(curve > 0)) break;
      const double length = dot(gradient_, chopped_) / curve;
      norm = std::max(norm, curve / of_chopped);
      add(x_, -length, chopped_);
      add(gradient_, -length, product_);
      size = std::sqrt(split(x_, problem.unilateral));
      way_ = free_;
      continue;
    }
    product(way_, product_);
    const double curve = dot(way_, product_), square = dot(way_, way_);
    if (!(curve > 0)) break;
    norm = std::max(norm, curve / square);
    const double length = dot(gradient_, way_) / curve;
    double most = std::numeric_limits<double>::infinity();
    if (problem.unilateral)
      for (std::size_t i = 0; i < n; ++i)
        if (way_[i] > 0) most = std::min(most, x_[i] / way_[i]);
    if (length <= most) {
      add(x_, -length, way_);
      if (problem.unilateral)
        for (double& x : x_) x = std::max(x, 0.0);
      add(gradient_, -length, product_);
      size = std::sqrt(split(x_, problem.unilateral));
      const double back = dot(free_, product_) / curve;
      for (std::size_t i = 0; i < n; ++i) way_[i] = free_[i] - back * way_[i];
      continue;
    }
    add(x_, -most, way_);
    add(gradient_, -most, product_);
    split(x_, problem.unilateral);
    for (std::size_t i = 0; i < n; ++i) x_[i] = std::max(x_[i] - step * free_[i], 0.0);
    gradient_ = constant;
    product(x_, product_);
    add(gradient_, 1, product_);
    size = std::sqrt(split(x_, problem.unilateral));
    way_ = free_;
  }
  for (std::size_t i = 0; i < n; ++i) p[i] = scale_[i] * x_[i];
  report.products = products_;
  report.residual = size / reference;
  report.converged = size <= enough;
  return report;
}

std::int64_t PressureSolver::bytes() const {
  std::int64_t sum = 0;
  for (const auto* v : {&scale_, &x_, &gradient_, &free_, &chopped_, &way_, &product_, &pressure_})
    sum += std::int64_t(8 * v->capacity());
  return sum;
}

} // namespace cairn
