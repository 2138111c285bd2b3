// Hulls of bodies that grow: each its own, all of its lengths by one factor.
#include "hulls.hpp"

namespace cairn {

std::int32_t Hulls::copy(std::int32_t h) {
  const auto repeat = [](auto& v, std::int64_t first, std::int64_t last) {
    for (std::int64_t i = first; i < last; ++i) {
      const auto value = v[std::size_t(i)];
      v.push_back(value);
    }
  };
  const std::int32_t v0 = first_vertex[h], v1 = first_vertex[h + 1], f0 = first_face[h], f1 = first_face[h + 1];
  const std::int32_t e0 = first_edge[h], e1 = first_edge[h + 1];
  const bool corners = first_corner.size() == offset.size() + 1;
  repeat(vertex, std::int64_t(dim) * v0, std::int64_t(dim) * v1);
  repeat(normal, std::int64_t(dim) * f0, std::int64_t(dim) * f1);
  repeat(offset, f0, f1);
  repeat(edge, 4 * std::int64_t(e0), 4 * std::int64_t(e1));
  if (corners) {
    repeat(corner_vertex, first_corner[f0], first_corner[f1]);
    if (!corner_edge.empty()) repeat(corner_edge, first_corner[f0], first_corner[f1]);
    for (std::int32_t f = f0; f < f1; ++f)
      first_corner.push_back(first_corner.back() + first_corner[f + 1] - first_corner[f]);
  }
  first_vertex.push_back(first_vertex.back() + v1 - v0);
  first_face.push_back(first_face.back() + f1 - f0);
  first_edge.push_back(first_edge.back() + e1 - e0);
  repeat(inner, h, h + 1);
  repeat(radius, h, h + 1);
  return count() - 1;
}

void Hulls::scale(std::int32_t h, double factor) {
  for (std::int64_t i = std::int64_t(dim) * first_vertex[h]; i < std::int64_t(dim) * first_vertex[h + 1]; ++i)
    vertex[std::size_t(i)] *= factor;
  // of a superquadric the last two are exponents
  const std::int32_t lengths = form(h) == Form::superquadric ? 3 : faces(h);
  for (std::int32_t f = 0; f < lengths; ++f) offset[std::size_t(first_face[h] + f)] *= factor;
  inner[std::size_t(h)] *= factor;
  radius[std::size_t(h)] *= factor;
}

} // namespace cairn
