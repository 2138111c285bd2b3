// Bodies and vectors of a periodic cell between steps (Lees & Edwards 1972).
#include <cmath>

#include "simulation.hpp"

namespace cairn {

// Brings centres back into the cell; one that crosses a moving boundary takes the velocity of the image it becomes, and the
// kinetic energy that this gives is work of the cell.
void Simulation::wrap_into_cell() {
  Bodies& b = scene.bodies;
  const Cell& cell = scene.cell;
  double work = 0;
  for (std::int64_t i = 0; i < b.count; ++i) {
    double* x = b.position[i];
    double* v = b.velocity[i];
    double before = 0, after = 0;
    bool moved = false;
    for (int k = scene.dim - 1; k >= 0; --k) {
      if (!cell.periodic[k]) continue;
      const double turns = std::floor((x[k] - (cell.corner[k] - scene.origin[k])) / cell.vectors[k + 3 * k]);
      if (turns == 0) continue;
      if (!moved)
        for (int d = 0; d < scene.dim; ++d) before += v[d] * v[d];
      moved = true;
      for (int d = 0; d <= k; ++d) x[d] -= turns * cell.vectors[d + 3 * k];
      for (int d = 0; d < scene.dim; ++d) {
        double jump = 0;
        for (int c = 0; c < scene.dim; ++c) jump += cell.velocity_gradient[d + 3 * c] * cell.vectors[c + 3 * k];
        v[d] -= turns * jump;
      }
    }
    if (!moved) continue;
    for (int d = 0; d < scene.dim; ++d) after += v[d] * v[d];
    if (std::isfinite(*b.mass[i])) work += *b.mass[i] * (after - before) / 2;
  }
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
  // A lean of more than half a cell is the same lattice with one cell less of it.
  for (int k = 1; k < 3; ++k)
    for (int i = k - 1; i >= 0; --i) {
      if (!cell.periodic[i] || !cell.periodic[k]) continue;
      const double cells = std::rint(cell.vectors[i + 3 * k] / cell.vectors[i + 3 * i]);
      for (int d = 0; d <= i; ++d) cell.vectors[d + 3 * k] -= cells * cell.vectors[d + 3 * i];
    }
}

} // namespace cairn
