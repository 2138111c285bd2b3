// A deformable body before it is part of a scene: its matrices, given or from elements, and its contact surface; and
// how its nodes come into a scene, with the contactors that are mapped from them.
#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "../fe/bulk_model.hpp"
#include "../fe/called_forces.hpp"
#include "../fe/elements.hpp"
#include "../fe/frame_model.hpp"
#include "../meshes/mesh_body.hpp"
#include "scene.hpp"

namespace cairn {

// The group of the edges or faces of a mesh of that name.
inline std::string side_group(const std::string& name, int dim) { return name + (dim == 2 ? " edges" : " faces"); }

struct MeshDraft {
  struct Cells {
    const ElementInfo* element;
    std::vector<std::int32_t> node; // (nodes, cells)
    std::vector<double> elasticity; // times the thickness in 2D [Pa]
    double density = 0;             // as well [kg/m3]
    BulkCells solid;                // of a material of solids; material null: linear
  };
  int dim = 2;
  std::vector<double> reference; // (dim, nodes) [m], absolute
  std::vector<Cells> cells;
  bool lumped = false;
  double by_mass = 0, by_stiffness = 0;  // Rayleigh's damping C = a M + b K [1/s, s]
  SparseMatrix mass, stiffness, damping; // lower triangles of one pattern, where they are given; else n is 0
  std::shared_ptr<CalledForces> called;  // forces of another code, with mass and stiffness, that at the start; or null
  bool frame = false;                    // the matrices are of bars or beams, damped by Rayleigh's rule
  std::vector<double> frame_force;       // of stresses that they had at first (dofs) [N]; empty: none
  double frame_energy = 0;               // and what these store [J]
  FrameCells frame_cells;                // these bars or beams
  std::shared_ptr<FrameModel> moving;    // their forces where they move far; null: small displacements
  std::vector<std::uint8_t> held;        // (dofs)
  std::vector<std::int32_t> contact_nodes, point_nodes, side_nodes; // (4, points), (4, sides), -1 where fewer
  std::vector<double> point_weights, displacement, velocity;        // (4, points), (dim, nodes) or empty
  MeshTies ties;                                                    // nodes that follow others, rigid parts
  bool self_contact = false, mortar = false;                        // see MeshModel
  std::vector<std::int32_t> sides;                                  // (4, n) as take_sides has them
  bool ring = false;                                                // see MeshModel
  double thickness = 1;

  std::int64_t nodes() const { return std::int64_t(reference.size()) / dim; }
  void check_node(std::int64_t node) const;
  // Takes cells of isotropic elasticity. Throws Error, naming cell and node.
  void add_elastic(const std::string& element, std::int64_t n, const std::int32_t* node, double young, double poisson,
                   double density, bool plane_stress, double thickness);
  // Takes cells of a material of solids, by names: of its parameters, its kinematics (small, corotational,
  // total_lagrangian, logarithmic) and its plane (strain, stress, axisymmetric). Throws Error as above.
  void add_solid(const std::string& element, std::int64_t n, const std::int32_t* node, const std::string& material,
                 std::span<const std::string> names, std::span<const double> values, double density,
                 const std::string& kinematics, const std::string& plane, bool mean_dilatation, double thickness);
  // The stresses of all cells, if those of one are a material's; else null.
  std::shared_ptr<BulkModel> bulk() const;
  // True stress before the body moves (6, n) [Pa], components 11 22 33 12 13 23: of each cell, or at each of
  // stress_points() (dim, n) [m]. Throws Error.
  void set_initial_stress(std::int64_t n, const double* stress);
  std::vector<double> stress_points() const;
  // Its forces (dofs) [N] where all cells are linear, and the energy that it stores [J]; nothing without one.
  double initial_force(std::vector<double>& force) const;
  // Takes forces of another code; its mass on the pattern of the tangent, or of the nodes alone; one is null.
  void take_called(std::shared_ptr<CalledForces> forces, const double* on_pattern, const double* of_nodes);
  // Boundary for pressures on a body of another code: flat edges or faces (4, n), and the plane that edges belong to.
  // The pattern of the tangent then contains their couplings. Throws Error.
  void take_sides(std::span<const std::int32_t> sides, const std::string& plane, double across);
  // Boundary sides (4, n): those given, else edges (2D) or faces (3D) of a single cell, anticlockwise from outside, the
  // body left of an edge.
  std::vector<std::int32_t> boundary() const;
  // Whole sides (9, n) of quadratic cells from which pieces (4, n) of the boundary are cut, as in a MeshModel; for
  // other pieces the pieces themselves. Empty where all cells are linear in order.
  std::vector<std::int32_t> whole_sides(std::span<const std::int32_t> pieces) const;
  // mass, stiffness and damping from the cells; masses of nodes where cells are of second order, else none.
  void assemble(SparseMatrix& m, SparseMatrix& k, SparseMatrix& c, std::vector<double>& node_mass) const;
  double volume() const; // of the cells, by their quadrature [m3]

private:
  std::shared_ptr<BulkModel> all_cells() const;
};

// The row of elements.def of that name or cell type. Throws Error with those that there are.
const ElementInfo& element_named(const std::string& name);
// Isotropic elasticity (3, 3) or (6, 6) on engineering strains [Pa].
std::vector<double> isotropic(int dim, double young, double poisson, bool plane_stress);

// Adds the nodes of a mesh to a scene and its contactors, on nodes first, then points, then sides, of the two
// materials. Throws Error; the scene may then be half done.
MeshModel add_mesh_parts(Scene& scene, const MeshDraft& draft, const std::string& name, std::int32_t node_material,
                         std::int32_t side_material);
// Triangles (3, m) of a surface on a body; vertex (3, n) [m] from its centre, in its axes; equal vertices are one.
void add_surface(Scene& scene, std::int64_t body, std::int32_t material, std::span<const double> vertex,
                 std::span<const std::int32_t> triangle);

} // namespace cairn
