#include "search_margins.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

// Search margin of a mesh contactor [m]: a node has no size, so the size of a cell counts instead.
double margin_of_mapped(const Simulation& s, std::int32_t contactor, double h) {
  const MeshSet::Middle& middle = s.meshes.middle(contactor);
  double begin = 0, free = 0;
  for (int d = 0; d < s.scene.dim; ++d) {
    const double v = middle.of(s.scene.nodes.velocity, d), v_free = middle.of(s.scene.nodes.velocity_free, d);
    begin += v * v;
    free += v_free * v_free;
  }
  return 0.05 * s.meshes.meshes[s.meshes.mesh_of(contactor)].size() + h * std::sqrt(std::max(begin, free));
}

} // namespace

// A pair is a candidate if it could close within the step at the speeds at hand, and a little beyond: five hundredths
// of a radius each, for what collisions may add to the speeds.
double SearchMargins::measure(const Simulation& s, double h) {
  double longest = 0;
  const Bodies& b = s.scene.bodies;
  const Contactors& c = s.scene.contactors;
  const int nd = b.dofs(), dim = s.scene.dim;
  each_.resize(c.count);
  for (std::int64_t k = 0; k < c.count; ++k) {
    if (*c.body[k] < 0) {
      each_[k] = margin_of_mapped(s, std::int32_t(k), h);
      continue;
    }
    const double* v = b.velocity[*c.body[k]];
    const double* v_free = b.velocity_free[*c.body[k]];
    double begin = 0, free = 0, arm = 0, spin = 0, grown = 0;
    for (int d = 0; d < dim; ++d) begin += v[d] * v[d], free += v_free[d] * v_free[d];
    if (c.offset.active) {
      for (int d = 0; d < dim; ++d) arm += c.offset[k][d] * c.offset[k][d];
      for (int d = dim; d < nd; ++d) spin += v_free[d] * v_free[d];
    }
    const double grain = info(Shape(*c.shape[k])).ball() ? *c.radius[k] : 0;
    if (b.stretch.active) { // a gap that shrinking left is closed, whatever the speeds at hand
      const double size = *c.radius[k] + std::sqrt(arm);
      grown = std::abs(*b.stretch[*c.body[k]]) * size;
      for (int d = 0; d < dim && b.bend.active; ++d) grown += 1.5 * std::abs(b.bend[*c.body[k]][d]) * size * size;
    }
    const double speed = std::sqrt(std::max(begin, free));
    each_[k] = 0.05 * grain + grown + h * (speed + std::sqrt(arm * spin));
    if (!(speed > 0)) continue;
    const double size = grain > 0 ? grain : c.size(std::int32_t(k));
    if (size > 0 && h * speed > longest * size) longest = h * speed / size;
  }
  return longest;
}

} // namespace cairn
