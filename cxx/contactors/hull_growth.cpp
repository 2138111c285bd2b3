// Hulls of bodies that grow: each its own, all of its lengths by one factor.
#include "hulls.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

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

void Hulls::take_lengths(std::int32_t h, const Hulls& from, std::int32_t of) {
  std::copy_n(from.vertex.begin() + std::ptrdiff_t(from.dim) * from.first_vertex[of], dim * vertices(h),
              vertex.begin() + std::ptrdiff_t(dim) * first_vertex[h]);
  std::copy_n(from.offset.begin() + from.first_face[of], faces(h), offset.begin() + first_face[h]);
  inner[std::size_t(h)] = from.inner[std::size_t(of)];
  radius[std::size_t(h)] = from.radius[std::size_t(of)];
}

// A face whose corners left their plane keeps the mean of their normals (Newell), and holds all of them.
void Hulls::follow_vertices(std::int32_t h) {
  const double* v = &vertex[std::size_t(dim) * first_vertex[h]];
  const std::int32_t corners = vertices(h);
  for (std::int32_t f = first_face[h]; f < first_face[h + 1]; ++f) {
    double n[3] = {0, 0, 0}, size = 0, reach = -std::numeric_limits<double>::infinity();
    const int axes = std::min(dim, 3);
    const std::int32_t begin = dim == 3 ? first_corner[f] : f - first_face[h],
                       many = dim == 3 ? first_corner[f + 1] - begin : 2;
    const auto corner = [&](std::int32_t k) {
      return v + dim * (dim == 3 ? corner_vertex[begin + k % many] - 1 : (begin + k) % corners);
    };
    if (dim == 2) {
      n[0] = corner(1)[1] - corner(0)[1];
      n[1] = corner(0)[0] - corner(1)[0];
    }
    for (std::int32_t k = 0; dim == 3 && k < many; ++k) {
      const double *a = corner(k), *b = corner(k + 1);
      for (int d = 0; d < 3; ++d) n[d] += (a[(d + 1) % 3] - b[(d + 1) % 3]) * (a[(d + 2) % 3] + b[(d + 2) % 3]);
    }
    for (int d = 0; d < axes; ++d) size += n[d] * n[d];
    size = std::sqrt(size);
    for (int d = 0; d < axes; ++d) normal[std::size_t(dim) * f + d] = n[d] / size;
    for (std::int32_t k = 0; k < many; ++k) {
      double along = 0;
      for (int d = 0; d < axes; ++d) along += n[d] / size * corner(k)[d];
      reach = std::max(reach, along);
    }
    offset[std::size_t(f)] = reach;
  }
  radius[std::size_t(h)] = measure(h, false);
  const double least = *std::min_element(offset.begin() + first_face[h], offset.begin() + first_face[h + 1]);
  inner[std::size_t(h)] = least > 0 ? least : -radius[std::size_t(h)];
}

} // namespace cairn
