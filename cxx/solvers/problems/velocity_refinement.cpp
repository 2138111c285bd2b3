#include "velocity_refinement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../sweeps/light_error.hpp"
#include "cairn/core.h"

namespace cairn {

namespace {

double product(const Array<double>& x, const Array<double>& y) {
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += x[i] * y[i];
  return sum;
}

void add(double factor, const Array<double>& x, Array<double>& y) {
  for (std::size_t i = 0; i < x.size(); ++i) y[i] += factor * x[i];
}

Array<double> difference(const Array<double>& x, const Array<double>& y) {
  Array<double> d(x);
  add(-1, y, d);
  return d;
}

} // namespace

double VelocityRefinement::measure(Point& x) {
  ContactBodies& b = *p_.bodies;
  x.r = begin_;
  add(1, x.more, x.r);
  x.u.resize(p_.unknowns());
  b.velocity = x.v;
  cairn_body_velocities(p_.dim, b.dofs, p_.contacts, b.count, b.body.data(), b.rows.data(), x.v.data(), p_.q.data(),
                        x.u.data());
  const LightError light = measure_light(p_, monitor_.w_nn(), x.r.data(), x.u.data(), unit_, x.broken);
  return std::isfinite(light.value()) && agree(x) ? light.value() : std::numeric_limits<double>::infinity();
}

// True if velocities still belong to the impulses. A step along a direction that W hardly resists may be so long that
// the rounding of its velocities exceeds the velocities themselves, and stays in them when the next step goes back. The
// momentum of a body by its impulses may differ by the rounding of the longest of all steps; far more means that they
// no longer agree.
bool VelocityRefinement::agree(const Point& x) {
  constexpr double rounding = 0x1p-32; // up to 4e-10 of the impulses on a body under a ratio of masses of 1e12
  const ContactBodies& b = *p_.bodies;
  const std::size_t n = std::size_t(b.dofs), d = std::size_t(p_.dim);
  impulses_.assign(n * std::size_t(b.count), 0.0);
  slack_ = impulses_;
  for (std::size_t side = 0; side < b.body.size(); ++side) {
    if (b.body[side] < 0) continue;
    const double *rows = &b.rows[d * n * side], *r = &x.r[d * (side / 2)];
    for (std::size_t k = 0; k < n; ++k)
      for (std::size_t c = 0; c < d; ++c) {
        const double part = rows[d * k + c] * r[c];
        impulses_[n * std::size_t(b.body[side]) + k] += part;
        slack_[n * std::size_t(b.body[side]) + k] += std::abs(part);
      }
  }
  for (std::size_t i = 0; i < impulses_.size(); ++i) {
    double momentum = 0, size = 0;
    for (std::size_t k = 0; k < n; ++k) {
      const double part = b.mass[n * n * (i / n) + n * k + i % n] * x.v[n * (i / n) + k];
      momentum += part;
      size += std::abs(part);
    }
    if (!(std::abs(momentum - impulses_[i]) <= rounding * (slack_[i] + size))) return false;
  }
  return true;
}

bool VelocityRefinement::step(const Point& from, double alpha, Point& to) {
  double merit = 0;
  if (!newton_.find(from.r.data(), from.u.data(), alpha, merit)) return false;
  ContactBodies& b = *p_.bodies;
  const Array<double> none(p_.unknowns());
  to.u.resize(p_.unknowns());
  cairn_body_product(p_.dim, b.dofs, p_.contacts, b.count, b.body.data(), b.rows.data(), b.inverse.data(),
                     newton_.step().data(), none.data(), b.velocity.data(), to.u.data());
  to.r = from.r;
  to.more = from.more;
  to.v = from.v;
  add(1, newton_.step(), to.more);
  add(1, b.velocity, to.v);
  return true;
}

// Least squares by orthogonal columns: differences to the newest point, which shrink by many powers of ten.
void VelocityRefinement::combine(Point& newest) {
  // Least share of a column's own size: with less left, it depends on the columns before.
  constexpr double little = 1e-10;
  const std::size_t n = points_.size();
  std::vector<Array<double>> q;
  std::vector<std::size_t> of;
  std::vector<std::vector<double>> upper;
  std::vector<double> right;
  Array<double> left(newest.broken);
  for (std::size_t j = n; j-- > 0;) {
    Array<double> column = difference(points_[j].broken, newest.broken);
    const double size = std::sqrt(product(column, column));
    std::vector<double> above;
    for (const Array<double>& x : q) {
      above.push_back(product(x, column));
      add(-above.back(), x, column);
    }
    const double rest = std::sqrt(product(column, column));
    if (!(rest > little * size)) continue;
    for (double& x : column) x /= rest;
    above.push_back(rest);
    right.push_back(-product(column, left));
    add(right.back(), column, left);
    q.push_back(std::move(column));
    upper.push_back(std::move(above));
    of.push_back(j);
  }
  for (std::size_t k = q.size(); k-- > 0;) {
    for (std::size_t l = k + 1; l < q.size(); ++l) right[k] -= upper[l][k] * right[l];
    right[k] /= upper[k][k];
  }
  const Array<double> more(newest.more), v(newest.v);
  for (std::size_t k = 0; k < q.size(); ++k) {
    add(right[k], difference(points_[of[k]].more, more), newest.more);
    add(right[k], difference(points_[of[k]].v, v), newest.v);
  }
}

void VelocityRefinement::run(const Array<double>& r, std::int64_t& iterations, std::int64_t most) {
  constexpr double share = 0.1, fall = 0.5, far = 10, largest = 1e-2;
  constexpr std::size_t most_points = 24;
  constexpr int most_failures = 8;
  begin_ = best_.r = r;
  best_.more.assign(p_.unknowns(), 0.0);
  best_.u.resize(p_.unknowns());
  product(p_, r.data(), best_.u.data(), 1);
  best_.v = p_.bodies->velocity;
  const double ratio = mass_ratio(*p_.bodies);
  double least = measure(best_), alpha = std::max(1e-12, 1e-3 / ratio);
  points_.assign(1, best_);
  Point now = best_;
  const double enough = share * light_enough(monitor_.tolerance(), ratio);
  for (int failures = 0; failures < (least > monitor_.tolerance() ? most_failures : 3) && least > enough;) {
    if (monitor_.ended(iterations) || iterations >= most) break;
    Point next;
    if (!step(now, alpha, next)) break;
    ++iterations;
    double light = measure(next);
    const double plain = light;
    Point mixed = next;
    combine(mixed);
    const double combined = measure(mixed);
    points_.push_back(next);
    if (points_.size() > most_points) points_.erase(points_.begin());
    now = combined < light ? std::move(mixed) : std::move(next);
    light = std::min(combined, light);
    failures = light < fall * least ? 0 : failures + 1;
    if (light < least && monitor_.error_of(now.r.data(), now.u.data()) <= monitor_.tolerance()) {
      least = light;
      best_ = now;
    } else if (!(plain < far * least)) {
      alpha = std::min(largest, 100 * alpha);
      now = best_;
      points_.assign(1, best_);
    }
  }
  monitor_.error_of(best_.r.data(), best_.u.data());
}

} // namespace cairn
