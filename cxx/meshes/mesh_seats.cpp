#include "mesh_seats.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "../base/call.hpp"
#include "../base/vectors.hpp"
#include "../detection/candidates.hpp"

namespace cairn {

void MeshSeats::place(const MeshList& meshes, std::size_t numbers, const Nodes& nodes, const Contactors& contactors) {
  std::vector<std::int32_t> of_number(numbers, -1); // meshes
  for (std::size_t m = 0; m < meshes.size(); ++m) of_number[std::size_t(meshes[m].model.number) - 1] = std::int32_t(m);
  mapped_ = {};
  seats_.clear();
  facets_.clear();
  of_contactor_.assign(std::size_t(contactors.count), -1);
  std::size_t vertices = 0;
  for (std::int64_t c = 0; c < contactors.count; ++c) {
    const std::int32_t body = *contactors.body[c];
    if (body >= 0) continue;
    const auto number = std::size_t(-body - 1);
    if (number >= of_number.size() || of_number[number] < 0)
      throw Error("contactor " + std::to_string(*contactors.id[c]) + " is mapped from a mesh that is not there");
    of_contactor_[std::size_t(c)] = std::int32_t(seats_.size());
    seats_.push_back(find_seat(meshes, of_number[number], *contactors.part[c]));
    mapped_.contactor.push_back(std::int32_t(c));
    const Seat& s = seats_.back();
    if (s.role != Role::facet) continue;
    facets_.push_back(std::int32_t(c));
    const MeshModel& model = s.body->model;
    vertices += std::size_t(model.around_start[s.index + 1] - model.around_start[s.index]);
  }
  mapped_.bodies = std::int32_t(numbers);
  mapped_.centre.assign(seats_.size() * std::size_t(nodes.dim), 0.0);
  mapped_.direction.assign(seats_.size() * std::size_t(nodes.dim), 0.0);
  mapped_.half_length.assign(seats_.size(), 0.0);
  facet_vertices_.reserve(3 * vertices);
  mapped_.place = of_contactor_;
  if (nodes.dim == 2) find_next_edges(meshes);
  find_sides_of_nodes(meshes);
  part_from_themselves(meshes, contactors);
  find_sizes(meshes);
  find_nodes_beside(meshes);
}

// Edges in a row along the boundary of a mesh. Where several begin or end at a node none is the next one but of the
// last that the mesh tells of.
void MeshSeats::find_next_edges(const MeshList& meshes) {
  mapped_.before.assign(seats_.size(), -1);
  mapped_.after.assign(seats_.size(), -1);
  std::vector<std::vector<std::int32_t>> of_side(meshes.size()); // its place among the seats
  for (std::size_t m = 0; m < meshes.size(); ++m) of_side[m].assign(meshes[m].model.side_ids.size(), -1);
  for (std::size_t i = 0; i < seats_.size(); ++i)
    if (const Seat& s = seats_[i]; s.role == Role::edge)
      of_side[std::size_t(s.mesh)][std::size_t(s.index)] = std::int32_t(i);
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const MeshModel& model = meshes[m].model;
    for (std::size_t n = 0; n < model.side_to.size(); ++n) {
      const std::int32_t to = model.side_to[n], from = model.side_from[n];
      const std::int32_t first = to < 0 ? -1 : of_side[m][std::size_t(to)];
      const std::int32_t second = from < 0 ? -1 : of_side[m][std::size_t(from)];
      if (first < 0 || second < 0) continue;
      mapped_.after[std::size_t(first)] = mapped_.contactor[std::size_t(second)];
      mapped_.before[std::size_t(second)] = mapped_.contactor[std::size_t(first)];
    }
  }
}

// Sides at each node that is a contactor beside sides of its mesh. Mortars have whole sides instead.
void MeshSeats::find_sides_of_nodes(const MeshList& meshes) {
  std::vector<std::uint8_t> has(meshes.size(), 0); // 1: sides, 2: nodes
  for (const Seat& s : seats_)
    if (s.role != Role::point && !s.body->model.mortar) has[std::size_t(s.mesh)] |= s.role == Role::node ? 2 : 1;
  if (std::find(has.begin(), has.end(), 3) == has.end()) return;
  std::vector<std::vector<std::vector<std::int32_t>>> at(meshes.size());
  for (std::size_t i = 0; i < seats_.size(); ++i) {
    const Seat& s = seats_[i];
    if (has[std::size_t(s.mesh)] != 3 || s.role == Role::node || s.role == Role::point) continue;
    auto& of = at[std::size_t(s.mesh)];
    of.resize(std::size_t(s.body->model.nodes()));
    for (int j = 0; j < 4 && s.node(j) >= 0; ++j) of[std::size_t(s.node(j))].push_back(mapped_.contactor[i]);
  }
  mapped_.sides_start.assign(1, 0);
  for (const Seat& s : seats_) {
    if (has[std::size_t(s.mesh)] == 3 && s.role == Role::node) {
      const std::vector<std::int32_t>& of = at[std::size_t(s.mesh)][std::size_t(s.index)];
      mapped_.sides.insert(mapped_.sides.end(), of.begin(), of.end());
    }
    mapped_.sides_start.push_back(std::int64_t(mapped_.sides.size()));
  }
}

std::int32_t MeshSeats::Seat::node(int j) const {
  const MeshModel& m = body->model;
  if (role == Role::node) return j == 0 ? index : -1;
  if (role == Role::facet) return m.face_nodes[4 * std::size_t(index) + std::size_t(j)];
  return (role == Role::point ? m.point_nodes : m.side_nodes)[4 * std::size_t(index) + std::size_t(j)];
}

namespace {

// A side of a crack that a point on its other side was one with: its nodes stand where those of the point do.
bool across(const MeshSeats::Seat& point, const MeshSeats::Seat& side) {
  if (point.role != MeshSeats::Role::point) return false;
  const MeshModel& m = point.body->model;
  bool same = true;
  for (int j = 0; j < 4 && point.node(j) >= 0; ++j) {
    const std::int32_t node = point.node(j);
    std::int32_t twin = -1;
    for (int k = 0; k < 4 && side.node(k) >= 0 && twin < 0; ++k)
      if (std::equal(&m.reference[std::size_t(m.dim * node)], &m.reference[std::size_t(m.dim * node)] + m.dim,
                     &m.reference[std::size_t(m.dim * side.node(k))]))
        twin = side.node(k);
    if (twin < 0) return false;
    same = same && twin == node;
  }
  return !same;
}

} // namespace

bool MeshSeats::parted_warped(std::int32_t point, std::int32_t side) const {
  const Seat &one = seat(point), &other = seat(side);
  return one.mesh == other.mesh && other.is_half() && across(one, other);
}

// Points of bodies that touch themselves meet their own sides, but those next to them: that have a node in common, or
// a node of a side that has.
void MeshSeats::part_from_themselves(const MeshList& meshes, const Contactors& contactors) {
  std::int32_t next = mapped_.bodies;
  std::vector<std::int32_t> carrier(meshes.size(), -1);
  for (std::size_t m = 0; m < meshes.size(); ++m)
    if (meshes[m].model.self_contact) carrier[m] = next++;
  if (next == mapped_.bodies) return;
  mapped_.apart_depth.assign(seats_.size(), 0.0);
  std::vector<std::vector<std::vector<std::int32_t>>> sides(meshes.size()); // contactors of the sides at each node
  for (std::size_t i = 0; i < seats_.size(); ++i) {
    const Seat& s = seats_[i];
    if (carrier[std::size_t(s.mesh)] < 0 || s.role == Role::node || s.role == Role::point) continue;
    const MeshModel& m = s.body->model;
    mapped_.apart.push_back(mapped_.contactor[i]);
    mapped_.apart_carrier.push_back(carrier[std::size_t(s.mesh)]);
    std::vector<std::vector<std::int32_t>>& at = sides[std::size_t(s.mesh)];
    at.resize(std::size_t(m.nodes()));
    double shortest = std::numeric_limits<double>::infinity();
    for (int j = 0; j < 4 && s.node(j) >= 0; ++j) {
      at[std::size_t(s.node(j))].push_back(mapped_.contactor[i]);
      const std::int32_t after = j + 1 < 4 && s.node(j + 1) >= 0 ? s.node(j + 1) : s.node(0);
      double square = 0;
      for (int k = 0; k < m.dim; ++k) {
        const double x = m.reference[std::size_t(m.dim * after + k)] - m.reference[std::size_t(m.dim * s.node(j) + k)];
        square += x * x;
      }
      shortest = std::min(shortest, std::sqrt(square));
    }
    constexpr double share = 0.05; // as thick as edges are
    mapped_.apart_depth[i] = std::max(*contactors.radius[mapped_.contactor[i]], share * shortest);
  }
  mapped_.near_start.assign(1, 0);
  for (const Seat& s : seats_) {
    const auto first = std::ptrdiff_t(mapped_.near.size());
    const std::vector<std::vector<std::int32_t>>& at = sides[std::size_t(s.mesh)];
    if (!at.empty() && (s.role == Role::node || s.role == Role::point))
      for (int j = 0; j < 4 && s.node(j) >= 0; ++j)
        for (const std::int32_t side : at[std::size_t(s.node(j))]) {
          const Seat& beside = seat(side);
          for (int k = 0; k < 4 && beside.node(k) >= 0; ++k) {
            const std::vector<std::int32_t>& more = at[std::size_t(beside.node(k))];
            std::copy_if(more.begin(), more.end(), std::back_inserter(mapped_.near),
                         [&](std::int32_t other) { return !across(s, seat(other)); });
          }
        }
    std::sort(mapped_.near.begin() + first, mapped_.near.end());
    mapped_.near.erase(std::unique(mapped_.near.begin() + first, mapped_.near.end()), mapped_.near.end());
    mapped_.near_start.push_back(std::int64_t(mapped_.near.size()));
  }
}

// Part of a mesh with a number, and the nodes of its middle with weights.
MeshSeats::Seat MeshSeats::find_seat(const MeshList& meshes, std::int32_t which, std::int64_t part) const {
  const MeshBody& mesh = meshes[std::size_t(which)];
  const MeshModel& m = mesh.model;
  Seat s;
  s.mesh = which;
  s.first_node = mesh.node(0);
  s.body = &mesh;
  const auto among = [&](const std::vector<std::int64_t>& ids, Role role) {
    const auto at = std::lower_bound(ids.begin(), ids.end(), part);
    if (at == ids.end() || *at != part) return false;
    s.index = std::int32_t(at - ids.begin());
    s.role = role;
    return true;
  };
  if (among(m.node_ids, Role::node)) {
    s.middle.node[0] = mesh.node(s.index);
    s.middle.weight[0] = 1;
    return s;
  }
  const bool between = among(m.point_ids, Role::point);
  if (!between && !among(m.side_ids, m.dim == 2 ? Role::edge : Role::facet))
    throw Error("the mesh '" + m.name + "' has no part " + std::to_string(part));
  const std::int32_t* node = &(between ? m.point_nodes : m.side_nodes)[4 * std::size_t(s.index)];
  for (int j = 0; j < 4 && node[j] >= 0; ++j) {
    s.middle.node[j] = mesh.node(node[j]);
    s.middle.weight[j] = between ? m.point_weights[4 * std::size_t(s.index) + std::size_t(j)] : 1.0 / m.dim;
  }
  return s;
}

void MeshSeats::follow(const Nodes& nodes, const Contactors& contactors) {
  const int dim = nodes.dim;
  facet_vertices_.clear();
  mapped_.node_position = nodes.position.values.data();
  for (std::size_t i = 0; i < seats_.size(); ++i) {
    const Seat& s = seats_[i];
    double* centre = &mapped_.centre[std::size_t(dim) * i];
    for (int k = 0; k < dim; ++k) centre[k] = s.middle.of(nodes.position, k);
    if (s.role == Role::edge) { // inside the body by its thickness, which is its radius
      const double *one = nodes.position[s.middle.node[0]], *two = nodes.position[s.middle.node[1]];
      const double x = two[0] - one[0], y = two[1] - one[1], length = std::sqrt(x * x + y * y);
      const double thickness = *contactors.radius[mapped_.contactor[i]];
      double* along = &mapped_.direction[std::size_t(dim) * i];
      along[0] = x / length;
      along[1] = y / length;
      mapped_.half_length[i] = length / 2;
      centre[0] -= along[1] * thickness;
      centre[1] += along[0] * thickness;
    } else if (s.role == Role::facet) {
      const MeshBody& mesh = *s.body;
      for (std::int32_t e = mesh.model.around_start[s.index]; e < mesh.model.around_start[s.index + 1]; ++e)
        for (int k = 0; k < 3; ++k)
          facet_vertices_.push_back(nodes.position[mesh.node(mesh.model.around[e])][k] - centre[k]);
    }
  }
}

namespace {

using Corner = double[3];

// Barycentric coordinates of the foot of a point on the plane of a triangle.
void in_triangle(const Corner corner[], const double* point, double weight[4], double normal[3]) {
  double e[3], f[3], r[3], area[3], part[3];
  for (int k = 0; k < 3; ++k) {
    e[k] = corner[1][k] - corner[0][k];
    f[k] = corner[2][k] - corner[0][k];
    r[k] = point[k] - corner[0][k];
  }
  cross(e, f, area);
  const double square = dot(area, area);
  cross(r, f, part);
  weight[1] = dot(part, area) / square;
  cross(e, r, part);
  weight[2] = dot(part, area) / square;
  weight[0] = 1 - weight[1] - weight[2];
  weight[3] = 0;
  for (int k = 0; k < 3; ++k) normal[k] = area[k] / std::sqrt(square);
}

void bilinear(double a, double b, double share[4], double by_a[4], double by_b[4]) {
  const double sa[4] = {-1, 1, 1, -1}, sb[4] = {-1, -1, 1, 1};
  for (int i = 0; i < 4; ++i) {
    share[i] = 0.25 * (1 + sa[i] * a) * (1 + sb[i] * b);
    by_a[i] = 0.25 * sa[i] * (1 + sb[i] * b);
    by_b[i] = 0.25 * sb[i] * (1 + sa[i] * a);
  }
}

// Shape functions of a quadrilateral where the line along `normal` through a point meets it, by Newton's method in the
// plane across the normal.
void in_quadrilateral(const Corner corner[4], const double* point, const double* normal, double share[4]) {
  int least = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(normal[k]) < std::abs(normal[least])) least = k;
  double axis[3] = {0, 0, 0}, t[3], s[3];
  axis[least] = 1;
  cross(axis, normal, t);
  const double length = std::sqrt(dot(t, t));
  for (double& k : t) k /= length;
  cross(normal, t, s);
  double x[4][2], target[2], a = 0, b = 0, by_a[4], by_b[4];
  for (int i = 0; i < 4; ++i) x[i][0] = dot(t, corner[i]), x[i][1] = dot(s, corner[i]);
  target[0] = dot(t, point);
  target[1] = dot(s, point);
  constexpr int most = 20;
  for (int pass = 0; pass < most; ++pass) {
    bilinear(a, b, share, by_a, by_b);
    double wrong[2] = {target[0], target[1]}, j[2][2] = {{0, 0}, {0, 0}};
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 2; ++k) {
        wrong[k] -= share[i] * x[i][k];
        j[k][0] += by_a[i] * x[i][k];
        j[k][1] += by_b[i] * x[i][k];
      }
    const double determinant = j[0][0] * j[1][1] - j[0][1] * j[1][0];
    const double da = (j[1][1] * wrong[0] - j[0][1] * wrong[1]) / determinant;
    const double db = (j[0][0] * wrong[1] - j[1][0] * wrong[0]) / determinant;
    if (!std::isfinite(da) || !std::isfinite(db)) break;
    a += da;
    b += db;
    if (std::max(std::abs(da), std::abs(db)) < 1e-14) break; // of a coordinate that goes from -1 to 1
  }
  bilinear(a, b, share, by_a, by_b);
}

} // namespace

std::array<std::int32_t, 4> MeshSeats::nodes_of_side(std::int32_t contactor) const {
  const Seat& place = seat(contactor);
  if (place.role == Role::edge) return {place.middle.node[0], place.middle.node[1], -1, -1};
  const MeshModel& model = place.body->model;
  const std::int32_t* face = &model.face_nodes[4 * place.index];
  const std::int32_t* node = face[3] >= 0 ? face : &model.side_nodes[4 * place.index];
  std::array<std::int32_t, 4> found{-1, -1, -1, -1};
  for (std::size_t j = 0; j < (face[3] >= 0 ? 4u : 3u); ++j) found[j] = place.first_node + node[j];
  return found;
}

void MeshSeats::let_past_ends(const Candidates& candidates) {
  past_ends_.clear();
  for (const RimSeat& seat : candidates.seats)
    if (const auto side = std::int32_t(seat.side); carries(side) && this->seat(side).role == Role::edge)
      past_ends_.emplace_back(side, std::int32_t(seat.node));
  std::sort(past_ends_.begin(), past_ends_.end());
}

Mapping MeshSeats::mapping(const Nodes& nodes, std::int32_t contactor, const double* point, std::int32_t other) const {
  const Seat& place = seat(contactor);
  Mapping m;
  m.mesh = place.mesh;
  if (place.role == Role::node || place.role == Role::point) {
    for (int j = 0; j < 4 && place.middle.node[j] >= 0; ++j) {
      m.node[j] = place.middle.node[j] - place.first_node;
      m.weight[j] = place.middle.weight[j];
    }
    return m;
  }
  if (place.role == Role::edge) {
    const double *one = nodes.position[place.middle.node[0]], *two = nodes.position[place.middle.node[1]];
    const double x = two[0] - one[0], y = two[1] - one[1];
    // beyond an end it is the end that touches
    double t = ((point[0] - one[0]) * x + (point[1] - one[1]) * y) / (x * x + y * y);
    if (!std::binary_search(past_ends_.begin(), past_ends_.end(), std::pair(contactor, other)))
      t = std::clamp(t, 0.0, 1.0);
    for (int j = 0; j < 2; ++j) m.node[j] = place.middle.node[j] - place.first_node;
    m.weight[0] = 1 - t;
    m.weight[1] = t;
    return m;
  }
  const MeshBody& mesh = *place.body;
  const std::int32_t* node = &mesh.model.side_nodes[4 * place.index];
  const std::int32_t* face = &mesh.model.face_nodes[4 * place.index];
  Corner corner[4];
  const auto corners = [&](const std::int32_t* of, int n) {
    for (int i = 0; i < n; ++i) std::copy_n(nodes.position[mesh.node(of[i])], 3, corner[i]);
  };
  double normal[3];
  corners(node, 3);
  in_triangle(corner, point, m.weight, normal);
  std::copy_n(node, 3, m.node);
  if (face[3] >= 0) {
    corners(face, 4);
    in_quadrilateral(corner, point, normal, m.weight);
    std::copy_n(face, 4, m.node);
  }
  return m;
}

} // namespace cairn
