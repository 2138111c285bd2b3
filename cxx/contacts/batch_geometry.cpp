#include "batch_geometry.hpp"

#include <algorithm>
#include <cmath>

#include "../solvers/sweeps/batch.hpp"

namespace cairn {

void BatchGeometry::fill(cairn_batch& b, double& deepest) const {
  const Candidates& c = *in_.candidates;
  const int n = b.count, d = in_.dim();
  const bool image = in_.cell->any(), hulls = d == 2 && in_.contactors->hull.active;
  const auto polygon = [&](std::int32_t contactor) { return hulls && *in_.contactors->hull[contactor] >= 0; };
  // LMGC90's impulses between a rigid body and a mesh act on the surface of the mesh for both.
  const double share = b.mapped_a || b.mapped_b ? 1 - in_.gap_share() : in_.gap_share();
  const auto lever = [&](double* out, bool radial, std::int64_t i, std::int32_t contactor, double side, int lane) {
    if (radial) {
      out[lane] = side * (*in_.contactors->radius[contactor] + share * c.gap[i]);
      return;
    }
    double shift[3] = {0, 0, 0};
    if (image && side > 0) image_shift(*in_.cell, c.image[i], shift);
    const double *x = in_.bodies->position[in_.body(contactor)], *p = &c.point[d * i];
    const double* normal = &c.normal[d * i];
    // LMGC90's impulses on surfaces: between two polygons it has them in the middle
    const double beyond = polygon(c.contactor_a[i]) && polygon(c.contactor_b[i]) ? 0 : side * (0.5 - share) * c.gap[i];
    for (int k = 0; k < d; ++k) out[k * n + lane] = p[k] - (x[k] + shift[k]) - beyond * normal[k];
  };
  const bool radial_a = is_radial(b.side_a), radial_b = is_radial(b.side_b);
  const std::int32_t* who = &system_.candidate[b.first];
  for (int lane = 0; lane < b.contacts; ++lane) {
    const std::int64_t i = who[lane];
    const std::int32_t ca = c.contactor_a[i], cb = c.contactor_b[i];
    b.body_a[lane] = in_.body(ca);
    b.body_b[lane] = in_.body(cb);
    const double* normal = &c.normal[d * i];
    for (int k = 0; k < d; ++k) b.frame[k * n + lane] = normal[k];
    if (d == 3) {
      double t[3];
      tangent_of(normal, t);
      for (int k = 0; k < 3; ++k) b.frame[(3 + k) * n + lane] = t[k];
    }
    b.mapped_a ? fill_mapping(b, 0, lane, i) : lever(b.lever_a, radial_a, i, ca, -1, lane);
    b.mapped_b ? fill_mapping(b, 1, lane, i) : lever(b.lever_b, radial_b, i, cb, 1, lane);
    if (c.gap[i] < 0 && !law_infos()[b.law].joins) {
      const double ra = in_.contactors->size(ca), rb = in_.contactors->size(cb);
      const double size = ra > 0 && rb > 0 ? std::min(ra, rb) : std::max(ra, rb);
      if (size > 0) deepest = std::max(deepest, -c.gap[i] / size);
    }
  }
  // dummies rest on the spare record and touch nothing
  const auto pad = [&](double* column, int columns, double value) {
    for (int k = 0; k < columns; ++k) std::fill(column + k * n + b.contacts, column + (k + 1) * n, value);
  };
  pad(b.frame, d == 2 ? 2 : 6, 0);
  pad(b.lever_a, sides()[b.side_a].lever, 0);
  pad(b.lever_b, sides()[b.side_b].lever, 0);
  const auto spare = std::int32_t(system_.bodies);
  std::fill(b.body_a + b.contacts, b.body_a + n, b.mapped_a ? 0 : spare);
  std::fill(b.body_b + b.contacts, b.body_b + n, b.mapped_b ? 0 : spare);
}

// Nodes of a condensed body that a contact moves with, and their weights where other sides have a lever.
void BatchGeometry::fill_mapping(cairn_batch& b, int side, int lane, std::int64_t i) const {
  const Candidates& c = *in_.candidates;
  double shift[3] = {0, 0, 0}, point[3] = {0, 0, 0};
  if (in_.cell->any() && side) image_shift(*in_.cell, c.image[i], shift);
  const int d = in_.dim() == 2 ? 2 : 3;
  for (int k = 0; k < d; ++k) point[k] = c.point[d * i + k] - shift[k];
  const std::int32_t one = c.contactor_a[i], two = c.contactor_b[i];
  const Mapping m = in_.meshes->mapping(*in_.nodes, side ? two : one, point, side ? one : two);
  const CondensedBody& body = system_.condensed[m.mesh];
  const cairn_condensed& of = system_.condensed_dofs[m.mesh];
  const auto first = std::int32_t(of.velocity - system_.condensed_velocity.data());
  std::int32_t *const node = side ? b.node_b : b.node_a, *const dof = side ? b.dof_b : b.dof_a;
  std::int32_t& nodes = side ? b.nodes_b : b.nodes_a;
  (side ? b.body_b : b.body_a)[lane] = m.mesh;
  const auto row = [&](std::int32_t n) {
    return body.row.empty() ? in_.meshes->meshes[m.mesh].place(n) : body.row[std::size_t(n)];
  };
  for (int j = 0; j < 4; ++j) {
    const bool rests = m.mean >= 0 ? j == 0 : m.node[j] >= 0; // a mean is one row
    const std::int32_t place = !rests ? 0 : m.mean >= 0 ? in_.meshes->row_of_mean(m.mean) : row(m.node[j]);
    node[j * b.count + lane] = place;
    dof[j * b.count + lane] = first + in_.dim() * place;
    (side ? b.lever_b : b.lever_a)[j * b.count + lane] = !rests ? 0 : m.mean >= 0 ? 1 : m.weight[j];
    if (rests) nodes = std::max(nodes, j + 1);
  }
  dof[4 * b.count + lane] = first;
  dof[5 * b.count + lane] = std::int32_t(condensed_rows(of.dofs));
  if (b.turns) fill_spin(b, side, lane, i, m);
}

// The spin of the face about the axes of the contact.
void BatchGeometry::fill_spin(const cairn_batch& b, int side, int lane, std::int64_t i, const Mapping& m) const {
  const int d = in_.dim(), rotations = b.components - d;
  b.turns[lane] =
      in_.meshes->turns(side ? in_.candidates->contactor_b[i] : in_.candidates->contactor_a[i]) && m.mean < 0;
  double rows[4][3][3] = {}, axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  if (b.turns[lane]) in_.meshes->spin(*in_.nodes, m, rows);
  if (d == 3) axes_of(b, d, lane, axes);
  for (int k = 0; k < rotations; ++k)
    for (int j = 0; j < 4; ++j)
      for (int l = 0; l < d; ++l) {
        double sum = 0;
        for (int a = 0; a < rotations; ++a) sum += axes[k][a] * rows[j][a][l];
        spin_of(b, d, side, lane, j, l, k) = sum;
      }
}

} // namespace cairn
