// What the incompressible form keeps of a step.
#pragma once
#include <cstdint>
#include <vector>

#include "../base/field.hpp"
#include "fluid.hpp"
#include "pass_mixing.hpp"
#include "pressure_solver.hpp"

namespace cairn {

struct Fluid::Implicit {
  PressureSolver solver;
  std::vector<std::int64_t> first_wall, wall_of_ranks;
  std::vector<std::int32_t> used, near, used_wall, wall_body;
  std::vector<std::int32_t> body_of_point; // that of bodies; behind bodies, each point of a mesh is one of its own
  std::vector<float> pair;
  std::vector<double> wall, centre, shape, load;
  double h = 0, ahead = 0;
  // Of a liquid at rest: changes of velocity by gravity and walls (3, n) [m/s], pressures (n) [Pa].
  std::vector<double> rest, level;
  std::vector<double> star, change, laplacian, divergence, constant, beside, diagonal, of_change;
  std::vector<std::int8_t> filtered;
  std::vector<double> slope; // of velocities about particles (9, n) [1/s]
  // Velocities of bodies, and behind them of points of meshes (6, n): without pressure and contacts, changes by
  // contacts, with pressure, those that contacts begin from. Impulses on them: before pressure, of it. Velocities that
  // contacts left.
  std::vector<double> free, contact, pressed, given, known, impulse, left;
  // With changes by contacts but without pressure, at the begin of the step, and what viscosity does not see.
  std::vector<double> now, begin, later, of_begin; // of_begin: divergences with those of the begin (n)
  std::vector<double> share;            // mass and inertia of a body over those with the liquid about it (2, n)
  std::vector<double> area, wet, twist; // of the surface of a body, of its part in the liquid, by its spins (n)
  Array<double> inverse_mass, inverse_inertia;
  PassMixing mixing; // beside meshes: changes by contacts of nodes, then of bodies
  std::vector<double> mixed_from, mixed, mixed_weight;
  std::int64_t bytes() const;
};

} // namespace cairn
