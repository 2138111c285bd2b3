// The part of a mesh's surface that each of its contact nodes and points stands for.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "../base/vectors.hpp"
#include "../bodies/body.hpp"
#include "mesh_areas.hpp"
#include "side_shares.hpp"

namespace cairn {

namespace {

struct OnSide {
  double at; // of an edge: 0 at its first node, 1 at its second
  double* area;
  int corner; // -1: a point
};

// How far along an edge what a part of its area needs ends: round an axis it is wider at one end.
double way_of(const MeshModel& m, const std::int32_t* node, double share) {
  if (!m.ring) return share;
  const double one = std::abs(m.reference[2 * std::size_t(node[0])] - m.axis);
  const double two = std::abs(m.reference[2 * std::size_t(node[1])] - m.axis), wanted = share * (one + two) / 2;
  return 2 * wanted / (one + std::sqrt(std::max(0.0, one * one + 2 * (two - one) * wanted)));
}

double area_of_edge(const MeshModel& m, const std::int32_t* node, double from, double to) {
  const double *one = &m.reference[2 * std::size_t(node[0])], *two = &m.reference[2 * std::size_t(node[1])];
  const auto wide = [&](const double* x) { return m.ring ? 2 * std::numbers::pi * std::abs(x[0] - m.axis) : 1; };
  const double length = std::hypot(two[0] - one[0], two[1] - one[1]);
  return length * (to - from) * (wide(one) + (wide(two) - wide(one)) * (from + to) / 2);
}

double face_area(const double* corner[4], int corners) {
  double area = 0;
  for (int j = 2; j < corners; ++j) {
    double e[3], f[3], n[3];
    for (int k = 0; k < 3; ++k) {
      e[k] = corner[j - 1][k] - corner[0][k];
      f[k] = corner[j][k] - corner[0][k];
    }
    cross(e, f, n);
    area += std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
  }
  return area;
}

// Points by the first of their nodes: those of node n stand in `order` from first[n] to first[n + 1].
void sort_points(const MeshModel& m, std::vector<std::int32_t>& first, std::vector<std::int32_t>& order) {
  const std::size_t points = m.point_nodes.size() / 4;
  first.assign(std::size_t(m.nodes()) + 1, 0);
  order.resize(points);
  for (std::size_t p = 0; p < points; ++p) ++first[std::size_t(m.point_nodes[4 * p]) + 1];
  for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
  std::vector<std::int32_t> next(first.begin(), first.end() - 1);
  for (std::size_t p = 0; p < points; ++p) order[next[m.point_nodes[4 * p]]++] = std::int32_t(p);
}

// Shares an edge among its contactors: its two end nodes have their given shares; where points are among them, each has
// the part nearer to it than to the others.
template <class Add>
void share_edge(const MeshModel& m, const std::int32_t* node, const double* share, std::vector<OnSide>& on_side,
                const Add& add) {
  const double whole = share[0] + share[1];
  const bool ends = on_side.size() == 2 && on_side[0].corner == 0 && on_side[1].corner == 1 && whole > 0;
  const double cut = ends ? way_of(m, node, share[0] / whole) : 0.5;
  std::sort(on_side.begin(), on_side.end(), [](const OnSide& a, const OnSide& b) { return a.at < b.at; });
  for (std::size_t i = 0; i < on_side.size(); ++i) {
    const double from = i == 0 ? 0 : (on_side[i - 1].at + on_side[i].at) / 2;
    const double to = i + 1 == on_side.size() ? 1 : (on_side[i].at + on_side[i + 1].at) / 2;
    const double near = area_of_edge(m, node, from, to);
    if (ends)
      add(on_side[i], i == 0 ? 0 : cut, i == 0 ? cut : 1, share[i], near);
    else
      add(on_side[i], from, to, near, near);
  }
}

// Shares a face among its contactors: points have equal parts; nodes have their given shares and equal parts of the
// shares of corners that are no contactors.
template <class Add>
void share_face(const MeshModel& m, const std::int32_t* node, int corners, const double* share,
                const std::vector<OnSide>& on_side, const Add& add) {
  const double* corner[4];
  for (int j = 0; j < corners; ++j) corner[j] = &m.reference[std::size_t(m.dim) * node[j]];
  const bool nodes = std::none_of(on_side.begin(), on_side.end(), [](const OnSide& o) { return o.corner < 0; });
  const double area = face_area(corner, corners), alike = area / double(on_side.size());
  double left = area;
  for (const OnSide& owner : on_side) left -= nodes ? share[owner.corner] : 0;
  left = int(on_side.size()) == corners ? 0 : left / double(on_side.size());
  for (const OnSide& owner : on_side) add(owner, 0, 1, nodes ? share[owner.corner] + left : alike, alike);
}

} // namespace

// By the reference configuration.
void MeshAreas::find(const MeshList& meshes, const MeshSeats& all, const std::vector<std::uint8_t>& is_mark) {
  using Role = MeshSeats::Role;
  const std::span<const MeshSeats::Seat> seats = all.seats();
  area_.assign(seats.size(), 0);
  near_area_.assign(seats.size(), 0);
  side_share_.clear();
  parts_.clear();
  first_part_.assign(1, 0);
  first_side_.clear();
  std::vector<OnSide> on_side;
  const auto add = [&](const OnSide& owner, double from, double to, double area, double near) {
    *owner.area += area;
    near_area_[std::size_t(owner.area - area_.data())] += near;
    parts_.push_back({all.mapped().contactor[std::size_t(owner.area - area_.data())], owner.corner, from, to, area});
  };
  std::vector<std::size_t> by_mesh; // those on nodes and points
  for (std::size_t i = 0; i < seats.size(); ++i)
    if (const Role role = seats[i].role; role == Role::point || (role == Role::node && !is_mark[i]))
      by_mesh.push_back(i);
  std::stable_sort(by_mesh.begin(), by_mesh.end(),
                   [&](std::size_t a, std::size_t b) { return seats[a].mesh < seats[b].mesh; });
  auto next_seat = by_mesh.begin();
  for (std::size_t which = 0; which < meshes.size(); ++which) {
    const MeshModel& m = meshes[which].model;
    const std::size_t points = m.point_nodes.size() / 4;
    std::vector<double*> of_node(std::size_t(m.nodes()), nullptr),
        of_point(points, nullptr); // null: it touches nothing
    for (; next_seat != by_mesh.end() && std::size_t(seats[*next_seat].mesh) == which; ++next_seat) {
      const MeshSeats::Seat& s = seats[*next_seat];
      (s.role == Role::node ? of_node : of_point)[std::size_t(s.index)] = &area_[*next_seat];
    }
    std::vector<std::int32_t> first, order;
    sort_points(m, first, order);
    const auto on_all_of = [&](std::int32_t p, const std::int32_t* node, int corners) {
      const std::int32_t* own = &m.point_nodes[4 * std::size_t(p)];
      return std::all_of(node, node + corners, [&](std::int32_t n) { return std::find(own, own + 4, n) < own + 4; });
    };
    const auto each_point = [&](const std::int32_t* node, int corners, auto&& take) {
      for (int j = 0; j < corners; ++j)
        for (std::int32_t k = first[node[j]]; k < first[node[j] + 1]; ++k) {
          const std::int32_t p = order[k];
          bool here = of_point[std::size_t(p)] != nullptr;
          for (int l = 0; l < 4 && here; ++l)
            here = m.point_nodes[4 * p + l] < 0 ||
                   std::find(node, node + corners, m.point_nodes[4 * p + l]) < node + corners;
          if (here) take(p);
        }
    };
    const std::vector<double> shares = shares_of_sides(m);
    side_share_.insert(side_share_.end(), shares.begin(), shares.end());
    first_side_.push_back(std::int64_t(first_part_.size()) - 1);
    for (std::size_t s = 0; s < m.side_nodes.size() / 4; ++s, first_part_.push_back(std::int64_t(parts_.size()))) {
      const std::int32_t* node = &m.side_nodes[4 * s];
      const int corners = node[2] < 0 ? 2 : node[3] < 0 ? 3 : 4;
      on_side.clear();
      for (int j = 0; j < corners; ++j)
        if (of_node[node[j]]) on_side.push_back({double(j), of_node[node[j]], j});
      if (m.dim == 2) {
        each_point(node, 2, [&](std::int32_t p) {
          double at = 0;
          for (int l = 0; l < 4; ++l)
            if (m.point_nodes[4 * p + l] == node[1]) at += m.point_weights[4 * p + l];
          on_side.push_back({at, of_point[std::size_t(p)], -1});
        });
        share_edge(m, node, &shares[3 * s], on_side, add);
        continue;
      }
      each_point(node, corners, [&](std::int32_t p) { on_side.push_back({0, of_point[std::size_t(p)], -1}); });
      const std::int32_t* whole = &m.face_nodes[4 * s]; // of which this is a half where there is a fourth node
      if (whole[3] >= 0)
        each_point(whole, 4, [&](std::int32_t p) {
          if (on_all_of(p, whole, 4)) on_side.push_back({0, of_point[std::size_t(p)], -1});
        });
      share_face(m, node, corners, &shares[3 * s], on_side, add);
    }
  }
}

std::span<const MeshAreas::SidePart> MeshAreas::parts(const MeshSeats::Seat& side) const {
  const std::size_t at = std::size_t(first_side_[std::size_t(side.mesh)]) + std::size_t(side.index);
  return {parts_.data() + first_part_[at], parts_.data() + first_part_[at + 1]};
}

std::span<const double, 3> MeshAreas::shares(const MeshSeats::Seat& side) const {
  const std::size_t at = std::size_t(first_side_[std::size_t(side.mesh)]) + std::size_t(side.index);
  return std::span<const double, 3>(&side_share_[3 * at], 3);
}

double MeshAreas::edge_area(const MeshSeats::Seat& edge, double from, double to) {
  const MeshModel& m = edge.body->model;
  return area_of_edge(m, &m.side_nodes[4 * std::size_t(edge.index)], from, to);
}

} // namespace cairn
