// Size of the cells of a mesh at contacts, and names of its contactors in messages.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "mesh_seats.hpp"

namespace cairn {

namespace {

constexpr double none = std::numeric_limits<double>::infinity();
// Share of a cell by which its nodes may slide past the rim of the opposite surface. A node at the rim of a face stands
// for half a cell, of which more than half still lies on the other body there.
constexpr double past_a_rim = 0.25;

double distance(const MeshModel& m, std::int64_t one, std::int64_t two) {
  double square = 0;
  for (int k = 0; k < m.dim; ++k) {
    const double x = m.reference[std::size_t(m.dim * one + k)] - m.reference[std::size_t(m.dim * two + k)];
    square += x * x;
  }
  return std::sqrt(square);
}

// Distance of each node to the nearest node of its cells [m], by the pattern of its matrices.
std::vector<double> sizes_at_nodes(const MeshModel& m) {
  std::vector<double> size(std::size_t(m.nodes()), none);
  for (std::int64_t column = 0; column < m.mass.n; column += m.dim)
    for (std::int64_t e = m.mass.start[std::size_t(column)]; e < m.mass.start[std::size_t(column) + 1]; ++e) {
      const std::int64_t one = column / m.dim, two = m.mass.row[std::size_t(e)] / m.dim;
      const double apart = distance(m, one, two);
      if (!(apart > 0)) continue;
      for (const std::int64_t node : {one, two}) size[std::size_t(node)] = std::min(size[std::size_t(node)], apart);
    }
  return size;
}

} // namespace

void MeshSeats::find_sizes(const MeshList& meshes) {
  std::vector<std::vector<double>> of_node;
  for (const MeshBody& mesh : meshes) of_node.push_back(sizes_at_nodes(mesh.model));
  size_.clear();
  for (const Seat& s : seats_) {
    const MeshBody& mesh = *s.body;
    double size = none;
    for (int j = 0; j < 4 && s.node(j) >= 0; ++j)
      size = std::min(size, of_node[std::size_t(s.mesh)][std::size_t(s.node(j))]);
    if (!(size < none)) size = mesh.size();
    size_.push_back(size > 0 ? size : none); // a node alone is no cell to pass through
    mapped_.hair.push_back(s.is_side() || !(size > 0 && size < none) ? 0 : past_a_rim * size);
  }
}

// Nodes that each contact node has cells with, from which it is seen which way the body lies.
void MeshSeats::find_nodes_beside(const MeshList& meshes) {
  std::vector<std::vector<std::vector<std::int32_t>>> of(meshes.size());
  std::vector<std::uint8_t> asked(meshes.size(), 0);
  for (const Seat& s : seats_) asked[std::size_t(s.mesh)] |= s.role == Role::node;
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const MeshModel& model = meshes[m].model;
    if (!asked[m]) continue;
    of[m].resize(std::size_t(model.nodes()));
    for (std::int64_t column = 0; column < model.mass.n; column += model.dim)
      for (std::int64_t e = model.mass.start[std::size_t(column)]; e < model.mass.start[std::size_t(column) + 1]; ++e) {
        const std::int32_t row = model.mass.row[std::size_t(e)], one = std::int32_t(column / model.dim);
        if (row % model.dim != 0 || row == column) continue;
        of[m][std::size_t(one)].push_back(meshes[m].node(row / model.dim));
        of[m][std::size_t(row / model.dim)].push_back(meshes[m].node(one));
      }
  }
  mapped_.beside.clear();
  mapped_.beside_start.assign(1, 0);
  for (const Seat& s : seats_) {
    if (s.role == Role::node) {
      const std::vector<std::int32_t>& near = of[std::size_t(s.mesh)][std::size_t(s.index)];
      mapped_.beside.insert(mapped_.beside.end(), near.begin(), near.end());
    }
    mapped_.beside_start.push_back(std::int64_t(mapped_.beside.size()));
  }
}

std::string MeshSeats::describe(std::int32_t contactor) const {
  const Seat& s = seat(contactor);
  const MeshModel& m = s.body->model;
  std::string text;
  if (s.role == Role::node) {
    text = m.bulk ? m.bulk->place_of_node(s.index) + "," : "node " + std::to_string(s.index);
  } else {
    text = s.role == Role::point ? "the point between nodes" : "the side with nodes";
    for (int j = 0; j < 4 && s.node(j) >= 0; ++j) text.append(" ").append(std::to_string(s.node(j)));
  }
  return text + " of the mesh '" + m.name + "'";
}

} // namespace cairn
