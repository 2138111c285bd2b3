#include "cell_boundaries.hpp"

#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "../base/call.hpp"
#include "scene.hpp"

namespace cairn {
namespace {

// A direction in the axes of a body, in space.
void turned(const Scene& scene, std::int64_t body_id, const double* own, double out[3]) {
  for (int c = 0; c < 3; ++c) out[c] = c < scene.dim ? own[c] : 0;
  const std::int32_t body = scene.find_body(body_id);
  if (body < 0 || !scene.bodies.rotation.active) return;
  const double* q = scene.bodies.rotation[body];
  if (scene.dim == 2) {
    const double c = std::cos(q[0]), s = std::sin(q[0]), x = out[0], y = out[1];
    out[0] = c * x - s * y;
    out[1] = s * x + c * y;
    return;
  }
  double cross[3], v[3] = {out[0], out[1], out[2]};
  for (int c = 0; c < 3; ++c) { // w v + u x v
    const int a = (c + 1) % 3, b = (c + 2) % 3;
    cross[c] = q[0] * v[c] + q[a + 1] * v[b] - q[b + 1] * v[a];
  }
  for (int c = 0; c < 3; ++c) { // v + 2 u x (w v + u x v)
    const int a = (c + 1) % 3, b = (c + 2) % 3;
    out[c] = v[c] + 2 * (q[a + 1] * cross[b] - q[b + 1] * cross[a]);
  }
}

std::string text_of(const double* x, int dim) {
  std::string out = "(";
  for (int c = 0; c < dim; ++c) {
    char one[32];
    std::snprintf(one, sizeof one, "%s%.3g", c ? ", " : "", x[c]);
    out += one;
  }
  return out + ")";
}

} // namespace

void check_in_cell(const Scene& scene, Shape shape, std::int64_t body_id, const double* normal, double radius) {
  const ShapeInfo& of = info(shape);
  const Cell& cell = scene.cell;
  if (of.bounded || !cell.any()) return;
  double way[3] = {0, 0, 0};
  if (normal) turned(scene, body_id, normal, way);
  for (int k = 0; k < scene.dim; ++k) {
    if (!cell.periodic[k]) continue;
    const double* vector = cell.vectors + 3 * k;
    double square = 0, along = 0, across = 0;
    for (int c = 0; c < scene.dim; ++c) square += vector[c] * vector[c], along += vector[c] * way[c];
    for (int c = 0; c < scene.dim; ++c) across += std::pow(vector[c] - along * way[c], 2);
    const double length = std::sqrt(square), parallel = length * std::sqrt(std::numeric_limits<double>::epsilon());
    across = std::sqrt(across);
    const std::string name(1, "xyz"[k]), body = "body " + std::to_string(body_id);
    if (of.half_space() && std::abs(along) > parallel)
      throw Error(body + " is a wall with normal " + text_of(way, scene.dim) + ", and the cell is periodic along " +
                  name + ", so that the wall cuts all images of the cell: make the cell not periodic along " + name +
                  " (length inf), or give a wall with an end, a segment, box or polyhedron");
    if (of.hollow() && across > parallel && across < 2 * radius)
      throw Error(body + " is a " + of.name + " " + std::to_string(2 * radius) + " m wide, and the cell is " +
                  std::to_string(across) + " m wide there along " + name +
                  ", so that its images cut it: make the cell wider, or not periodic along " + name + " (length inf)");
  }
}

void set_cell(Scene& scene, const Cell& cell) {
  const Cell before = scene.cell;
  scene.cell = cell;
  const Contactors& c = scene.contactors;
  try {
    for (std::int64_t k = 0; cell.any() && k < c.count; ++k)
      if (const std::int32_t body = *c.body[k]; body >= 0)
        check_in_cell(scene, Shape(*c.shape[k]), *scene.bodies.id[body], c.direction.active ? c.direction[k] : nullptr,
                      *c.radius[k]);
  } catch (...) {
    scene.cell = before;
    throw;
  }
}

} // namespace cairn
