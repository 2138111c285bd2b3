// Stresses that a body has before it moves: the stretch at which its law has them, found once, and what the law sees
// from then on. A user's routine gets them as its stress at the begin of its first step instead.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "../base/call.hpp"
#include "bulk_work.hpp"
#include "umat.hpp"

namespace cairn {

std::string BulkModel::describe_stress(std::size_t block, std::int64_t point) const {
  const BulkCells& c = cells_[block];
  std::string text;
  for (int k = 0; k < 6; ++k) {
    char number[32];
    std::snprintf(number, sizeof number, "%s%g", k > 0 ? ", " : "", c.initial_stress[std::size_t(6 * point + k)]);
    text += number;
  }
  return "initial_stress of " + std::string(c.element->cell) + " cell " +
         std::to_string(point / c.element->bulk_points) + " is (" + text + ") Pa, 11 22 33 12 13 23";
}

// Throws Error unless the initial stress has six finite numbers for each point, and no component that a mesh in the
// plane cannot have.
void BulkModel::check_initial_stress(std::size_t block) const {
  const BulkCells& c = cells_[block];
  const std::int64_t points = c.count() * c.element->bulk_points;
  if (std::int64_t(c.initial_stress.size()) != 6 * points)
    throw Error("initial_stress of the " + std::string(c.element->cell) + " cells holds " +
                std::to_string(c.initial_stress.size()) + " numbers: give 6 for each of the " +
                std::to_string(c.element->bulk_points) + " points of each of the " + std::to_string(c.count()) +
                " cells");
  const auto there = [](double x) { return x < 0 || x > 0; };
  for (std::int64_t p = 0; p < points; ++p) {
    const double* s = &c.initial_stress[std::size_t(6 * p)];
    if (!std::all_of(s, s + 6, [](double x) { return std::isfinite(x); }))
      throw Error(describe_stress(block, p) + ": give finite numbers");
    if (dim_ == 2 && (there(s[4]) || there(s[5])))
      throw Error(describe_stress(block, p) + ": in the plane give 0 for 13 and 23");
    if (dim_ == 2 && c.plane == Plane::stress && there(s[2]))
      throw Error(describe_stress(block, p) + ": in plane stress give 0 for 33");
  }
}

void BulkModel::start_from_stress(std::size_t block) {
  check_initial_stress(block);
  const BulkCells& c = cells_[block];
  Block& b = blocks_[block];
  const std::int64_t points = c.count() * c.element->bulk_points;
  constexpr int ours[6] = {0, 1, 2, 3, 5, 4}; // 23 stands before 13 in ours
  for (std::int64_t p = 0; p < points; ++p)
    for (int k = 0; k < 6; ++k)
      stress_[std::size_t(b.first_stress + 6 * p + ours[k])] = c.initial_stress[std::size_t(6 * p + k)];
  if (c.material->umat) {
    for (std::int64_t p = 0; p < points; ++p)
      std::copy_n(&c.initial_stress[std::size_t(6 * p)], 6, &state_begin_[std::size_t(b.first_state + p * b.states)]);
    state_ = state_begin_;
    return;
  }
  b.stretch.assign(std::size_t(9 * points), 0.0);
  Work w;
  w.resize(dim_, *c.element, b.states, linear_dilatation(c));
  for (std::int64_t first = 0; first < c.count(); first += bulk_tile)
    find_stretches(block, first, std::min(bulk_tile, c.count() - first), w);
  state_begin_ = state_; // of a law that keeps a strain or a rate: it was strained before, and not by now
}

// Rounding error of a stress at a point [Pa]. At large strains the law sees F, with entries of order 1 however small
// the stress; at small strains it sees the strain alone.
static double rounding_of_law(bool large, const double* tangent, const double* stretch) {
  const auto largest = [](const double* of, int n) {
    double size = 0;
    for (int k = 0; k < n; ++k) size = std::max(size, std::abs(of[k]));
    return size;
  };
  constexpr double operations = 64; // that round, one upon the other
  const double strain = largest(stretch, 9);
  return operations * std::numeric_limits<double>::epsilon() * largest(tangent, 81) * (large ? 1 + strain : strain);
}

// Newton's method, at the points of some cells, for the law as it is after an endless time.
void BulkModel::find_stretches(std::size_t block, std::int64_t first, std::int64_t n, Work& w) {
  const BulkCells& c = cells_[block];
  Block& b = blocks_[block];
  const std::int64_t points = n * c.element->bulk_points, start = first * c.element->bulk_points;
  const bool large = c.kinematics != Kinematics::small;
  const std::vector<double> still(place_.size(), 0.0);
  const double* asked = &c.initial_stress[std::size_t(6 * start)];
  double* stretch = &b.stretch[std::size_t(9 * start)];
  std::fill_n(w.status.data(), points, 0);
  gather(block, first, n, still.data(), w);
  if (!find_gradients(block, n, w)) return; // the first evaluation tells which cell it is
  const auto refuse = [&](std::int64_t p) {
    throw Error(describe_stress(block, start + p) + ", which " + c.material->python_name +
                " does not bear as it is, without yield, damage or collapse: give a smaller stress or a stronger "
                "material");
  };
  double scale = 0;
  for (const double part : c.initial_stress) scale = std::max(scale, std::abs(part));
  constexpr int most = 60;
  std::vector<double> left(std::size_t(points), 0.0),
      least(std::size_t(points), std::numeric_limits<double>::infinity()), at;
  bool settled = false;
  for (int pass = 0; !settled; ++pass) {
    at.assign(stretch, stretch + 9 * points);
    std::copy(at.begin(), at.end(), w.h_bar.data());
    law_at_points(block, first, n, std::numeric_limits<double>::infinity(), 1, true, w);
    cairn_stretch_of_stress(large, points, asked, w.piola.data(), w.tangent.data(), stretch, left.data());
    settled = true;
    for (std::size_t p = 0; p < left.size(); ++p) {
      double own = 0;
      for (std::size_t k = 6 * p; k < 6 * p + 6; ++k) own = std::max(own, std::abs(asked[k]));
      const double enough = std::max(1e-12 * own, rounding_of_law(large, &w.tangent[81 * p], &at[9 * p]));
      const bool near = left[p] >= 0 && left[p] <= enough;
      if (w.status[p] != 0 || !(left[p] >= 0) || (pass == most && !near)) refuse(std::int64_t(p));
      settled = settled && near && (pass == most || !(left[p] < least[p] / 2)); // until rounding alone is left
      least[p] = std::min(least[p], left[p]);
    }
  }
  std::copy(at.begin(), at.end(), stretch); // that of the states at hand
  for (std::size_t p = 0; p < left.size(); ++p) {
    if (left[p] <= 1e-3 * scale) continue; // of its block: a field of stress may pass through zero
    char rest[32];
    std::snprintf(rest, sizeof rest, "%.2g", left[p]);
    throw Error(describe_stress(block, start + std::int64_t(p)) + ", which " + c.material->python_name +
                " cannot tell from none: its stiffness rounds its stresses by " + rest +
                " Pa, more than a thousandth of the largest that is given; give a larger stress or none, or "
                "kinematics='small' with a law of small strains");
  }
  for (std::size_t k = 0; k < c.material->state.size(); ++k) {
    if (c.material->state[k] != "accumulated_plastic_strain" && c.material->state[k] != "damage") continue;
    for (std::int64_t p = 0; p < points; ++p)
      if (state_[std::size_t(b.first_state + (start + p) * b.states) + k] > 0) refuse(p);
  }
}

// Stress from the gradients in h_bar, relative to the prestressed body at the start; the law sees them multiplied by
// its initial stretch.
void BulkModel::from_start_at_points(std::size_t block, std::int64_t first, std::int64_t n, double h, double theta,
                                     bool want, Work& w) {
  const Block& b = blocks_[block];
  if (b.stretch.empty()) return material_at_points(block, first, n, h, theta, want, w);
  const BulkCells& c = cells_[block];
  const bool large = c.kinematics != Kinematics::small;
  const std::int64_t points = n * c.element->bulk_points;
  const double* stretch = &b.stretch[std::size_t(9 * first * c.element->bulk_points)];
  w.apart.resize(std::max(w.apart.size(), std::size_t(9 * points)));
  std::copy_n(w.h_bar.data(), 9 * points, w.apart.data());
  cairn_with_prestretch(large, points, stretch, w.h_bar.data());
  material_at_points(block, first, n, h, theta, want, w);
  cairn_without_prestretch(large, points, stretch, w.piola.data(), want, w.tangent.data(), w.energy.data(),
                           w.dissipated.data());
  for (std::int64_t p = 0; p < points && dim_ == 2 && c.plane == Plane::stress; ++p) { // found across the thickness
    const double before = stretch[9 * p + 8];
    w.apart[std::size_t(9 * p + 8)] = (w.h_bar[std::size_t(9 * p + 8)] - before) / (large ? 1 + before : 1);
  }
  std::copy_n(w.apart.data(), 9 * points, w.h_bar.data());
}

} // namespace cairn
