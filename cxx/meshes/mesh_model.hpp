// Input of a mesh; records of its steps.
#pragma once
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "../fe/internal_forces.hpp"
#include "../soe/soe.hpp"
#include "mesh_pressure.hpp"
#include "mesh_ties.hpp"

namespace cairn {

struct ElementInfo;

// Cells of linear elasticity that the stiffness of a mesh is the sum of, for bounds of its frequencies.
struct ElasticCells {
  const ElementInfo* element = nullptr;
  std::vector<std::int32_t> node; // (nodes, cells)
  std::vector<double> elasticity; // times the thickness in 2D [Pa]
};

// Input of a mesh. Dof dim i + k is the displacement of node i along axis k.
struct MeshModel {
  int dim = 2;
  std::string name;
  std::vector<double> reference;         // (dim, nodes) [m], relative to the origin of the scene
  SparseMatrix mass, stiffness, damping; // lower triangles of one pattern; the last two empty where operators are given
  std::vector<double> node_mass;         // (nodes) that the scene shows [kg]; empty: the sums of the rows of mass
  std::vector<std::uint8_t> held;        // (dofs) 1: its velocity is given
  SoeOptions options;                    // of the system of equations
  std::int32_t number = 0;               // by which contactors name it, from 1
  std::vector<std::int64_t> node_ids, point_ids, side_ids; // of nodes, points, edges or facets, each rising
  // Points between nodes, edges (2D) and facets (3D): nodes and weights (4, each); of edges and facets the nodes alone.
  std::vector<std::int32_t> contact_nodes;                       // that are points of contact themselves
  std::vector<std::int32_t> point_nodes, side_nodes, face_nodes; // (4, n), -1 where fewer; faces: whose part a facet is
  std::vector<double> point_weights;                             // (4, points)
  bool mortar = false; // its contact nodes meet sides of other meshes on average
  std::vector<std::int32_t>
      whole_nodes; // (9, sides) of the side of a cell that each is a part of, -1 where fewer; empty: itself
  std::vector<std::int32_t> side_from, side_to;   // of each node the side that begins, or ends, there; -1: none
  bool self_contact = false;                      // its points meet its own sides
  std::vector<std::int32_t> around, around_start; // nodes that each facet sees, its own first; (facets + 1)
  MeshTies ties;                                  // dofs that follow others
  // Initial stresses of a linear body: their forces (dofs) [N], empty: none; their stored energy [J].
  std::vector<double> initial_force;
  double initial_energy = 0;
  std::vector<ElasticCells> cells; // of a linear body, if it is made of them
  // Modes that are damped besides, C = sum of rate (M f)(M f)': (dofs, modes), f' M f = 1, zero on held dofs, and their
  // rates 2 zeta omega [1/s]; empty: none.
  std::vector<double> modes, mode_rates;
  // Operators of another finite element code: products with stiffness and damping, and a solver of A x = b on free
  // dofs.
  std::function<void(const double*x, double*out)> times_stiffness, times_damping;
  std::function<std::function<void(double* b)>(double h, double theta)> make_solver;
  // Stresses of a material of solids, or forces of another code, in the place of stiffness, which then is that at the
  // start; null: linear.
  std::shared_ptr<InternalForces> bulk;
  // Measure of edges in the plane: ring: revolution about the line x = axis [m]; else thickness [m].
  bool ring = false;
  double thickness = 1, axis = 0;
  std::int64_t nodes() const { return std::int64_t(reference.size()) / dim; }
  std::int64_t dofs() const { return std::int64_t(reference.size()); }
  bool linear() const { return !bulk; }
};

// Where Newton's method of a mesh stands after a pass.
struct NewtonError {
  double error = 0; // norm of the residual over that of its terms, by the inverse of A, or over that of the forces of
                    // held dofs if larger; where all is rounding, over the terms of products
  std::int64_t node = -1; // where it is largest
  bool whole = true;      // the last change was taken whole
  BulkResult fault;       // of a cell that no part of the change leaves in order
};

// Works of a mesh over a step in the energy balance, beyond those of its nodes as point masses [J].
struct MeshWork {
  double elastic = 0, damping = 0, inertia = 0, kinetic_change = 0; // along the way
  double material = 0;                                              // dissipated at the points of the material
  double absorbed = 0;   // part of `elastic` of another code that tells neither its stored nor its dissipated energy
  double warmed = 0;     // given by what swelled at the begin of the step
  double binding = 0;    // by constraint forces of ties and rigid parts: zero but for the residual of the balance
  double beyond = 0;     // of loads and prescribed motions: mean of both ends less the integrator's value
  double drag = 0;       // of `damping`, in the mean of both ends
  double driven = 0;     // by supports with prescribed motion, in the mean of both ends
  double integrator = 0; // dissipated by the integrator, through inertia and the time of its elastic forces
  double stored = 0, stored_change = 0, kinetic = 0; // at the end of the step; kinetic: beside that of lumped masses
};

// Wall-clock time of the passes of Newton's method [s]. Contacts: columns of compliance, rows and solution; balance:
// residual at the stresses of a pass, and the solutions that measure it; all: the whole method.
struct NewtonSeconds {
  double assembly = 0, factorisation = 0, contacts = 0, balance = 0, all = 0;
};

// No less than the highest frequency of a mesh [1/s], and than any eigenvalue of M^-1 C [1/s]; infinity: unknown.
struct FrequencyBound {
  double omega = std::numeric_limits<double>::infinity(), rate = omega;
  bool known() const { return std::isfinite(omega) && std::isfinite(rate); }
};

// Loads on a mesh, given from outside.
struct MeshLoads {
  std::vector<double> begin, end;    // (dofs) forces at both ends of the step [N]; empty: none
  std::vector<double> thermal;       // (dofs) of restrained expansion [N]; empty: none
  std::vector<double> held_velocity; // (dofs) of held dofs at the end of the step [m/s]; empty: zero
  std::vector<PressedSides> pressed; // of bodies that are not linear: at the end of the step where these are then
  double time = 0;                   // at which the step at hand begins [s]
};

// Which velocities answer to impulses by M^-1 and which by A^-1: see mesh_jumps.cpp.
struct ImpulseAnswer {
  double mass = 0, rest = 1;
};

} // namespace cairn
