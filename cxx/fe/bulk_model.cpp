#include "bulk_model.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <numeric>

#include "../base/call.hpp"
#include "bulk_work.hpp"

namespace cairn {
namespace {

constexpr std::int64_t lanes = 8;              // cells that cairn_linear_cells takes side by side
constexpr std::int64_t chunk = 16 * bulk_tile; // cells that threads share before their matrices are added

// True if the stiffness is that of Hooke's isotropic law at any displacement.
bool is_linear(const BulkCells& c) {
  return c.kinematics == Kinematics::small && !c.mean_dilatation && c.material->name == "isotropic_elastic" &&
         !(c.element->dim == 2 && c.plane == Plane::axisymmetric);
}

// Where entry (i, j) of the block of two nodes stands, from that of (0, 0) in the first column of the earlier node,
// `wide` entries long: each further column begins one row later. A node's own block is a lower triangle.
constexpr std::int64_t entry_of(std::int64_t at, std::int64_t wide, int i, int j) {
  return at + j * wide - j * (j - 1) / 2 + i - j;
}

template <int dim>
void gather_nodes(const std::int32_t* node, std::size_t n, const double* place, const double* u, double* x,
                  double* moved) {
  for (std::size_t a = 0; a < n; ++a) {
    const std::size_t at = dim * std::size_t(node[a]);
    for (std::size_t k = 0; k < dim; ++k) {
      x[dim * a + k] = place[at + k];
      moved[dim * a + k] = u[at + k];
    }
  }
}

template <int dim>
void scatter_nodes(const std::int32_t* node, std::size_t n, const double* force, double* to) {
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t k = 0; k < dim; ++k) to[dim * std::size_t(node[a]) + k] += force[dim * a + k];
}

} // namespace

// Entries of a matrix are found by pairs of nodes, which a cell names once each.
static void refuse_repeated_nodes(const BulkCells& c) {
  const std::size_t size = std::size_t(c.element->nodes);
  for (std::size_t first = 0; first + size <= c.node.size(); first += size)
    for (std::size_t a = 1; a < size; ++a)
      if (std::find(&c.node[first], &c.node[first + a], c.node[first + a]) != &c.node[first + a])
        throw Error(std::string(c.element->cell) + " cell " + std::to_string(first / size) + " names node " +
                    std::to_string(c.node[first + a]) + " twice: give a cell of fewer nodes, such as a triangle");
}

BulkModel::BulkModel(int dim, std::vector<double> place, std::vector<BulkCells> cells)
    : dim_(dim), place_(std::move(place)), cells_(std::move(cells)) {
  std::int64_t states = 0, stresses = 0;
  for (const BulkCells& c : cells_) {
    const ElementInfo& e = *c.element;
    if (e.dim != dim) throw Error(std::string(e.name) + " cells do not fit the dimensions of the mesh");
    refuse_repeated_nodes(c);
    if (c.mean_dilatation && (dim == 2 && c.plane == Plane::stress))
      throw Error("mean dilatation has no use in plane stress: leave it out");
    if (c.mean_dilatation && e.bulk_points == 1)
      throw Error("mean dilatation changes nothing in " + std::string(e.cell) +
                  " cells, which have one dilatation each as they are: give " +
                  (dim == 2 ? "quad or triangle6 cells (Q4, T6), or split each triangle into three quads"
                            : "hexahedron or tetra10 cells (HEX8, TET10), or split each tetra into four hexahedra") +
                  ", or leave it out");
    if (c.material->takes_gradient && c.kinematics != Kinematics::total_lagrangian)
      throw Error(c.material->python_name + " is for large strains: give kinematics='total_lagrangian'");
    if (c.material->plane_stress && !(dim == 2 && c.plane == Plane::stress))
      throw Error(
          c.material->python_name +
          " is a routine for plane stress, NDI = 2: give plane='stress' to a body in two dimensions, or a routine "
          "that is plugged without plane='stress'");
    Block b;
    b.value.resize(std::size_t(e.nodes * e.bulk_points));
    b.gradient.resize(b.value.size() * std::size_t(dim));
    b.weight.resize(std::size_t(e.bulk_points));
    std::vector<double> xi(std::size_t(dim * e.bulk_points));
    e.bulk_rule(xi.data(), b.weight.data());
    for (int p = 0; p < e.bulk_points; ++p)
      e.shape(&xi[p * dim], &b.value[p * e.nodes], &b.gradient[p * dim * e.nodes]);
    b.states = int(c.material->state.size());
    b.silent = c.material->umat != nullptr;
    b.first_state = states;
    b.first_stress = stresses;
    states += c.count() * e.bulk_points * b.states;
    stresses += c.count() * e.bulk_points * 6;
    blocks_.push_back(std::move(b));
  }
  state_begin_.assign(std::size_t(states), 0.0);
  state_ = state_begin_;
  stress_.assign(std::size_t(stresses), 0.0);
  for (std::size_t k = 0; k < cells_.size(); ++k)
    if (!cells_[k].initial_stress.empty()) start_from_stress(k), state_start_ = state_begin_;
}

std::vector<double> BulkModel::state_at_start() const {
  return state_start_.empty() ? std::vector<double>(state_begin_.size(), 0.0) : state_start_;
}

BulkModel::~BulkModel() = default;

void BulkModel::fit(const SparseMatrix& lower) {
  const std::int64_t nodes = std::int64_t(place_.size()) / dim_;
  wide_.resize(std::size_t(nodes));
  for (std::int64_t n = 0; n < nodes; ++n)
    wide_[std::size_t(n)] = std::int32_t(lower.start[std::size_t(dim_ * n + 1)] - lower.start[std::size_t(dim_ * n)]);
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    const BulkCells& c = cells_[k];
    const int size = c.element->nodes;
    std::vector<std::int32_t>& entry = blocks_[k].entry;
    entry.clear();
    entry.reserve(std::size_t(c.count()) * std::size_t(size * (size + 1) / 2));
    for (std::int64_t cell = 0; cell < c.count(); ++cell) {
      const std::int32_t* node = &c.node[std::size_t(cell * size)];
      for (int b = 0; b < size; ++b)
        for (int a = b; a < size; ++a) {
          const std::int64_t late = std::max(node[a], node[b]), early = std::min(node[a], node[b]);
          const std::int64_t at = place_of(lower, dim_ * late, dim_ * early);
          for (int j = 0; j < dim_; ++j)
            for (int i = late == early ? j : 0; i < dim_; ++i)
              if (place_of(lower, dim_ * late + i, dim_ * early + j) != entry_of(at, wide_[std::size_t(early)], i, j))
                throw Error("the pattern of a matrix does not hold the dofs of nodes " + std::to_string(early) +
                            " and " + std::to_string(late) + " side by side: give that of all dofs of each cell");
          entry.push_back(std::int32_t(node[a] < node[b] ? -1 - at : at));
        }
    }
  }
}

void BulkModel::fit_once(std::span<const std::int64_t> start, std::span<const std::int32_t> row) {
  if (std::equal(start.begin(), start.end(), start_.begin(), start_.end()) &&
      std::equal(row.begin(), row.end(), row_.begin(), row_.end()))
    return;
  start_.clear(); // places found before are gone, whatever becomes of this pattern
  row_.clear();
  if (std::int64_t(start.size()) != std::int64_t(place_.size()) + 1)
    throw Error("start has " + std::to_string(start.size()) + " numbers: give one for each dof and one more, " +
                std::to_string(place_.size() + 1));
  SparseMatrix lower;
  lower.n = std::int64_t(place_.size());
  lower.start.assign(start.begin(), start.end());
  lower.row.assign(row.begin(), row.end());
  fit(lower);
  start_.swap(lower.start);
  row_.swap(lower.row);
}

// Stress from the displacement gradients in h_bar; where nodes swell the material sees the remainder beyond that.
void BulkModel::stresses_at_points(std::size_t block, std::int64_t first, std::int64_t n, double h, double theta,
                                   bool want, Work& w) {
  if (swelling.empty()) return from_start_at_points(block, first, n, h, theta, want, w);
  const bool large = cells_[block].kinematics != Kinematics::small;
  const std::int64_t points = n * cells_[block].element->bulk_points;
  cairn_without_swelling(large, points, w.swelling.data(), w.h_bar.data());
  from_start_at_points(block, first, n, h, theta, want, w);
  cairn_with_swelling(large, points, w.swelling.data(), w.h_bar.data(), w.piola.data(), want, w.tangent.data(),
                      w.energy.data(), w.dissipated.data());
}

// Calls the law for the gradients in h_bar.
void BulkModel::law_at_points(std::size_t block, std::int64_t first, std::int64_t n, double h, double theta, bool want,
                              Work& w) {
  const BulkCells& c = cells_[block];
  const Block& b = blocks_[block];
  const std::int64_t points = n * c.element->bulk_points, start = first * c.element->bulk_points;
  if (c.material->umat && c.kinematics != Kinematics::small) return rates_at_points(block, first, n, h, want, w);
  const bool measured = !c.material->takes_gradient;
  const double* measure = w.h_bar.data();
  if (measured) {
    cairn_strain_measure(std::int32_t(c.kinematics), points, w.h_bar.data(), w.strain.data(), w.status.data());
    measure = w.strain.data();
  }
  double* stress = measured ? w.stress.data() : w.piola.data();
  double* tangent = measured ? w.moduli.data() : w.tangent.data();
  if (c.material->umat)
    call_umat(block, first, n, h, w);
  else if (one_damage(block))
    damage_cells(block, first, n, w);
  else
    c.material->kernel(points, h, theta, c.params.data(), w.length.data(), measure,
                       state_begin_.data() + b.first_state + start * b.states,
                       state_.data() + b.first_state + start * b.states, stress, tangent, w.energy.data(),
                       w.dissipated.data(), w.status.data());
  if (measured)
    cairn_stress_of_measure(std::int32_t(c.kinematics), points, w.h_bar.data(), stress, tangent, want, w.piola.data(),
                            w.tangent.data());
}

namespace {

// Safeguards Newton's method for the strain across the thickness: where an iterate leaves the bracket between a
// compressed and a stretched one, or convergence is slow, it takes the middle of the bracket. Otherwise laws whose
// slope jumps at yield would make it oscillate.
void keep_between(int pass, std::int64_t points, const double* stress, double* strain, BulkAcross& a) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  constexpr int quick = 10;
  for (std::int64_t p = 0; p < points; ++p) {
    double &now = strain[9 * p], &low = a.pressed[std::size_t(p)], &high = a.pulled[std::size_t(p)];
    const double before = a.before[std::size_t(p)];
    if (pass == 0) low = -infinity, high = infinity;
    if (!(now < before || now > before)) continue;
    const bool thicker = stress[9 * p] < 0;
    (thicker ? low : high) = before;
    if (!std::isfinite(low) || !std::isfinite(high)) { // twice or half as thick where the slope leads the other way
      if (thicker ? now < before : now > before) now = thicker ? 2 * before + 1 : 0.5 * (before - 1);
      continue;
    }
    if (!(now > low && now < high) || (pass > quick && pass % 2 == 0)) now = low + 0.5 * (high - low);
  }
}

// Stresses across, of points and of their slopes, that the rounding of the thickness makes are none: laws of F have no
// smaller ones where strains are small.
void drop_rounding(std::int64_t points, const double* tangent, const double* strain, double* stress) {
  constexpr double few = 16 * std::numeric_limits<double>::epsilon();
  for (std::int64_t p = 0; p < points; ++p)
    if (std::abs(stress[9 * p]) <= few * std::abs(tangent[81 * p]) * (1 + std::abs(strain[9 * p]))) stress[9 * p] = 0;
}

} // namespace

// The same, where no stress acts across the thickness of plane stress: the strain there is sought by the tangent.
void BulkModel::material_at_points(std::size_t block, std::int64_t first, std::int64_t n, double h, double theta,
                                   bool want, Work& w) {
  const bool flat = dim_ == 2 && cells_[block].plane == Plane::stress;
  const std::int64_t points = n * cells_[block].element->bulk_points;
  if (cells_[block].material->plane_stress) {
    keep_volume(points, w);
    return law_at_points(block, first, n, h, theta, want, w);
  }
  if (flat && cells_[block].material->umat) start_from_thickness(block, first, n, w);
  law_at_points(block, first, n, h, theta, want || flat, w);
  if (!flat) return;
  constexpr int most = 40, soon = 6; // passes, and those in which Newton's method ends where numbers let it
  for (int pass = 0; pass < most; ++pass) {
    std::int64_t left = 0;
    for (std::int64_t p = 0; p < points; ++p) w.across.before[std::size_t(p)] = w.h_bar[std::size_t(9 * p + 8)];
    if (pass >= soon) drop_rounding(points, w.tangent.data() + 80, w.h_bar.data() + 8, w.piola.data() + 8);
    cairn_thickness_strain(points, w.piola.data(), w.tangent.data(), w.h_bar.data(), &left);
    if (left == 0) return;
    keep_between(pass, points, w.piola.data() + 8, w.h_bar.data() + 8, w.across);
    law_at_points(block, first, n, h, theta, true, w);
  }
  for (std::int64_t p = 0; p < points; ++p)
    if (w.status[p] == 0) w.status[p] = 2;
}

// At the points of cells. Those of first order have one for all of their points, as a strain without stress asks of
// them: theirs does not vary as that of a field of temperatures that does.
void BulkModel::find_swelling(std::size_t block, std::int64_t first, std::int64_t n, Work& w) const {
  const BulkCells& c = cells_[block];
  const Block& b = blocks_[block];
  const ElementInfo& e = *c.element;
  for (std::int64_t cell = 0; cell < n; ++cell) {
    const std::int32_t* node = &c.node[std::size_t((first + cell) * e.nodes)];
    for (int p = 0; p < e.bulk_points; ++p) {
      double sum = 0;
      for (int a = 0; a < e.nodes; ++a)
        sum += (e.order > 1 ? b.value[std::size_t(p * e.nodes + a)] : 1.0 / e.nodes) * swelling[std::size_t(node[a])];
      w.swelling[std::size_t(cell * e.bulk_points + p)] = sum;
    }
  }
}

void BulkModel::gather(std::size_t block, std::int64_t first, std::int64_t n, const double* u, Work& w) const {
  const BulkCells& c = cells_[block];
  const int nodes = c.element->nodes;
  const auto corners = std::size_t(n * nodes);
  const std::int32_t* node = &c.node[std::size_t(first * nodes)];
  dim_ == 2 ? gather_nodes<2>(node, corners, place_.data(), u, w.x.data(), w.u.data())
            : gather_nodes<3>(node, corners, place_.data(), u, w.x.data(), w.u.data());
}

namespace {

// One over the way round the axis at a point, by its shape functions over the radius.
double of_round(const double* hoop, int nodes) {
  return std::accumulate(hoop, hoop + nodes, 0.0) / (2 * std::numbers::pi);
}

} // namespace

// Gradients of the displacements that were gathered; whether all volumes are positive.
bool BulkModel::find_gradients(std::size_t block, std::int64_t n, Work& w) {
  const BulkCells& c = cells_[block];
  const Block& b = blocks_[block];
  const ElementInfo& e = *c.element;
  const std::int64_t points = n * e.bulk_points;
  const bool round = dim_ == 2 && c.plane == Plane::axisymmetric;
  const double thickness = dim_ == 2 && !round ? c.thickness : 1;
  cairn_solid_gradients(dim_, dim_ == 2 ? std::int32_t(c.plane) : 0, mean_of(c), e.nodes, e.bulk_points, b.value.data(),
                        b.gradient.data(), b.weight.data(), thickness, n, w.x.data(), w.u.data(), w.d.data(),
                        w.hoop.data(), w.h.data(), w.h_bar.data(), w.volume.data(), w.share.data(), w.status.data());
  // A crack softens all cells of one damage that a square or cube is cut into: two triangles, six tetrahedra.
  const bool simplex = e.nodes == dim_ + 1 || (e.nodes == (dim_ + 1) * (dim_ + 2) / 2 && one_damage(block));
  const int cells = simplex ? (dim_ == 2 ? 2 : 6) : 1;
  for (std::int64_t cell = 0; cell < n; ++cell) {
    double volume = 0; // of an axisymmetric cell its area, which does not go round
    for (int p = 0; p < e.bulk_points; ++p) {
      const auto at = std::size_t(cell * e.bulk_points + p);
      volume += w.volume[at] * (round ? of_round(&w.hoop[at * std::size_t(e.nodes)], e.nodes) : 1.0);
    }
    const double length = dim_ == 2 ? std::sqrt(cells * volume / thickness) : std::cbrt(cells * volume);
    for (int p = 0; p < e.bulk_points; ++p) w.length[std::size_t(cell * e.bulk_points + p)] = length;
  }
  return std::all_of(w.status.data(), w.status.data() + points, [](std::int32_t s) { return s == 0; });
}

// Stress by a discrete gradient for cells with known gradients at the end: energies at both ends, then the stress and
// its derivative over the step. Where strains are small it is that of their mean.
void BulkModel::stresses_by_energy(std::size_t block, std::int64_t first, std::int64_t n, const Step& step, Work& w) {
  const std::int64_t points = n * cells_[block].element->bulk_points;
  const auto size = std::size_t(points);
  const auto good = [&] {
    return std::all_of(w.status.data(), w.status.data() + points, [](std::int32_t s) { return s == 0; });
  };
  std::copy_n(w.h_bar.data(), 9 * size, w.end.data());
  gather(block, first, n, step.begin, w);
  if (!find_gradients(block, n, w)) return;
  std::copy_n(w.h_bar.data(), 9 * size, w.begin.data());
  stresses_at_points(block, first, n, step.h, step.theta, false, w);
  std::copy_n(w.energy.data(), size, w.energy_begin.data());
  std::copy_n(w.end.data(), 9 * size, w.h_bar.data());
  stresses_at_points(block, first, n, step.h, step.theta, false, w);
  if (!good()) return;
  const bool small = cells_[block].kinematics == Kinematics::small;
  cairn_true_stress(!small, points, w.h_bar.data(), w.piola.data(),
                    stress_.data() + blocks_[block].first_stress + 6 * first * cells_[block].element->bulk_points);
  std::copy_n(w.energy.data(), size, w.energy_end.data());
  if (small)
    for (std::size_t i = 0; i < 9 * size; ++i) w.h_bar[i] = 0.5 * (w.begin[i] + w.end[i]);
  else
    cairn_middle_stretch(points, w.begin.data(), w.end.data(), w.h_bar.data());
  stresses_at_points(block, first, n, step.h, step.theta, step.want, w);
  if (!small)
    cairn_stress_by_energy(points, w.begin.data(), w.end.data(), w.h_bar.data(), w.energy_begin.data(),
                           w.energy_end.data(), step.want, w.piola.data(), w.tangent.data());
  std::copy_n(w.energy_end.data(), size, w.energy.data());
}

void BulkModel::evaluate_tile(std::size_t block, std::int64_t first, std::int64_t n, const Step& step, Work& w,
                              double* force, double* stiffness, BulkResult& result) {
  const BulkCells& c = cells_[block];
  const ElementInfo& e = *c.element;
  const std::int64_t points = n * e.bulk_points;
  if (halves(block, step)) return evaluate_linear(block, first, n, step, w, force, stiffness, result);
  std::fill_n(w.status.data(), points, 0);
  gather(block, first, n, step.u, w);
  bool good = find_gradients(block, n, w);
  if (good) {
    if (!swelling.empty()) find_swelling(block, first, n, w);
    if (step.begin)
      stresses_by_energy(block, first, n, step, w);
    else
      stresses_at_points(block, first, n, step.h, step.theta, step.want, w);
    good = std::all_of(w.status.data(), w.status.data() + points, [](std::int32_t s) { return s == 0; });
  }
  for (std::int64_t p = 0; p < points && good; ++p) {
    const double sum = w.energy[p] + w.dissipated[p] + w.piola[9 * p] + w.piola[9 * p + 4];
    if (!std::isfinite(sum)) w.status[p] = 2, good = false;
  }
  if (!good) {
    for (std::int64_t p = 0; p < points; ++p)
      if (w.status[p] != 0) {
        result = {w.status[p], first + p / e.bulk_points, std::int64_t(block), 0, 0};
        return;
      }
  }
  for (std::int64_t p = 0; p < points; ++p) {
    result.energy += w.volume[p] * w.energy[p];
    result.dissipated += w.volume[p] * w.dissipated[p];
  }
  cairn_solid_forces(dim_, dim_ == 2 ? std::int32_t(c.plane) : 0, mean_of(c), e.nodes, e.bulk_points, n, w.d.data(),
                     w.hoop.data(), w.h.data(), w.volume.data(), w.share.data(), w.piola.data(), w.tangent.data(),
                     step.want && c.material->symmetric ? 2 : step.want, force, stiffness);
  if (step.want && one_damage(block)) add_growth_of_damage(block, n, w, force, stiffness);
  if (step.begin) return;
  cairn_true_stress(c.kinematics != Kinematics::small, points, w.h_bar.data(), w.piola.data(),
                    stress_.data() + blocks_[block].first_stress + 6 * first * e.bulk_points);
}

// Cells of Hooke's law, some side by side.
void BulkModel::evaluate_linear(std::size_t block, std::int64_t first, std::int64_t n, const Step& step, Work& w,
                                double* force, double* half, BulkResult& result) {
  const BulkCells& c = cells_[block];
  const Block& b = blocks_[block];
  const ElementInfo& e = *c.element;
  const int dofs = dim_ * e.nodes, entries = dofs * (dofs + 1) / 2;
  const double young = c.params[0], poisson = c.params[1], shear = young / (2 * (1 + poisson));
  const bool in_plane = dim_ == 2 && c.plane == Plane::stress;
  const double solid = young * poisson / ((1 + poisson) * (1 - 2 * poisson));
  const double lambda = in_plane ? young * poisson / ((1 + poisson) * (1 - poisson)) : solid;
  gather(block, first, n, step.u, w);
  for (std::int64_t at = 0; at < n; at += lanes) {
    const std::int64_t cells = std::min(lanes, n - at);
    cairn_linear_cells(dim_, e.nodes, e.bulk_points, b.gradient.data(), b.weight.data(), dim_ == 2 ? c.thickness : 1,
                       lambda, shear, in_plane ? 0 : solid, cells, &w.x[std::size_t(at * dofs)],
                       &w.u[std::size_t(at * dofs)], step.want, force + at * dofs, half + at * entries,
                       &stress_[std::size_t(b.first_stress + 6 * (first + at) * e.bulk_points)], w.energy.data(),
                       w.status.data());
    for (std::int64_t cell = 0; cell < cells; ++cell) {
      const bool finite = std::isfinite(w.energy[std::size_t(cell)]);
      if (w.status[std::size_t(cell)] != 0 || !finite) {
        result = {w.status[std::size_t(cell)] != 0 ? 1 : 2, first + at + cell, std::int64_t(block), 0, 0};
        return;
      }
      result.energy += w.energy[std::size_t(cell)];
    }
  }
}

void BulkModel::add_forces(std::size_t block, std::int64_t first, std::int64_t n, const double* force,
                           double* to) const {
  const BulkCells& c = cells_[block];
  const int nodes = c.element->nodes;
  const std::int32_t* node = &c.node[std::size_t(first * nodes)];
  dim_ == 2 ? scatter_nodes<2>(node, std::size_t(n * nodes), force, to)
            : scatter_nodes<3>(node, std::size_t(n * nodes), force, to);
}

bool BulkModel::halves(std::size_t block, const Step& step) const {
  return !step.begin && is_linear(cells_[block]) && swelling.empty() && blocks_[block].stretch.empty();
}

namespace {

// Entries (i, j), i >= j, of the matrix of a cell: of a whole one by columns, of its symmetric part, or of its lower
// half, lanes apart.
struct Whole {
  const double* k;
  int dofs;
  double operator()(int i, int j) const { return k[j * dofs + i]; }
};
struct Symmetric {
  const double* k;
  int dofs;
  double operator()(int i, int j) const { return 0.5 * (k[j * dofs + i] + k[i * dofs + j]); }
};
struct Half {
  const double* k;
  int dofs;
  double operator()(int i, int j) const { return k[(j * dofs - j * (j + 1) / 2 + i) * lanes]; }
};

// Columns of the nodes from low to high alone.
template <int dim, class Matrix>
void add_matrix(const Matrix& k, int nodes, const std::int32_t* node, const std::int32_t* entry,
                const std::int32_t* wide, std::int32_t low, std::int32_t high, double* to) {
  for (int b = 0; b < nodes; ++b)
    for (int a = b; a < nodes; ++a, ++entry) {
      const bool turned = *entry < 0;
      const std::int32_t early = turned ? node[a] : node[b];
      if (early < low || early >= high) continue;
      const std::int64_t at = turned ? -1 - *entry : *entry, width = wide[early];
      if (a == b) {
        for (int j = 0; j < dim; ++j)
          for (int i = j; i < dim; ++i) to[entry_of(at, width, i, j)] += k(dim * a + i, dim * b + j);
      } else if (!turned) {
        for (int j = 0; j < dim; ++j)
          for (int i = 0; i < dim; ++i) to[entry_of(at, width, i, j)] += k(dim * a + i, dim * b + j);
      } else {
        for (int j = 0; j < dim; ++j)
          for (int i = 0; i < dim; ++i) to[entry_of(at, width, i, j)] += k(dim * a + j, dim * b + i);
      }
    }
}

} // namespace

// Each thread adds to columns of its own, in the order of the cells.
void BulkModel::add_matrices(std::size_t block, std::int64_t first, std::int64_t n, const double* stiffness,
                             const Step& step, std::int64_t low, std::int64_t high, double* to) const {
  const BulkCells& c = cells_[block];
  const int nodes = c.element->nodes, dofs = dim_ * nodes, entries = dofs * (dofs + 1) / 2;
  const std::size_t pairs = std::size_t(nodes * (nodes + 1) / 2);
  const bool half = halves(block, step);
  for (std::int64_t cell = 0; cell < n; ++cell) {
    const std::int32_t* node = &c.node[std::size_t((first + cell) * nodes)];
    const std::int32_t* entry = &blocks_[block].entry[std::size_t(first + cell) * pairs];
    const auto add = [&](const auto& k) {
      dim_ == 2 ? add_matrix<2>(k, nodes, node, entry, wide_.data(), std::int32_t(low), std::int32_t(high), to)
                : add_matrix<3>(k, nodes, node, entry, wide_.data(), std::int32_t(low), std::int32_t(high), to);
    };
    // tiles stand apart by their whole matrices
    if (half)
      add(Half{stiffness + cell / bulk_tile * bulk_tile * dofs * dofs + cell % bulk_tile / lanes * lanes * entries +
                   cell % lanes,
               dofs});
    else if (c.material->symmetric)
      add(Whole{stiffness + cell * dofs * dofs, dofs});
    else
      add(Symmetric{stiffness + cell * dofs * dofs, dofs});
  }
}

BulkResult BulkModel::evaluate(const MeshMotion& at, double* force, double* tangent) {
  begin_time_ = at.begin_time;
  const BulkResult found = evaluate(at.u, at.h, at.theta, force, tangent, at.begin);
  begin_time_ = no_time;
  return found;
}

BulkResult BulkModel::evaluate(const double* u, double h, double theta, double* force, double* tangent,
                               const double* begin) {
  const Step step{u, begin, h, theta, tangent != nullptr};
  const int threads = omp_get_max_threads();
  if (int(work_.size()) < threads) work_.resize(std::size_t(threads));
  const std::int64_t nodes = std::int64_t(place_.size()) / dim_;
  std::fill_n(force, place_.size(), 0.0);
  BulkResult total;
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    const BulkCells& c = cells_[k];
    const int dofs = dim_ * c.element->nodes;
    for (Work& w : work_) {
      w.resize(dim_, *c.element, blocks_[k].states, linear_dilatation(c));
      if (begin) w.keep_begin(std::size_t(bulk_tile * c.element->bulk_points));
    }
    force_.resize(std::max(force_.size(), std::size_t(chunk * dofs)));
    stiffness_.resize(std::max(stiffness_.size(), std::size_t(chunk * dofs * dofs)));
    results_.resize(chunk / bulk_tile);
    for (std::int64_t first = 0; first < c.count(); first += chunk) {
      const std::int64_t n = std::min(chunk, c.count() - first), tiles = (n + bulk_tile - 1) / bulk_tile;
      std::fill_n(results_.begin(), tiles, BulkResult{});
      if (threads == 1) { // matrices are added while they are at hand
        for (std::int64_t t = 0; t < tiles; ++t) {
          const std::int64_t at = first + t * bulk_tile, cells = std::min(bulk_tile, first + n - at);
          evaluate_tile(k, at, cells, step, work_[0], &force_[std::size_t(t * bulk_tile * dofs)], stiffness_.data(),
                        results_[std::size_t(t)]);
          if (!results_[std::size_t(t)].ok()) break;
          if (tangent) add_matrices(k, at, cells, stiffness_.data(), step, 0, nodes, tangent);
        }
      } else {
#pragma omp parallel num_threads(threads) if (tiles > 1)
        {
#pragma omp for schedule(static)
          for (std::int64_t t = 0; t < tiles; ++t) {
            const std::int64_t at = first + t * bulk_tile, cells = std::min(bulk_tile, first + n - at);
            evaluate_tile(k, at, cells, step, work_[std::size_t(omp_get_thread_num())],
                          &force_[std::size_t(t * bulk_tile * dofs)],
                          &stiffness_[std::size_t(t * bulk_tile * dofs * dofs)], results_[std::size_t(t)]);
          }
          if (tangent) {
            const std::int64_t of = omp_get_num_threads(), me = omp_get_thread_num();
            add_matrices(k, first, n, stiffness_.data(), step, nodes * me / of, nodes * (me + 1) / of, tangent);
          }
        }
      }
      for (std::int64_t t = 0; t < tiles; ++t) {
        const BulkResult& r = results_[std::size_t(t)];
        if (!r.ok()) return r;
        total.energy += r.energy;
        total.dissipated += r.dissipated;
      }
      add_forces(k, first, n, force_.data(), force);
    }
  }
  return total;
}

} // namespace cairn
