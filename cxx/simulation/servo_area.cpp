// The loaded area of a servo wall.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "../contactors/shapes.hpp"
#include "../contacts/body_axes.hpp"
#include "controls.hpp"
#include "simulation.hpp"

namespace cairn {

namespace {

constexpr double aligned = 1e-12; // 1 - cosine of directions that count as one

// Unit vectors across a normal, those of Gram and Schmidt's method on the normal and the axes.
int directions_across(const std::array<double, 3>& normal, int dim, double out[2][3]) {
  int found = 0;
  for (int axis = 0; axis < dim && found < dim - 1; ++axis) {
    double v[3] = {0, 0, 0}, length = 0;
    v[axis] = 1;
    const auto remove = [&](const double* along) {
      double part = 0;
      for (int k = 0; k < dim; ++k) part += v[k] * along[k];
      for (int k = 0; k < dim; ++k) v[k] -= part * along[k];
    };
    remove(normal.data());
    for (int k = 0; k < found; ++k) remove(out[k]);
    for (int k = 0; k < dim; ++k) length += v[k] * v[k];
    if (!(length > aligned)) continue;
    for (int k = 0; k < dim; ++k) out[found][k] = v[k] / std::sqrt(length);
    ++found;
  }
  return found;
}

double extent_of_grains(const Simulation& s, const double* along) {
  const Bodies& b = s.scene.bodies;
  const Contactors& c = s.scene.contactors;
  const int dim = s.scene.dim;
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  for (std::int64_t k = 0; k < c.count; ++k) {
    if (*c.body[k] < 0 || !info(Shape(*c.shape[k])).ball()) continue;
    double reach = 0, at = 0;
    if (c.offset.active)
      for (int d = 0; d < dim; ++d) reach += c.offset[k][d] * c.offset[k][d];
    reach = c.offset.active ? *c.radius[k] + std::sqrt(reach) : *c.radius[k];
    if (!(reach > 0)) continue;
    for (int d = 0; d < dim; ++d) at += b.position[*c.body[k]][d] * along[d];
    highest = std::max(highest, at + reach);
    lowest = std::min(lowest, at - reach);
  }
  return highest >= lowest ? highest - lowest : 0;
}

// Between the planes that face each other along a direction.
double extent_of_walls(const Simulation& s, const double* along, std::int64_t wall) {
  const Bodies& b = s.scene.bodies;
  const Contactors& c = s.scene.contactors;
  const int dim = s.scene.dim;
  double lowest = -std::numeric_limits<double>::infinity(), highest = -lowest;
  for (std::int64_t k = 0; k < c.count; ++k) {
    if (*c.body[k] < 0 || !info(Shape(*c.shape[k])).half_space()) continue;
    double normal[3] = {}, offset[3] = {}, cosine = 0, at = 0;
    to_space_axes(b, dim, *c.body[k], c.direction[k], normal);
    if (c.offset.active) to_space_axes(b, dim, *c.body[k], c.offset[k], offset);
    for (int d = 0; d < dim; ++d) {
      cosine += normal[d] * along[d];
      at += (b.position[*c.body[k]][d] + offset[d]) * along[d];
    }
    if (cosine >= 1 - aligned) lowest = std::max(lowest, at);
    if (cosine <= -1 + aligned) highest = std::min(highest, at);
  }
  if (!std::isfinite(highest - lowest)) {
    char direction[80];
    std::snprintf(direction, sizeof direction, "(%.3g, %.3g, %.3g)", along[0], along[1], along[2]);
    throw Error("the area of servo wall " + std::to_string(wall) +
                " is that between walls, and no two planes face each other along " + direction +
                ": add them, or give a number");
  }
  return highest - lowest;
}

} // namespace

double loaded_area(const Simulation& s, const Servo& servo) {
  double across[2][3] = {}, area = s.scene.dim == 2 ? servo.depth : 1;
  const int n = directions_across(servo.normal, s.scene.dim, across);
  for (int k = 0; k < n; ++k) {
    const double* along = across[k];
    int axis = 0;
    for (int d = 1; d < s.scene.dim; ++d)
      if (std::abs(along[d]) > std::abs(along[axis])) axis = d;
    if (s.scene.cell.periodic[axis] && std::abs(along[axis]) > 1 - aligned)
      area *= s.scene.cell.vectors[4 * axis];
    else
      area *= servo.kind == ServoArea::grains ? extent_of_grains(s, along) : extent_of_walls(s, along, servo.body);
  }
  if (!(area >= 0))
    throw Error("the area of servo wall " + std::to_string(servo.body) + " is " + std::to_string(area) +
                " m2: walls have passed each other, keep them apart");
  return area;
}

} // namespace cairn
