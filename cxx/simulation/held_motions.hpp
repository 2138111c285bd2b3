// Held dofs of meshes whose displacement or velocity is a function of time.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace cairn {

class Simulation;
class MeshBody;

struct HeldMotion {
  std::int64_t mesh = 0;                 // id of the first node of the mesh
  std::vector<std::int32_t> dof;         // of the mesh
  bool displaces = false;                // else it is driven
  std::function<double(double t)> value; // displacement [m], or velocity [m/s], at a time [s]
  std::array<double, 3> at{};            // its values at the begin, in the middle and at the end of the step at hand
};

// Piecewise linear in time, constant before the first and after the last instant. Throws Error for times that do not
// rise, or numbers that are not finite.
std::function<double(double t)> table_of(std::span<const double> time, std::span<const double> value);
// From now on these dofs, which are held, move so, and no other way. Throws Error naming node and axis.
void hold_by(Simulation& s, const MeshBody& mesh, HeldMotion motion);
// Sets the velocities of held dofs at the end of a step of h [s]. A driven dof takes the value of its function there. A
// displaced dof takes the velocity that brings its displacement to that value with (1 - share) v0 + share v of the
// integrator, after two steps at most from any start. Throws Error naming node and axis where a function gives no
// number; nothing is written then.
void move_held(Simulation& s, double h);

} // namespace cairn
