// Neighbours of particles: lists that outlast the step in which they were made. Particles are put in the order of the
// cells of a grid, so that sums run through memory, and in the order of the list, whatever the number of threads.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

namespace cairn {

struct ParticleList {
  std::vector<double> at;                   // places for which it was made (3, n)
  std::vector<std::int64_t> first;          // (n + 1)
  std::vector<std::int32_t> neighbour;      // particles
  std::vector<std::int64_t> first_point;    // (n + 1)
  std::vector<std::int32_t> point;          // points of surfaces
  std::vector<std::int64_t> first_of_point; // (points + 1): the same from the side of the points
  std::vector<std::int32_t> particle;

  // The order of the cells of particles at x (3, n): its number k stands at order[k]. Cells of the width `reach`.
  std::vector<std::int32_t> order(const std::vector<double>& x, double reach);
  // Lists for x = at, whose particles stand in that order, and for points (stride numbers each, place first).
  void make(double reach, const double* points, std::int64_t count, int stride);
  // Particles nearer than `reach` to points, for x = at, of the list that was made last: those of point b stand from
  // first_of[b] on.
  void about(double reach, const double* points, std::int64_t count, int stride, std::vector<std::int64_t>& first_of,
             std::vector<std::int32_t>& particles) const;
  std::array<double, 3> period{}, low{}; // of the periodic cell, 0: none; its corner
  std::int64_t bytes() const;

private:
  std::array<std::int64_t, 3> cell_of(const double* x) const;
  std::int64_t key_of(const std::array<std::int64_t, 3>& cell) const {
    return (cell[2] * cells_[1] + cell[1]) * cells_[0] + cell[0];
  }
  void lay_grid(const std::vector<double>& x, double reach);
  template <class F>
  void each_near(const std::array<std::int64_t, 3>& cell, F&& f) const;

  std::array<double, 3> corner_{}, width_{};
  std::array<std::int64_t, 3> cells_{};
  std::vector<std::int64_t> keys_, cell_keys_, cell_first_; // of particles; of cells that hold some
  int dim_ = 3;
};

} // namespace cairn
