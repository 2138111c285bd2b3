// Bodies and vectors of a periodic cell between steps (Lees & Edwards 1972).
#include <algorithm>
#include <cmath>

#include "simulation.hpp"

namespace cairn {

// Keys of contacts name images: they follow bodies that were moved by whole cells, so that impulses and bonds find them
// again.
ContactMemory Simulation::after_move(ContactMemory memory, const std::vector<std::array<int, 3>>& moved) const {
  for (ContactKey& key : memory.keys) {
    const auto a = contactor(key.contactor_a), b = contactor(key.contactor_b);
    if (a < 0 || b < 0) continue;
    const auto way = [&](std::int32_t c) { // nodes of a mesh move together
      const std::int32_t body = *scene.contactors.body[c];
      return moved[std::size_t(body < 0 ? scene.bodies.count + meshes.middle(c).node[0] : body)].data();
    };
    key.image = image_after_move(key.image, way(a), way(b));
  }
  return memory;
}

// The same after cell vector k lost so many times vector i.
ContactMemory after_lean(ContactMemory memory, int k, int i, int cells) {
  for (ContactKey& key : memory.keys) key.image = image_after_lean(key.image, k, i, cells);
  return memory;
}

// Internal number of a contactor, -1 if it is gone. Numbers of its user rise by at least one from contactor to
// contactor, so that it stands where they would rise by just one, as they do while none is removed, or before.
std::int32_t Simulation::contactor(std::int64_t id) const {
  const Contactors& c = scene.contactors;
  const auto& order = scene.contactor_insertion_order();
  if (order.empty() || id < *c.id[order.front()]) return -1;
  const auto last = std::min(id - *c.id[order.front()], std::int64_t(order.size()) - 1);
  auto found = order.begin() + last;
  if (*c.id[*found] != id)
    found = std::lower_bound(order.begin(), found, id,
                             [&](std::int32_t i, std::int64_t wanted) { return *c.id[i] < wanted; });
  return *c.id[*found] == id ? *found : -1;
}

// Brings centres back into the cell, a mesh whole by the middle of its nodes; what crosses a moving boundary takes the
// velocity of the image it becomes, and the kinetic energy that this gives is work of the cell.
void Simulation::wrap_into_cell() {
  reduce_lean();
  const Cell& cell = scene.cell;
  double work = 0;
  std::vector<std::array<int, 3>> all_moved; // of bodies, then of nodes; stays empty while nothing moves
  // by how many cells a place has left, along each axis; false: none
  const auto has_left = [&](const double* x, double turns[3]) {
    double at[3] = {};
    std::copy_n(x, scene.dim, at);
    bool any = false;
    for (int k = scene.dim - 1; k >= 0; --k) {
      turns[k] =
          cell.periodic[k] ? std::floor((at[k] - (cell.corner[k] - scene.origin[k])) / cell.vectors[k + 3 * k]) : 0;
      if (turns[k] == 0) continue;
      any = true;
      for (int d = 0; d <= k; ++d) at[d] -= turns[k] * cell.vectors[d + 3 * k];
    }
    return any;
  };
  const auto bring_back = [&](std::int64_t place, double* x, double* v, double mass, const double turns[3]) {
    double before = 0, after = 0;
    for (int d = 0; d < scene.dim; ++d) before += v[d] * v[d];
    if (all_moved.empty()) all_moved.resize(scene.bodies.count + scene.nodes.count, {0, 0, 0});
    for (int k = scene.dim - 1; k >= 0; --k) {
      if (turns[k] == 0) continue;
      all_moved[place][k] = -int(turns[k]);
      for (int d = 0; d <= k; ++d) x[d] -= turns[k] * cell.vectors[d + 3 * k];
      for (int d = 0; d < scene.dim; ++d) {
        double jump = 0;
        for (int c = 0; c < scene.dim; ++c) jump += cell.velocity_gradient[d + 3 * c] * cell.vectors[c + 3 * k];
        v[d] -= turns[k] * jump;
      }
    }
    for (int d = 0; d < scene.dim; ++d) after += v[d] * v[d];
    if (std::isfinite(mass)) work += mass * (after - before) / 2;
  };
  Bodies& b = scene.bodies;
  Nodes& nodes = scene.nodes;
  double turns[3];
  for (std::int64_t i = 0; i < b.count; ++i)
    if (has_left(b.position[i], turns)) bring_back(i, b.position[i], b.velocity[i], *b.mass[i], turns);
  for (const MeshBody& mesh : meshes.meshes) {
    const std::int64_t first = mesh.first_node(), n = mesh.model.nodes();
    double middle[3] = {};
    for (std::int64_t i = first; i < first + n; ++i)
      for (int k = 0; k < scene.dim; ++k) middle[k] += nodes.position[i][k] / double(n);
    if (!has_left(middle, turns)) continue;
    for (std::int64_t i = first; i < first + n; ++i)
      bring_back(b.count + i, nodes.position[i], nodes.velocity[i], *nodes.mass[i], turns);
  }
  if (all_moved.empty()) return;
  interactions.restore(after_move(interactions.memory(), all_moved));
  strategy_->move_images(*this, all_moved);
  energy.work_driven += work;
  energy.turned_over += std::abs(work);
}

void Simulation::advance_cell(double duration) {
  Cell& cell = scene.cell;
  if (!cell.any()) return;
  double rate[9] = {};
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < 3; ++i)
      for (int c = 0; c < 3; ++c) rate[i + 3 * k] += cell.velocity_gradient[i + 3 * c] * cell.vectors[c + 3 * k];
  for (int e = 0; e < 9; ++e) cell.vectors[e] += duration * rate[e];
}

// A lean of more than half a cell is the same lattice with one cell less of it. Between steps only: a step keeps its
// images.
void Simulation::reduce_lean() {
  Cell& cell = scene.cell;
  for (int k = 1; k < 3; ++k)
    for (int i = k - 1; i >= 0; --i) {
      if (!cell.periodic[i] || !cell.periodic[k]) continue;
      const double cells = std::rint(cell.vectors[i + 3 * k] / cell.vectors[i + 3 * i]);
      if (cells == 0) continue;
      for (int d = 0; d <= i; ++d) cell.vectors[d + 3 * k] -= cells * cell.vectors[d + 3 * i];
      interactions.restore(after_lean(interactions.memory(), k, i, int(cells)));
      strategy_->lean_images(k, i, int(cells));
    }
}

} // namespace cairn
