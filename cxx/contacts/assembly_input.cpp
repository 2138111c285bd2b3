#include "assembly_input.hpp"

#include <algorithm>
#include <cmath>

#include "../base/vectors.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "body_axes.hpp"

namespace cairn {

double AssemblyInput::value_at(const double* value, std::int32_t contactor) const {
  if (const std::int32_t carrier = body(contactor); carrier >= 0) return value[carrier];
  const MeshSet::Middle& middle = meshes->middle(contactor);
  double sum = 0;
  for (int j = 0; j < 4 && middle.node[j] >= 0; ++j) sum += middle.weight[j] * value[bodies->count + middle.node[j]];
  return sum;
}

void AssemblyInput::fields_of(std::int64_t contact, std::int64_t n, double* out) const {
  const std::int32_t a = candidates->contactor_a[contact], b = candidates->contactor_b[contact];
  out[0] = temperature ? value_at(temperature, a) : 0;
  out[n] = temperature ? value_at(temperature, b) : 0;
  out[2 * n] = potential ? value_at(potential, a) : 0;
  out[3 * n] = potential ? value_at(potential, b) : 0;
}

void axes_of(const cairn_batch& b, int dim, int lane, double axes[3][3]) {
  for (int k = 0; k < dim; ++k) axes[0][k] = at(b, b.frame, lane, k);
  if (dim == 2) {
    axes[1][0] = -axes[0][1];
    axes[1][1] = axes[0][0];
    return;
  }
  if (b.pack)
    tangent_of(axes[0], axes[1]);
  else
    for (int k = 0; k < 3; ++k) axes[1][k] = at(b, b.frame, lane, 3 + k);
  cross(axes[0], axes[1], axes[2]);
}

// Carrier of a contactor: its position, and vectors of its axes in axes of space. A point of a mesh carries its end of
// a joint without a lever, and has the axes of space.
void AssemblyInput::carrier_at(std::int32_t contactor, double* x) const {
  for (int k = 0; k < dim(); ++k)
    x[k] =
        body(contactor) < 0 ? meshes->middle(contactor).of(nodes->position, k) : bodies->position[body(contactor)][k];
}

void AssemblyInput::carried(std::int32_t contactor, const double* own, double* out) const {
  if (body(contactor) >= 0) return to_space_axes(*bodies, dim(), body(contactor), own, out);
  for (int k = 0; k < dim(); ++k) out[k] = own[k];
}

// The end on A from that on B, which a side of a mesh carries by the weights of its nodes.
void AssemblyInput::between_ends(std::int32_t ca, std::int32_t cb, std::int32_t image, const Anchor& anchor,
                                 double* between) const {
  const int d = dim();
  double shift[3] = {0, 0, 0}, a[3] = {}, b[3] = {}, xa[3] = {}, xb[3] = {};
  if (cell->any()) image_shift(*cell, image, shift);
  carried(ca, anchor.a, a);
  carrier_at(ca, xa);
  if (on_mesh_side(cb)) {
    const std::array<std::int32_t, 4> node = meshes->nodes_of_side(cb);
    const double weight[4] = {anchor.b[0], anchor.b[1], anchor.b[2], 1 - anchor.b[0] - anchor.b[1] - anchor.b[2]};
    for (int j = 0; j < 4 && node[std::size_t(j)] >= 0; ++j)
      for (int k = 0; k < d; ++k) xb[k] += weight[j] * nodes->position[node[std::size_t(j)]][k];
  } else {
    carried(cb, anchor.b, b);
    carrier_at(cb, xb);
  }
  for (int k = 0; k < d; ++k) between[k] = (xa[k] - (xb[k] + shift[k])) + (a[k] - b[k]);
}

// Impulse and moment of a contact on A in space axes; m is of 3 components, in 2D its last.
void space_impulse(int dim, const cairn_batch& b, int lane, double p[3], double m[3]) {
  const int d = dim;
  double axes[3][3];
  axes_of(b, d, lane, axes);
  std::fill(p, p + 3, 0.0);
  std::fill(m, m + 3, 0.0);
  for (int c = 0; c < d; ++c) {
    const double r = at(b, b.r, lane, c);
    for (int k = 0; k < d; ++k) p[k] += axes[c][k] * r;
  }
  for (int c = d; c < b.components; ++c) {
    const double r = at(b, b.r, lane, c);
    if (d == 2)
      m[2] = r;
    else
      for (int k = 0; k < 3; ++k) m[k] += axes[c - 3][k] * r;
  }
}

// Unit, outward: of a triangle, or of an edge of a mesh in the plane, whose body is on the left.
void AssemblyInput::normal_of_side(std::int32_t side, double* m) const {
  if (dim() == 3) {
    const Hulls& hulls = contactors->hulls;
    std::copy_n(&hulls.normal[3 * std::size_t(hulls.first_face[*contactors->hull[side]])], 3, m);
    if (body(side) >= 0) to_space_axes(*bodies, 3, body(side), m, m);
    return;
  }
  const MeshSet::Middle& ends = meshes->middle(side);
  const double *one = nodes->position[ends.node[0]], *two = nodes->position[ends.node[1]];
  const double length = std::hypot(two[0] - one[0], two[1] - one[1]);
  m[0] = (two[1] - one[1]) / length;
  m[1] = (one[0] - two[0]) / length;
  m[2] = 0;
}

} // namespace cairn
