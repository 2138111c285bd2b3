#include "frames.hpp"

#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "../base/small_matrices.hpp"
#include "../base/vectors.hpp"
#include "cairn/core.h"

namespace cairn {
namespace {

struct Bars {
  std::vector<double> x;             // (dim, 2, n) [m]
  std::vector<double> along, length; // (dim, n), (n)
  std::vector<double> pull;          // of initial stress (n) [N]; empty: none
};

void check_each(const char* name, std::int64_t n, const double* values) {
  for (std::int64_t i = 0; values && i < n; ++i)
    if (!(values[i] > 0) || !std::isfinite(values[i]))
      throw Error(std::string(name) + "[" + std::to_string(i) + "] is " + std::to_string(values[i]) +
                  "; give finite numbers above 0");
}

Bars bars_of(const MeshDraft& d, std::int64_t n, const std::int32_t* node, const Sections& s) {
  if (!d.cells.empty() || d.mass.n > 0)
    throw Error("the mesh has cells or matrices: give these, or bars, or beams, in one call");
  if (n < 1) throw Error("n is " + std::to_string(n) + "; give at least one");
  check_each("young", n, s.young);
  check_each("area", n, s.area);
  check_each("density", n, s.density);
  Bars out;
  for (std::int64_t i = 0; i < n; ++i) {
    double size = 0;
    for (int end = 0; end < 2; ++end) {
      d.check_node(node[2 * i + end]);
      for (int k = 0; k < d.dim; ++k) out.x.push_back(d.reference[std::size_t(d.dim * node[2 * i + end] + k)]);
    }
    const double* x = &out.x[std::size_t(2 * d.dim * i)];
    for (int k = 0; k < d.dim; ++k) size = std::hypot(size, x[d.dim + k] - x[k]);
    if (!(size > 0)) throw Error("cell " + std::to_string(i) + " has no length");
    for (int k = 0; k < d.dim; ++k) out.along.push_back((x[d.dim + k] - x[k]) / size);
    out.length.push_back(size);
    if (!s.initial_stress) continue;
    if (!std::isfinite(s.initial_stress[i]))
      throw Error("initial_stress[" + std::to_string(i) + "] is not a finite number; give a stress [Pa]");
    out.pull.push_back(s.initial_stress[i] * s.area[i]);
  }
  return out;
}

// A pattern that couples the displacements of both ends of each, or of all nodes; values zero.
SparseMatrix pattern_of(const MeshDraft& d, std::int64_t n, const std::int32_t* node, bool full) {
  std::vector<std::int64_t> start{0};
  std::vector<std::int32_t> unknown;
  const auto dofs = std::int32_t(d.reference.size());
  if (full) {
    for (std::int32_t i = 0; i < dofs; ++i) unknown.push_back(i);
    start.push_back(dofs);
  }
  for (std::int64_t e = 0; e < 2 * n && !full; ++e) {
    for (int k = 0; k < d.dim; ++k) unknown.push_back(d.dim * node[e] + k);
    if (e % 2 == 1) start.push_back(std::int64_t(unknown.size()));
  }
  return lower_pattern(dofs, start, unknown);
}

// Half the mass of each at each of its ends, forces by which they are held apart, and the energy of these.
void take_masses(MeshDraft& d, std::int64_t n, const std::int32_t* node, const Sections& s, const Bars& bars) {
  std::vector<double> of_nodes(std::size_t(d.nodes()), 0.0), force;
  double energy = 0;
  if (!bars.pull.empty()) force.assign(d.reference.size(), 0.0);
  for (std::int64_t i = 0; i < n; ++i) {
    const double mass = s.density[i] * s.area[i] * bars.length[std::size_t(i)];
    for (int end = 0; end < 2; ++end) of_nodes[std::size_t(node[2 * i + end])] += mass / 2;
    if (bars.pull.empty()) continue;
    const double pull = bars.pull[std::size_t(i)];
    energy += pull * pull * bars.length[std::size_t(i)] / (2 * s.young[i] * s.area[i]);
    for (int k = 0; k < d.dim; ++k) {
      const double part = pull * bars.along[std::size_t(d.dim * i + k)];
      force[std::size_t(d.dim * node[2 * i] + k)] -= part;
      force[std::size_t(d.dim * node[2 * i + 1] + k)] += part;
    }
  }
  d.mass = d.damping = d.stiffness;
  std::fill(d.mass.value.begin(), d.mass.value.end(), 0.0);
  d.damping.value = d.mass.value;
  for (std::int64_t c = 0; c < d.mass.n; ++c)
    d.mass.value[std::size_t(d.mass.start[std::size_t(c)])] = of_nodes[std::size_t(c / d.dim)];
  d.frame = true;
  d.frame_force = std::move(force);
  d.frame_energy = energy;
}

FrameCells moving_cells(const MeshDraft& d, std::int64_t n, const std::int32_t* node, const Sections& s,
                        const Bars& bars) {
  FrameCells out;
  out.dim = d.dim;
  out.reference = d.reference;
  out.node.assign(node, node + 2 * n);
  out.young.assign(s.young, s.young + n);
  out.area.assign(s.area, s.area + n);
  out.pull = bars.pull;
  out.pull.resize(std::size_t(n), 0.0);
  return out;
}

// Geometric stiffness of a bar under axial force: acts on the relative transverse displacement of its ends.
void add_across(int dim, const double* along, double rate, double* k) {
  const int size = 2 * dim;
  for (int j = 0; j < size; ++j)
    for (int i = 0; i < size; ++i) {
      const double own = (i % dim == j % dim ? 1.0 : 0.0) - along[i % dim] * along[j % dim];
      k[size * j + i] += (i / dim == j / dim ? rate : -rate) * own;
    }
}

// Axes of a beam, each a row: along it, and those of its section.
void axes_of(int dim, const double* along, const double* up, double axes[3][3]) {
  for (int k = 0; k < 3; ++k) axes[0][k] = k < dim ? along[k] : 0;
  if (dim == 2) {
    axes[1][0] = -along[1], axes[1][1] = along[0], axes[1][2] = 0;
    return;
  }
  const double part = along[0] * up[0] + along[1] * up[1] + along[2] * up[2];
  for (int k = 0; k < 3; ++k) axes[1][k] = up[k] - part * along[k];
  const double size = std::hypot(axes[1][0], axes[1][1], axes[1][2]);
  for (double& a : axes[1]) a /= size;
  cross(axes[0], axes[1], axes[2]);
}

// Geometric stiffness of a beam under axial force, with cubic deflections (Przemieniecki 1968).
void add_bent(int dim, const double axes[3][3], double pull, double size, double* k) {
  const double bent[4][4] = {{36, 3 * size, -36, 3 * size},
                             {3 * size, 4 * size * size, -3 * size, -size * size},
                             {-36, -3 * size, 36, -3 * size},
                             {3 * size, -size * size, -3 * size, 4 * size * size}};
  const int each = 3 * dim - 3, dofs = 2 * each;
  for (int axis = 1; axis < dim; ++axis) {
    double turn[4][12] = {}; // rows of the deflection along the axis and the slope that goes with it, of both nodes
    for (int end = 0; end < 2; ++end) {
      for (int c = 0; c < dim; ++c) turn[2 * end][end * each + c] = axes[axis][c];
      // the slope of a deflection along axis 2 is the rotation about axis 3; along axis 3 it is minus that about axis 2
      if (dim == 2) turn[2 * end + 1][end * each + 2] = 1;
      for (int c = 0; c < 3 && dim == 3; ++c)
        turn[2 * end + 1][end * each + 3 + c] = axis == 1 ? axes[2][c] : -axes[1][c];
    }
    for (int j = 0; j < dofs; ++j)
      for (int i = 0; i < dofs; ++i)
        for (int a = 0; a < 4; ++a)
          for (int b = 0; b < 4; ++b) k[dofs * j + i] += turn[a][i] * bent[a][b] * pull / (30 * size) * turn[b][j];
  }
}

// Stiffness matrices of beams (dofs, dofs, n); fills the properties of `cells`.
std::vector<double> beam_matrices(const MeshDraft& d, std::int64_t n, const Sections& s, const Beams& of,
                                  const Bars& bars, FrameCells& cells) {
  const int dim = d.dim, dofs = 6 * dim - 6;
  std::vector<double> k(std::size_t(dofs * dofs * n));
  const double up = std::hypot(of.up[0], of.up[1], of.up[2]);
  for (std::int64_t i = 0; i < n; ++i) {
    const double* e = &bars.along[std::size_t(dim * i)];
    const double across = dim == 2 ? 1
                                   : std::hypot(e[1] * of.up[2] - e[2] * of.up[1], e[2] * of.up[0] - e[0] * of.up[2],
                                                e[0] * of.up[1] - e[1] * of.up[0]);
    if (dim == 3 && !(across >= 1e-6 * up && up > 0 && std::isfinite(up)))
      throw Error("up is (" + std::to_string(of.up[0]) + ", " + std::to_string(of.up[1]) + ", " +
                  std::to_string(of.up[2]) + "), along beam " + std::to_string(i) + ": give another direction");
    const double one = of.inertia[dim == 2 ? i : 2 * i], two = of.inertia[dim == 2 ? i : 2 * i + 1];
    cells.shear.push_back(s.young[i] / (2 * (1 + of.poisson)));
    cells.inertia.insert(cells.inertia.end(), {one, two});
    cells.torsion.push_back(of.torsion ? of.torsion[i] : one + two);
    cells.shear_area.push_back(of.shear_area ? of.shear_area[i] : 0);
  }
  cells.beams = true;
  std::copy_n(of.up, 3, cells.up.begin());
  cells.clamped.assign(of.clamped.begin(), of.clamped.end());
  cairn_beam_stiffness(dim, n, bars.x.data(), of.up, s.young, cells.shear.data(), s.area, cells.inertia.data(),
                       cells.torsion.data(), cells.shear_area.data(), k.data());
  for (std::size_t i = 0; i < bars.pull.size(); ++i) {
    double axes[3][3];
    axes_of(dim, &bars.along[std::size_t(dim) * i], of.up, axes);
    add_bent(dim, axes, bars.pull[i], bars.length[i], &k[std::size_t(dofs * dofs) * i]);
  }
  return k;
}

} // namespace

void take_bars(MeshDraft& d, std::int64_t n, const std::int32_t* node, const Sections& s) {
  const Bars bars = bars_of(d, n, node, s);
  const int dim = d.dim, dofs = 2 * dim;
  std::vector<double> k(std::size_t(dofs * dofs * n));
  cairn_bar_stiffness(dim, n, bars.x.data(), s.young, s.area, k.data());
  for (std::size_t i = 0; i < bars.pull.size(); ++i)
    add_across(dim, &bars.along[std::size_t(dim) * i], bars.pull[i] / bars.length[i], &k[std::size_t(dofs * dofs) * i]);
  SparseMatrix stiffness = pattern_of(d, n, node, false);
  std::vector<std::int64_t> start;
  std::vector<std::int32_t> unknown;
  for (std::int64_t e = 0; e <= n; ++e) start.push_back(dofs * e);
  for (std::int64_t e = 0; e < 2 * n; ++e)
    for (int c = 0; c < dim; ++c) unknown.push_back(dim * node[e] + c);
  add_cliques(stiffness, start, unknown, k.data(), stiffness.value);
  d.stiffness = std::move(stiffness);
  d.frame_cells = moving_cells(d, n, node, s, bars);
  take_masses(d, n, node, s, bars);
}

void take_beams(MeshDraft& d, std::int64_t n, const std::int32_t* node, const Sections& s, const Beams& of) {
  const Bars bars = bars_of(d, n, node, s);
  check_each("inertia", d.dim == 2 ? n : 2 * n, of.inertia);
  check_each("torsion", n, of.torsion);
  check_each("shear_area", n, of.shear_area);
  if (!(of.poisson > -1) || !std::isfinite(of.poisson))
    throw Error("poisson is " + std::to_string(of.poisson) + "; give a finite number above -1");
  const int dim = d.dim, each = 3 * dim - 3, turns = each - dim;
  const auto moved = d.reference.size();
  // place of each dof: displacements first, then the rotations that are not clamped; -1: clamped
  std::vector<std::int64_t> turned(std::size_t(d.nodes()), 0);
  for (const std::int32_t i : of.clamped) d.check_node(i), turned[std::size_t(i)] = -1;
  std::vector<std::uint8_t> used(turned.size(), 0);
  for (std::int64_t e = 0; e < 2 * n; ++e) used[std::size_t(node[e])] = 1;
  std::size_t rotations = 0;
  for (std::size_t i = 0; i < turned.size(); ++i) // a node without beams has no turn to find
    turned[i] = turned[i] < 0 || !used[i] ? -1 : std::int64_t(turns) * std::int64_t(rotations++);
  rotations *= std::size_t(turns);
  FrameCells cells = moving_cells(d, n, node, s, bars);
  const std::vector<double> k = beam_matrices(d, n, s, of, bars, cells);
  std::vector<double> whole(moved * moved, 0.0), mixed(rotations * moved, 0.0), of_turns(rotations * rotations, 0.0);
  for (std::int64_t b = 0; b < n; ++b)
    for (int j = 0; j < 2 * each; ++j)
      for (int i = 0; i < 2 * each; ++i) {
        const double value = k[std::size_t(4 * each * each * b + 2 * each * j + i)];
        const std::int32_t row = node[2 * b + i / each], column = node[2 * b + j / each];
        const int r = i % each, c = j % each;
        const std::int64_t tr = turned[std::size_t(row)] + r - dim, tc = turned[std::size_t(column)] + c - dim;
        if (c < dim && r < dim) whole[moved * std::size_t(dim * column + c) + std::size_t(dim * row + r)] += value;
        if (r < dim || turned[std::size_t(row)] < 0) continue;
        if (c < dim) mixed[rotations * std::size_t(dim * column + c) + std::size_t(tr)] += value;
        if (c >= dim && turned[std::size_t(column)] >= 0)
          of_turns[rotations * std::size_t(tc) + std::size_t(tr)] += value;
      }
  std::vector<double> follow = mixed; // rotations by displacements
  // Where nothing holds a rotation, which then no load moves (a straight beam in space about itself), it is 0.
  factor_symmetric(rotations, of_turns.data(), 1e-13);
  for (std::size_t c = 0; c < moved; ++c) solve_symmetric(rotations, of_turns.data(), &follow[rotations * c]);
  const auto condensed = [&](std::size_t row, std::size_t column) {
    double sum = whole[moved * column + row];
    for (std::size_t t = 0; t < rotations; ++t) sum -= mixed[rotations * row + t] * follow[rotations * column + t];
    return sum;
  };
  SparseMatrix stiffness = pattern_of(d, n, node, true);
  for (std::size_t c = 0; c < moved; ++c)
    for (std::int64_t e = stiffness.start[c]; e < stiffness.start[c + 1]; ++e) {
      const auto r = std::size_t(stiffness.row[std::size_t(e)]);
      stiffness.value[std::size_t(e)] = (condensed(r, c) + condensed(c, r)) / 2;
    }
  d.stiffness = std::move(stiffness);
  d.frame_cells = std::move(cells);
  take_masses(d, n, node, s, bars);
}

void take_kinematics(MeshDraft& d, const std::string& name) {
  if (!d.frame) throw Error("kinematics are of bars and beams: give these first");
  FrameCells cells = d.frame_cells;
  if (name == "corotational") {
    cells.kinematics = Kinematics::corotational;
  } else if (name == "total_lagrangian" && !cells.beams) {
    cells.kinematics = Kinematics::total_lagrangian;
  } else if (name != "small") {
    throw Error("kinematics '" + name + "' are none of " + (cells.beams ? "beams" : "bars") +
                ": give small, corotational" + (cells.beams ? "" : ", total_lagrangian"));
  }
  d.moving = name == "small" ? nullptr : std::make_shared<FrameModel>(std::move(cells));
  if (d.moving) d.moving->fit(d.mass);
}

} // namespace cairn
