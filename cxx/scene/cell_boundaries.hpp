// Walls, rings and tubes in a periodic cell.
#pragma once
#include <cstdint>

#include "../base/cell.hpp"
#include "../contactors/contactor.hpp"

namespace cairn {

class Scene;

// Throws Error if images of a contactor without end cut the body or each other: a plane across a periodic axis, a ring
// or tube wider than the cell. normal: unit vector of a plane or axis of a tube, in the axes of the body; null for a
// ring. radius [m].
void check_in_cell(const Scene& scene, Shape shape, std::int64_t body_id, const double* normal, double radius);
// Gives the scene a cell; throws Error, and leaves the one it had, if contactors that are there do not fit it so.
void set_cell(Scene& scene, const Cell& cell);

} // namespace cairn
