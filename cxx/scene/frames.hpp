// Bars and beams as the matrices of a deformable body: frames, rods, strings of nodes.
#pragma once
#include <cstdint>
#include <span>
#include <string>

#include "mesh_parts.hpp"

namespace cairn {

// Properties of each of n bars or beams; null: see Beams, none.
struct Sections {
  const double *young, *area, *density; // [Pa, m2, kg/m3]
  const double* initial_stress;         // along each before it moves, tension positive [Pa]
};
struct Beams {
  const double* inertia;    // [m4], in 3D (2, n): of bending along the second axis of the section, and along the third
  const double* shear_area; // [m2], null: they do not shear
  const double* torsion;    // [m4], null: the sum of both moments of inertia
  double poisson;
  double up[3];                          // in 3D the second axis of sections lies in the plane of this and the beam
  std::span<const std::int32_t> clamped; // nodes that do not turn
};

// Bars (2, n) between nodes of the mesh, about which they turn freely, or beams, stiffly joined, in the place of cells:
// masses at the nodes, stiffness with what initial stresses add to it, forces and energy of these. Rotations of beams
// have no inertia and follow the displacements (Guyan 1965): their stiffness is full. Throws Error naming the bar.
void take_bars(MeshDraft& draft, std::int64_t n, const std::int32_t* node, const Sections& sections);
void take_beams(MeshDraft& draft, std::int64_t n, const std::int32_t* node, const Sections& sections,
                const Beams& beams);
// After these: "small", "corotational" or, of bars, "total_lagrangian". Throws Error.
void take_kinematics(MeshDraft& draft, const std::string& name);

} // namespace cairn
