#include "frame_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "../base/call.hpp"
#include "../base/vectors.hpp"
#include "cairn/core.h"

namespace cairn {
namespace {

enum {
  no_length = 1,
  turned_back = 2,
  no_balance = 3,
  endless = 4
}; // of BulkResult; the first two as the kernels have them

constexpr double rounding = std::numeric_limits<double>::epsilon();
constexpr std::array<double, 9> unturned{1, 0, 0, 0, 1, 0, 0, 0, 1};

double length_of(const double* x) { return std::hypot(x[0], x[1], x[2]); }

// The rotation vector of the least rotation from one direction to another.
std::array<double, 3> least_rotation(const double* from, const double* to) {
  std::array<double, 3> w{from[1] * to[2] - from[2] * to[1], from[2] * to[0] - from[0] * to[2],
                          from[0] * to[1] - from[1] * to[0]};
  const double sine = length_of(w.data()), cosine = from[0] * to[0] + from[1] * to[1] + from[2] * to[2];
  if (sine < 1e-12 && cosine < 0) { // half a turn, about any direction across: in the plane its normal
    std::size_t least = 2;
    for (std::size_t k = 0; k < 2; ++k)
      if (std::abs(from[k]) < std::abs(from[least])) least = k;
    for (std::size_t k = 0; k < 3; ++k) w[k] = (k == least ? 1 : 0) - from[least] * from[k];
    const double size = length_of(w.data());
    for (double& x : w) x *= std::numbers::pi / size;
    return w;
  }
  const double share = sine > 0 ? std::atan2(sine, cosine) / sine : 0;
  for (double& x : w) x *= share;
  return w;
}

// exp(w) r in place of a rotation r, kept one against rounding.
void turn(const double* w, double* r) {
  const double square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2], angle = std::sqrt(square);
  const double a = angle > 0 ? std::sin(angle) / angle : 1, half = 0.5 * angle;
  const double s = half > 0 ? std::sin(half) / half : 1, b = 0.5 * s * s;
  for (int c = 0; c < 3; ++c) {
    double* t = r + 3 * c;
    const double one[3] = {w[1] * t[2] - w[2] * t[1], w[2] * t[0] - w[0] * t[2], w[0] * t[1] - w[1] * t[0]};
    const double two[3] = {w[1] * one[2] - w[2] * one[1], w[2] * one[0] - w[0] * one[2], w[0] * one[1] - w[1] * one[0]};
    for (int k = 0; k < 3; ++k) t[k] += a * one[k] + b * two[k];
  }
  double square_of[9], was[9]; // r (3 - r' r)/2
  std::copy_n(r, 9, was);
  for (int i = 0; i < 9; ++i) {
    const double *x = was + 3 * (i % 3), *y = was + 3 * (i / 3);
    square_of[i] = (i % 4 == 0 ? 1.5 : 0.0) - 0.5 * (x[0] * y[0] + x[1] * y[1] + x[2] * y[2]);
  }
  for (int i = 0; i < 9; ++i) {
    r[i] = 0;
    for (int k = 0; k < 3; ++k) r[i] += was[3 * k + i % 3] * square_of[3 * (i / 3) + k];
  }
}

} // namespace

FrameModel::FrameModel(FrameCells cells) : of_(std::move(cells)) {
  const std::size_t n = count();
  for (std::size_t e = 0; e < n; ++e) {
    double d[3] = {};
    for (int k = 0; k < of_.dim; ++k)
      d[k] = of_.reference[std::size_t(of_.dim * of_.node[2 * e + 1] + k)] -
             of_.reference[std::size_t(of_.dim * of_.node[2 * e] + k)];
    if (!(length_of(d) > 0)) throw Error("cell " + std::to_string(e) + " has no length");
    d0_.insert(d0_.end(), d, d + 3);
  }
  const std::size_t forces = of_.beams ? 9 : 3;
  moved_.resize(3 * n);
  energy_.resize(n);
  fault_.resize(n);
  force_.resize(forces * n);
  tangent_.resize(forces * forces * n);
  u_.resize(of_.reference.size());
  if (of_.beams)
    take_beams();
  else
    begin_.resize(3 * n);
  for (std::size_t e = 0; e < n && !of_.beams; ++e) stiff_.push_back(of_.young[e] * of_.area[e]);
}

// Axes and stiffness of each, as bars_and_beams.f90 has them, with what a pull adds to bending (Przemieniecki 1968).
void FrameModel::take_beams() {
  const std::size_t n = count();
  const double up = length_of(of_.up.data());
  for (std::size_t e = 0; e < n; ++e) {
    const double size = length_of(&d0_[3 * e]);
    double along[3], second[3] = {-d0_[3 * e + 1] / size, d0_[3 * e] / size, 0}, part = 0;
    for (int k = 0; k < 3; ++k)
      along[k] = d0_[3 * e + std::size_t(k)] / size, part += along[k] * of_.up[std::size_t(k)];
    if (of_.dim == 3) {
      for (int k = 0; k < 3; ++k) second[k] = of_.up[std::size_t(k)] - part * along[k];
      const double across = length_of(second);
      if (!(across >= 1e-6 * up && up > 0))
        throw Error("up is along beam " + std::to_string(e) + ": give another direction");
      for (double& x : second) x /= across;
    }
    axes_.insert(axes_.end(), along, along + 3);
    axes_.insert(axes_.end(), second, second + 3);
    double third[3];
    cross(along, second, third);
    axes_.insert(axes_.end(), third, third + 3);
    stiff_.push_back(of_.young[e] * of_.area[e]);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double bend = of_.young[e] * of_.inertia[2 * e + axis], sheared = of_.shear[e] * of_.shear_area[e];
      const double soft = sheared > 0 ? 12 * bend / (sheared * size * size) : 0, unit = bend / (size * (1 + soft));
      stiff_.push_back((4 + soft) * unit + of_.pull[e] * size * 4 / 30);
      stiff_.push_back((2 - soft) * unit - of_.pull[e] * size / 30);
    }
    stiff_.push_back(of_.shear[e] * of_.torsion[e] / size);
  }
  ends_.resize(18 * n);
  take_rotations();
}

void FrameModel::take_rotations() {
  const std::size_t nodes = of_.reference.size() / std::size_t(of_.dim), each = of_.dim == 2 ? 1 : 3;
  unknown_.assign(nodes, -1);
  std::vector<std::uint8_t> turns(nodes, 0);
  for (const std::int32_t i : of_.node) turns[std::size_t(i)] = 1;
  for (const std::int32_t i : of_.clamped) turns[std::size_t(i)] = 0;
  for (std::size_t i = 0; i < nodes; ++i)
    if (turns[i]) unknown_[i] = std::int64_t(unknowns_), unknowns_ += each;
  for (std::size_t i = 0; i < nodes; ++i) turned_.insert(turned_.end(), unturned.begin(), unturned.end());
  turned_begin_ = turned_before_ = turned_;
  u_begin_.assign(of_.reference.size(), 0.0);
  guess_.resize(9 * nodes);
  mean_.resize(4 * nodes);
  from_.resize(3 * count());
  to_.resize(3 * count());
  weight_.assign(unknowns_, 0.0);
  std::vector<std::int64_t> start{0};
  std::vector<std::int32_t> all;
  for (std::size_t e = 0; e < count(); ++e) {
    for (std::size_t end = 0; end < 2; ++end) {
      const std::int64_t first = unknown_[std::size_t(of_.node[2 * e + end])];
      for (std::size_t k = 0; k < each && first >= 0; ++k) {
        all.push_back(std::int32_t(first + std::int64_t(k)));
        weight_[std::size_t(first) + k] += std::max({stiff_[6 * e + 1], stiff_[6 * e + 3], stiff_[6 * e + 5]});
      }
    }
    start.push_back(std::int64_t(all.size()));
  }
  turns_ = lower_pattern(std::int64_t(unknowns_), start, all);
  for (std::size_t e = 0; e < count(); ++e)
    for (std::size_t c = 0; c < 2 * each; ++c)
      for (std::size_t r = 0; r < 2 * each; ++r) {
        const std::int64_t row = unknown_[std::size_t(of_.node[2 * e + r / each])];
        const std::int64_t column = unknown_[std::size_t(of_.node[2 * e + c / each])];
        const std::int64_t i = row + std::int64_t(r % each), j = column + std::int64_t(c % each);
        turns_place_.push_back(row < 0 || column < 0 || i < j ? -1 : place_of(turns_, i, j));
      }
  moment_.resize(unknowns_);
  way_.resize(unknowns_);
  values_.resize(turns_.value.size());
  if (unknowns_ > 0) soe_ = Soe::make(turns_);
}

SparseMatrix FrameModel::lower() const {
  const auto dofs = std::int64_t(of_.reference.size());
  std::vector<std::int64_t> start{0};
  std::vector<std::int32_t> unknown;
  for (std::int32_t i = 0; of_.beams && i < dofs; ++i) unknown.push_back(i);
  if (of_.beams) start.push_back(dofs);
  for (std::size_t e = 0; !of_.beams && e < of_.node.size(); ++e) {
    for (int k = 0; k < of_.dim; ++k) unknown.push_back(of_.dim * of_.node[e] + k);
    if (e % 2 == 1) start.push_back(std::int64_t(unknown.size()));
  }
  return lower_pattern(dofs, start, unknown);
}

void FrameModel::stiffen(SparseMatrix& stiffness) const {
  const int dim = of_.dim;
  for (std::size_t e = 0; e < count(); ++e) {
    const double* d = &d0_[3 * e];
    const double size = length_of(d), rate = of_.young[e] * of_.area[e] / size;
    for (int c = 0; c < 2 * dim; ++c)
      for (int r = 0; r < 2 * dim; ++r) {
        const std::int64_t row = std::int64_t(dim) * of_.node[2 * e + std::size_t(r / dim)] + r % dim;
        const std::int64_t column = std::int64_t(dim) * of_.node[2 * e + std::size_t(c / dim)] + c % dim;
        if (row < column) continue;
        const double across = (r % dim == c % dim ? 1 : 0) - d[r % dim] / size * (d[c % dim] / size);
        stiffness.value[std::size_t(place_of(stiffness, row, column))] += (r / dim == c / dim ? rate : -rate) * across;
      }
  }
}

void FrameModel::fit(const SparseMatrix& lower) {
  const std::size_t dim = std::size_t(of_.dim), dofs = of_.reference.size();
  if (std::size_t(lower.n) != dofs) throw Error("the matrices of a frame have other dofs than its nodes");
  place_.clear();
  const auto take = [&](std::int64_t row, std::int64_t column) {
    place_.push_back(row < column ? -1 : place_of(lower, row, column));
    if (row >= column && place_.back() < 0) throw Error("the matrices of a frame do not hold what its cells couple");
  };
  if (of_.beams) {
    for (std::size_t c = 0; c < dofs; ++c)
      for (std::size_t r = c; r < dofs; ++r) take(std::int64_t(r), std::int64_t(c));
    mixed_.assign(dofs * unknowns_, 0.0);
    return;
  }
  for (std::size_t e = 0; e < count(); ++e)
    for (std::size_t c = 0; c < 2 * dim; ++c)
      for (std::size_t r = 0; r < 2 * dim; ++r)
        take(std::int64_t(dim) * of_.node[2 * e + r / dim] + std::int64_t(r % dim),
             std::int64_t(dim) * of_.node[2 * e + c / dim] + std::int64_t(c % dim));
}

void FrameModel::gather(const double* u) {
  for (std::size_t e = 0; e < count(); ++e)
    for (int k = 0; k < of_.dim; ++k)
      moved_[3 * e + std::size_t(k)] = u[of_.dim * of_.node[2 * e + 1] + k] - u[of_.dim * of_.node[2 * e] + k];
}

BulkResult FrameModel::kernel(bool tangents) {
  const auto n = std::int64_t(count());
  for (std::size_t e = 0; e < 2 * count(); ++e) std::copy_n(&turned_[9 * std::size_t(of_.node[e])], 9, &ends_[9 * e]);
  cairn_beams_moved(n, d0_.data(), axes_.data(), moved_.data(), ends_.data(), stiff_.data(), of_.pull.data(),
                    tangents ? 1 : 0, energy_.data(), force_.data(), tangent_.data(), fault_.data());
  BulkResult out;
  for (std::size_t e = 0; e < count(); ++e) {
    out.energy += energy_[e];
    if (fault_[e] == 0) continue;
    out.fault = fault_[e];
    out.cell = std::int64_t(e);
    break;
  }
  return out;
}

// Rotations of the begin of the step, turned with the beams at each node: by one after the other, which is all where
// they turned alike, and then on average.
void FrameModel::predict(const double* u) {
  constexpr int alone = 12, passes = 20;
  for (std::size_t e = 0; e < count(); ++e) {
    double *from = &from_[3 * e], *to = &to_[3 * e];
    for (std::size_t k = 0; k < 3; ++k) from[k] = to[k] = d0_[3 * e + k];
    for (int k = 0; k < of_.dim; ++k) {
      const std::int32_t one = of_.dim * of_.node[2 * e] + k, other = of_.dim * of_.node[2 * e + 1] + k;
      from[k] += u_begin_[std::size_t(other)] - u_begin_[std::size_t(one)];
      to[k] += u[other] - u[one];
    }
    const double was = length_of(from), is = length_of(to);
    for (std::size_t k = 0; k < 3; ++k) from[k] /= was, to[k] /= is;
  }
  for (std::size_t i = 0; i < unknown_.size(); ++i) std::copy(unturned.begin(), unturned.end(), &guess_[9 * i]);
  for (int pass = 0; pass < passes; ++pass) {
    double largest = 0;
    std::fill(mean_.begin(), mean_.end(), 0.0);
    for (std::size_t e = 0; e < 2 * count(); ++e) {
      const auto node = std::size_t(of_.node[e]);
      if (unknown_[node] < 0) continue;
      double* r = &guess_[9 * node];
      const double* f = &from_[3 * (e / 2)];
      double there[3];
      for (std::size_t k = 0; k < 3; ++k) there[k] = r[k] * f[0] + r[3 + k] * f[1] + r[6 + k] * f[2];
      const std::array<double, 3> w = least_rotation(there, &to_[3 * (e / 2)]);
      largest = std::max(largest, length_of(w.data()));
      if (pass < alone) {
        turn(w.data(), r);
        continue;
      }
      for (std::size_t k = 0; k < 3; ++k) mean_[4 * node + k] += w[k];
      mean_[4 * node + 3] += 1;
    }
    for (std::size_t i = 0; i < unknown_.size() && pass >= alone; ++i) {
      if (unknown_[i] < 0) continue;
      double* w = &mean_[4 * i];
      for (std::size_t k = 0; k < 3; ++k) w[k] /= w[3];
      turn(w, &guess_[9 * i]);
    }
    if (largest < 1e-6) break;
  }
  for (std::size_t i = 0; i < unknown_.size(); ++i) {
    if (unknown_[i] < 0) continue;
    const double *g = &guess_[9 * i], *was = &turned_begin_[9 * i];
    for (std::size_t k = 0; k < 9; ++k)
      turned_[9 * i + k] =
          g[k % 3] * was[k / 3 * 3] + g[3 + k % 3] * was[k / 3 * 3 + 1] + g[6 + k % 3] * was[k / 3 * 3 + 2];
  }
}

void FrameModel::add_moments() {
  const std::size_t each = of_.dim == 2 ? 1 : 3, first_axis = of_.dim == 2 ? 2 : 0;
  std::fill(moment_.begin(), moment_.end(), 0.0);
  std::fill(turns_.value.begin(), turns_.value.end(), 0.0);
  const std::int64_t* place = turns_place_.data();
  for (std::size_t e = 0; e < count(); ++e) {
    for (std::size_t end = 0; end < 2; ++end) {
      const std::int64_t first = unknown_[std::size_t(of_.node[2 * e + end])];
      for (std::size_t k = 0; k < each && first >= 0; ++k)
        moment_[std::size_t(first) + k] += force_[9 * e + 3 + 3 * end + first_axis + k];
    }
    for (std::size_t c = 0; c < 2 * each; ++c)
      for (std::size_t r = 0; r < 2 * each; ++r, ++place) {
        if (*place < 0) continue;
        const std::size_t row = 3 + 3 * (r / each) + first_axis + r % each,
                          column = 3 + 3 * (c / each) + first_axis + c % each;
        turns_.value[std::size_t(*place)] += tangent_[81 * e + 9 * column + row];
      }
  }
}

double FrameModel::left_of_moments() const {
  double most = 0;
  for (std::size_t i = 0; i < unknowns_; ++i) most = std::max(most, std::abs(moment_[i]) / weight_[i]);
  return most;
}

// Factors of moments by rotations, with a stiffness on top where there are none without it. In space a straight beam
// turns about itself against nothing, which no displacement shows.
bool FrameModel::factor_turns(double* shift) {
  for (*shift = of_.dim == 2 ? 0 : 1e-11; *shift < 1e3; *shift = std::max(1e-11, 30 * *shift)) {
    values_ = turns_.value;
    for (std::size_t i = 0; i < unknowns_; ++i) values_[std::size_t(turns_.start[i])] += *shift * weight_[i];
    if (soe_->factor(values_.data())) return true;
  }
  return false;
}

void FrameModel::turn_by(double share) {
  turned_ = turned_before_;
  for (std::size_t i = 0; i < unknown_.size(); ++i) {
    if (unknown_[i] < 0) continue;
    const double* by = &way_[std::size_t(unknown_[i])];
    const double w[3] = {of_.dim == 2 ? 0 : share * by[0], of_.dim == 2 ? 0 : share * by[1],
                         share * (of_.dim == 2 ? by[0] : by[2])};
    turn(w, &turned_[9 * i]);
  }
}

// Newton's method with a line search by the energy, until moments are rounding.
BulkResult FrameModel::find_rotations() {
  constexpr int most = 100, cuts = 40;
  constexpr double enough = 8 * rounding, small = 1e-11; // of a radian
  BulkResult at = kernel(true), stopped;                 // by a cell, where the last pass could not go
  double before = std::numeric_limits<double>::infinity();
  for (int pass = 0, cut = 0; at.ok() && pass < most && cut <= cuts; ++pass) {
    add_moments();
    const double left = left_of_moments();
    if (left <= enough || (left < small && !(left < 0.5 * before))) return at;
    before = left;
    double shift = 0, slope = 0, largest = 0, share = 1;
    if (!factor_turns(&shift)) break;
    for (std::size_t i = 0; i < unknowns_; ++i) way_[i] = -moment_[i];
    soe_->solve(way_.data());
    for (std::size_t i = 0; i < unknowns_; ++i) {
      slope += way_[i] * moment_[i];
      largest = std::max(largest, std::abs(way_[i]));
    }
    if (largest > 0.5) share = 0.5 / largest;
    turned_before_ = turned_;
    const double slack = 16 * rounding * at.energy; // far from the end energies tell, near to it the step is right
    stopped = {};
    for (cut = 0; cut <= cuts; ++cut, share /= 2) {
      turn_by(share);
      const BulkResult there = kernel(false);
      if (!there.ok()) stopped = there;
      if (there.ok() && (left < 1e-7 || there.energy <= at.energy + 1e-4 * share * slope + slack)) break;
    }
    at = kernel(true);
  }
  if (!at.ok()) return at;
  if (!stopped.ok()) return stopped;
  std::size_t worst = 0;
  for (std::size_t i = 0; i < unknowns_; ++i)
    if (std::abs(moment_[i]) * weight_[worst] > std::abs(moment_[worst]) * weight_[i]) worst = i;
  BulkResult out{no_balance, 0, -1, 0, 0};
  const std::int64_t each = of_.dim == 2 ? 1 : 3;
  for (std::size_t e = count(); e-- > 0;)
    for (std::size_t end = 0; end < 2; ++end)
      if (unknown_[std::size_t(of_.node[2 * e + end])] == std::int64_t(worst) / each * each) out.cell = std::int64_t(e);
  return out;
}

BulkResult FrameModel::evaluate(const MeshMotion& at, double* force, double* tangent) {
  const std::size_t dofs = of_.reference.size(), each = of_.beams ? 9 : 3;
  BulkResult out;
  gather(at.u);
  std::copy_n(at.u, dofs, u_.begin());
  if (of_.beams) {
    for (std::size_t e = 0; e < count(); ++e) {
      double d[3];
      for (std::size_t k = 0; k < 3; ++k) d[k] = d0_[3 * e + k] + moved_[3 * e + k];
      if (const double size = length_of(d); !(size > 0) || !std::isfinite(size))
        return {no_length, std::int64_t(e), -1, 0, 0};
    }
    turned_ = turned_begin_;
    predict(at.u);
    out = find_rotations();
    if (!out.ok()) { // as they were may be nearer
      turned_ = turned_begin_;
      if (const BulkResult again = find_rotations(); again.ok()) out = again;
    }
  } else {
    if (at.begin) {
      moved_.swap(begin_);
      gather(at.begin);
      moved_.swap(begin_);
    }
    cairn_bars_moved(std::int64_t(count()), std::int32_t(of_.kinematics), d0_.data(), moved_.data(), begin_.data(),
                     at.begin ? 1 : 0, stiff_.data(), of_.pull.data(), energy_.data(), force_.data(), tangent_.data(),
                     fault_.data());
    for (std::size_t e = 0; e < count() && out.ok(); ++e) {
      out.energy += energy_[e];
      if (fault_[e] != 0) out = {fault_[e], std::int64_t(e), -1, 0, 0};
    }
  }
  if (out.ok() && !std::isfinite(out.energy)) {
    auto worst = std::find_if(energy_.begin(), energy_.end(), [](double e) { return !std::isfinite(e); });
    if (worst == energy_.end()) worst = std::max_element(energy_.begin(), energy_.end());
    out = {endless, worst - energy_.begin(), -1, 0, 0};
  }
  if (!out.ok()) return out;
  std::fill_n(force, dofs, 0.0);
  for (std::size_t e = 0; e < count(); ++e)
    for (int k = 0; k < of_.dim; ++k) {
      force[of_.dim * of_.node[2 * e] + k] -= force_[each * e + std::size_t(k)];
      force[of_.dim * of_.node[2 * e + 1] + k] += force_[each * e + std::size_t(k)];
    }
  if (tangent) add_tangent(tangent);
  return out;
}

// Adds the tangent by static condensation of the rotations: K_uu - K_ur K_rr^-1 K_ru.
void FrameModel::add_tangent(double* tangent) {
  const std::size_t dim = std::size_t(of_.dim), each = of_.beams ? 9 : 3, dofs = of_.reference.size();
  const std::size_t turns = dim == 2 ? 1 : 3, first_axis = dim == 2 ? 2 : 0;
  const auto sign = [](std::size_t r, std::size_t c) { return r == c ? 1.0 : -1.0; };
  const std::int64_t* place = place_.data();
  const auto at = [&](std::size_t row, std::size_t column) { // of a full triangle
    return place_[column * dofs - column * (column + 1) / 2 + row];
  };
  if (of_.beams) std::fill(mixed_.begin(), mixed_.end(), 0.0);
  for (std::size_t e = 0; e < count(); ++e) {
    const double* k = &tangent_[each * each * e];
    for (std::size_t c = 0; c < 2 * dim; ++c) {
      const std::size_t column = dim * std::size_t(of_.node[2 * e + c / dim]) + c % dim;
      for (std::size_t r = 0; r < 2 * dim; ++r) {
        const std::size_t row = dim * std::size_t(of_.node[2 * e + r / dim]) + r % dim;
        const std::int64_t there = of_.beams ? (row < column ? -1 : at(row, column)) : *place++;
        if (there >= 0) tangent[there] += sign(r / dim, c / dim) * k[each * (c % dim) + r % dim];
      }
      for (std::size_t t = 0; of_.beams && t < 2 * turns; ++t) {
        const std::int64_t first = unknown_[std::size_t(of_.node[2 * e + t / turns])];
        if (first >= 0)
          mixed_[unknowns_ * column + std::size_t(first) + t % turns] +=
              sign(c / dim, 1) * k[9 * (c % dim) + 3 + 3 * (t / turns) + first_axis + t % turns];
      }
    }
  }
  double shift = 0;
  if (!of_.beams || unknowns_ == 0 || !factor_turns(&shift)) return;
  followed_ = mixed_;
  soe_->solve(followed_.data(), std::int64_t(dofs));
  for (std::size_t row = 0; row < dofs; ++row)
    for (std::size_t t = 0; t < unknowns_; ++t) {
      const double by = mixed_[unknowns_ * row + t];
      if (std::abs(by) > 0)
        for (std::size_t column = 0; column <= row; ++column)
          tangent[at(row, column)] -= by * followed_[unknowns_ * column + t];
    }
}

void FrameModel::commit() {
  if (!of_.beams) return;
  turned_begin_ = turned_;
  u_begin_ = u_;
}

std::string FrameModel::describe(const BulkResult& r) const {
  const auto e = std::size_t(std::max<std::int64_t>(r.cell, 0));
  std::string text = (of_.beams ? "beam " : "bar ") + std::to_string(e) + " with nodes " +
                     std::to_string(of_.node[2 * e]) + " " + std::to_string(of_.node[2 * e + 1]) + ": ";
  if (r.fault == no_length) return text + "it has no length, or its ends are not at finite places";
  if (r.fault == turned_back) return text + "an end is turned by nearly half a turn against it";
  if (r.fault == endless) return text + "its energy is beyond the range of numbers";
  return text + "rotations are not found under which no moments are left at its ends";
}

std::string FrameModel::place_of_node(std::int64_t node) const {
  std::string text = "node " + std::to_string(node);
  const auto first = std::find(of_.node.begin(), of_.node.end(), node);
  if (first != of_.node.end())
    text += (of_.beams ? ", beam " : ", bar ") + std::to_string((first - of_.node.begin()) / 2);
  return text;
}

std::string FrameModel::not_by_energy(const std::string& name) const {
  return of_.beams ? "the rotations of the beams of the mesh '" + name + "' are where no moment is left at one place"
                   : "";
}

std::int64_t FrameModel::history_size() const { return std::int64_t(turned_begin_.size() + u_begin_.size()); }

std::vector<double> FrameModel::history() const {
  std::vector<double> out = turned_begin_;
  out.insert(out.end(), u_begin_.begin(), u_begin_.end());
  return out;
}

void FrameModel::take_history(std::span<const double> history) {
  std::copy_n(history.begin(), turned_begin_.size(), turned_begin_.begin());
  std::copy_n(history.begin() + std::ptrdiff_t(turned_begin_.size()), u_begin_.size(), u_begin_.begin());
  turned_ = turned_begin_;
}

void FrameModel::forget_history() {
  for (std::size_t i = 0; i < turned_begin_.size(); ++i) turned_begin_[i] = unturned[i % 9];
  std::fill(u_begin_.begin(), u_begin_.end(), 0.0);
  turned_ = turned_begin_;
}

std::shared_ptr<InternalForces> FrameModel::another() {
  auto made = std::make_shared<FrameModel>(of_);
  made->place_ = place_;
  made->mixed_ = mixed_;
  return made;
}

std::int64_t FrameModel::bytes() const {
  std::size_t sum = soe_ ? std::size_t(soe_->bytes()) : 0;
  for (const std::vector<double>* v : {&d0_, &axes_, &stiff_, &moved_, &ends_, &energy_, &force_, &tangent_, &begin_,
                                       &turned_, &turned_begin_, &turned_before_, &values_, &mixed_, &followed_})
    sum += 8 * v->capacity();
  return std::int64_t(sum + 8 * (place_.capacity() + turns_place_.capacity()));
}

} // namespace cairn
