#include "closed_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "../fe/bulk_model.hpp"
#include "../fe/elements.hpp"
#include "mesh_body.hpp"

namespace cairn {
namespace {

// Nodes of a side, -1 where fewer, as edges or triangles.
void add_flat(int dim, const std::int32_t* node, std::vector<std::int32_t>& out) {
  out.insert(out.end(), node, node + dim);
  if (dim == 3 && node[3] >= 0) out.insert(out.end(), {node[0], node[2], node[3]});
}

std::vector<std::int32_t> boundary_of_cells(const MeshModel& m) {
  std::vector<CellSide> side;
  const auto take = [&](const ElementInfo& e, const std::vector<std::int32_t>& node) {
    for (std::size_t first = 0; first < node.size(); first += std::size_t(e.nodes))
      for (CellSide s : sides_of(e)) {
        for (std::int32_t& i : s)
          if (i >= 0) i = node[first + std::size_t(i)];
        side.push_back(s);
      }
  };
  for (const ElasticCells& c : m.cells) take(*c.element, c.node);
  if (const BulkModel* solid = m.bulk ? m.bulk->solid() : nullptr)
    for (const BulkCells& c : solid->cells()) take(*c.element, c.node);
  std::vector<std::pair<CellSide, std::size_t>> sorted;
  sorted.reserve(side.size());
  for (std::size_t i = 0; i < side.size(); ++i) {
    sorted.emplace_back(side[i], i);
    std::sort(sorted.back().first.begin(), sorted.back().first.end());
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<std::int32_t> out;
  for (std::size_t i = 0, end; i < sorted.size(); i = end) {
    for (end = i + 1; end < sorted.size() && sorted[end].first == sorted[i].first;) ++end;
    if (end == i + 1) add_flat(m.dim, side[sorted[i].second].data(), out);
  }
  return out;
}

// True if the sides close: every end of an edge (2D) or edge of a triangle (3D) is balanced by a neighbour of opposite
// direction.
bool closes(int dim, const std::vector<std::int32_t>& side) {
  std::vector<std::array<std::int32_t, 3>> rim; // nodes of an end or edge, rising; direction
  for (std::size_t s = 0; s < side.size(); s += std::size_t(dim))
    for (int k = 0; k < dim; ++k) {
      const std::int32_t one = side[s + std::size_t(k)], other = side[s + std::size_t((k + 1) % dim)];
      if (dim == 2)
        rim.push_back({one, 0, k == 0 ? 1 : -1});
      else
        rim.push_back({std::min(one, other), std::max(one, other), one < other ? 1 : -1});
    }
  std::sort(rim.begin(), rim.end());
  for (std::size_t i = 0, end; i < rim.size(); i = end) {
    int sum = 0;
    for (end = i; end < rim.size() && rim[end][0] == rim[i][0] && rim[end][1] == rim[i][1]; ++end) sum += rim[end][2];
    if (sum != 0) return false;
  }
  return !side.empty();
}

} // namespace

std::vector<std::int32_t> closed_sides(const MeshModel& m) {
  std::vector<std::int32_t> out = boundary_of_cells(m);
  if (out.empty())
    for (std::size_t s = 0; s < m.side_nodes.size(); s += 4) add_flat(m.dim, &m.side_nodes[s], out);
  if (!closes(m.dim, out)) out.clear();
  return out;
}

ClosedSurface::ClosedSurface(int dim, std::vector<std::int32_t> side, const double* place)
    : dim_(dim), side_(std::move(side)), place_(place) {
  const auto sides = std::int64_t(side_.size()) / dim;
  const auto corner = [&](std::int64_t s, int j) { return &place_[dim_ * side_[std::size_t(dim_ * s + j)]]; };
  strips_ = std::max<std::int64_t>(1, dim == 2 ? sides : std::int64_t(std::sqrt(double(sides))));
  for (int k = 1; k < dim; ++k) {
    double high = low_[k] = sides > 0 ? corner(0, 0)[k] : 0;
    for (const std::int32_t i : side_)
      low_[k] = std::min(low_[k], place_[dim * i + k]), high = std::max(high, place_[dim * i + k]);
    per_length_[k] = high > low_[k] ? double(strips_) / (high - low_[k]) : 0;
  }
  const auto each = [&](auto&& use) { // of the strips that a side is in
    for (std::int64_t s = 0; s < sides; ++s) {
      std::int64_t first[3] = {0, 0, 0}, last[3] = {0, 0, 0};
      for (int k = 1; k < dim_; ++k) {
        double low = corner(s, 0)[k], high = low;
        for (int j = 1; j < dim_; ++j) low = std::min(low, corner(s, j)[k]), high = std::max(high, corner(s, j)[k]);
        first[k] = strip(k, low), last[k] = strip(k, high);
      }
      for (std::int64_t j = first[2]; j <= last[2]; ++j)
        for (std::int64_t i = first[1]; i <= last[1]; ++i) use(std::size_t(strips_ * j + i), std::int32_t(s));
    }
  };
  start_.assign(std::size_t(dim == 2 ? strips_ : strips_ * strips_) + 1, 0);
  each([&](std::size_t at, std::int32_t) { ++start_[at + 1]; });
  for (std::size_t k = 1; k < start_.size(); ++k) start_[k] += start_[k - 1];
  sides_in_.resize(std::size_t(start_.back()));
  std::vector<std::int64_t> next(start_.begin(), start_.end() - 1);
  each([&](std::size_t at, std::int32_t s) { sides_in_[std::size_t(next[at]++)] = s; });
}

std::int64_t ClosedSurface::strip(int axis, double x) const {
  const double at = (x - low_[axis]) * per_length_[axis];
  return std::int64_t(std::clamp(at, 0.0, double(strips_ - 1)));
}

// True if the segment between two places, at the height of the point, lies farther along than the point (ray crossing).
// The lower end belongs to the segment, the upper end does not.
bool ClosedSurface::ahead(const double* one, const double* other, int across, int along, const double* point) const {
  if ((one[across] <= point[across]) == (other[across] <= point[across])) return false;
  if (one[across] > other[across]) std::swap(one, other);
  return (other[along] - one[along]) * (point[across] - one[across]) >
         (point[along] - one[along]) * (other[across] - one[across]);
}

int ClosedSurface::turns(const double* point) const {
  std::int64_t at = 0;
  for (int k = dim_ - 1; k > 0; --k) at = strips_ * at + strip(k, point[k]);
  int sum = 0;
  for (auto e = start_[std::size_t(at)]; e < start_[std::size_t(at) + 1]; ++e) {
    const std::int32_t* node = &side_[std::size_t(dim_ * sides_in_[std::size_t(e)])];
    const double *a = &place_[dim_ * node[0]], *b = &place_[dim_ * node[1]];
    if (dim_ == 2) {
      if (ahead(a, b, 1, 0, point)) sum += a[1] < b[1] ? 1 : -1;
      continue;
    }
    const double* c = &place_[dim_ * node[2]];
    if ((int(ahead(a, b, 2, 1, point)) + int(ahead(b, c, 2, 1, point)) + int(ahead(c, a, 2, 1, point))) % 2 == 0)
      continue;
    double e1[3], e2[3], to[3];
    for (int k = 0; k < 3; ++k) e1[k] = b[k] - a[k], e2[k] = c[k] - a[k], to[k] = a[k] - point[k];
    const double n[] = {e1[1] * e2[2] - e1[2] * e2[1], e1[2] * e2[0] - e1[0] * e2[2], e1[0] * e2[1] - e1[1] * e2[0]};
    const double far = n[0] * to[0] + n[1] * to[1] + n[2] * to[2];
    if (n[0] > 0 && far > 0) ++sum;
    if (n[0] < 0 && far < 0) --sum;
  }
  return sum;
}

} // namespace cairn
