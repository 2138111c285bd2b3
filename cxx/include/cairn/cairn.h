/* Cairn's public C API: build a scene, step it, read arrays.
 *
 * Every function that can fail returns a code, 0 for success, and fills *error (may be NULL) with the same code, the
 * item that was wrong and a message that names field, index, value and remedy; what failed leaves its object as it was.
 * Nothing is thrown across this interface. A solve that did not converge is not an error: it is a status in the report.
 *
 * Units: SI. dim = 2 or 3, nd = 3 or 6 velocities of a body (vx, vy, w | v, w in space axes). Arrays are in Fortran
 * order, the components of one item side by side: position (dim, n). Ids count from 0 in the order of insertion, and
 * are never used twice. "May be NULL" is said where it holds. */
#ifndef CAIRN_CAIRN_H
#define CAIRN_CAIRN_H
#include <stdint.h>

#include "cairn/body_calls.h"
#include "cairn/error.h"
#include "cairn/problems.h"

#ifdef __cplusplus
extern "C" {
#endif

enum cairn_code {
  cairn_ok = 0,
  cairn_wrong_input = 1,
  cairn_out_of_memory = 2,
  cairn_internal_error = 3,
  cairn_file_error = 4 /* a file cannot be read or written */
};
/* newton_limit: deformable bodies that are not linear are not in balance to newton_tol. */
enum cairn_solve_status { cairn_converged = 0, cairn_iteration_limit = 1, cairn_diverged = 2, cairn_newton_limit = 3 };

typedef struct cairn_scene cairn_scene;
typedef struct cairn_simulation cairn_simulation;
typedef struct cairn_mesh cairn_mesh;
typedef struct cairn_run_writer cairn_run_writer;
typedef struct cairn_run cairn_run;

/* "0.1.0" */
const char* cairn_version(void);

/* The contact law `law` of a shared library, which describes it (cairn/plug.h), is known by that name from now on.
 * replace, not 0: it takes the place of a law of that name. */
int32_t cairn_plug_contact_law(const char* library, const char* law, int32_t replace, cairn_error* error);
/* A subroutine of Abaqus's interface UMAT, as Fortran compiles it, cast to this. */
typedef void cairn_umat(void);
/* A UMAT as a material of that name for cairn_mesh_add_solid_cells, whose values are then its PROPS in their order,
 * with `state` numbers STATEV at each point: the routine (NULL: "umat"; an underscore may follow) of a shared library,
 * or one that the program links. Of the same name: new meshes. It is called as Abaqus/Standard calls it, in the plane
 * with NTENS = 4, and at large strains as with NLGEOM: Cauchy's stress in axes of the scene. It may call SINV, SPRINC,
 * SPRIND, ROTSIG and XIT; what gives no finite number, asks for a smaller step or calls XIT fails the step, with mesh,
 * cell and nodes in the message. */
int32_t cairn_plug_material(const char* library, const char* material, const char* routine, int32_t state,
                            cairn_error* error);
int32_t cairn_give_material(const char* material, cairn_umat* routine, int32_t state, cairn_error* error);
/* The same of routines that are written for elements of plane stress, for cells of plane "stress": NDI = 2, NTENS = 3,
 * stresses and strains 11 22 12; the strain across is theirs to find, DFGRD1(3,3) keeps the volume. */
int32_t cairn_plug_plane_stress_material(const char* library, const char* material, const char* routine, int32_t state,
                                         cairn_error* error);
int32_t cairn_give_plane_stress_material(const char* material, cairn_umat* routine, int32_t state, cairn_error* error);

/* ---------------------------------------------------------------- scene */
int32_t cairn_scene_create(int32_t dim, cairn_scene** scene, cairn_error* error);
void cairn_scene_destroy(cairn_scene* scene); /* NULL is allowed */

int32_t cairn_scene_set_gravity(cairn_scene* scene, const double* gravity, cairn_error* error); /* (dim) [m/s2] */
/* The point that stored positions are relative to; before the first body. (dim) [m] */
int32_t cairn_scene_set_origin(cairn_scene* scene, const double* origin, cairn_error* error);
/* A periodic cell: lengths (dim) [m], 0 or inf along an axis that is not periodic; corner (dim) [m], may be NULL: 0;
 * lean: displacement along x of the cell's upper face [m]; shear_rate: at which it moves, per length of the cell along
 * its last axis [1/s]. */
int32_t cairn_scene_set_cell(cairn_scene* scene, const double* lengths, const double* corner, double lean,
                             double shear_rate, cairn_error* error);
int32_t cairn_scene_add_material(cairn_scene* scene, const char* name, int32_t* material, cairn_error* error);
/* The material of that name for contactors of a group that rules may name. */
int32_t cairn_scene_add_material_of_group(cairn_scene* scene, const char* name, const char* group, int32_t* material,
                                          cairn_error* error);
/* law: a name of laws.def, as in Python ("Coulomb") or as its file ("signorini_coulomb"), with its parameters in the
 * order of that list. A material of -1 on both sides: the law of all pairs that have none of their own. */
int32_t cairn_scene_set_law(cairn_scene* scene, int32_t material_a, int32_t material_b, const char* law,
                            int32_t parameters, const double* parameter, cairn_error* error);
/* The same by the names of materials or groups, "*" for all; law NULL: they pass through each other. A rule that names
 * groups goes before one that names materials, that before "*"; among equals the later one counts. */
int32_t cairn_scene_set_rule(cairn_scene* scene, const char* a, const char* b, const char* law, int32_t parameters,
                             const double* parameter, cairn_error* error);

/* position (dim, n) [m]; rotation (1, n) [rad] or (4, n) quaternion w x y z, may be NULL: none; velocity (nd, n), may
 * be NULL: zero; mass (n) [kg] and inertia (1 or 3, n) [kg m2], inf: moved by nothing. *first is the id of the first.
 */
int32_t cairn_scene_add_bodies(cairn_scene* scene, int64_t n, const double* position, const double* rotation,
                               const double* velocity, const double* mass, const double* inertia, int64_t* first,
                               cairn_error* error);
/* shape: a name of shapes.def ("disk", "half_plane", "sphere", ...). body (n) ids, material (n); radius (n) [m], may be
 * NULL: 0; offset (dim, n) [m] in the axes of the body, may be NULL: 0; direction (dim + 1, n), a unit vector then the
 * half length [m], may be NULL for round shapes. first may be NULL. */
int32_t cairn_scene_add_contactors(cairn_scene* scene, const char* shape, int64_t n, const int64_t* body,
                                   const int32_t* material, const double* radius, const double* offset,
                                   const double* direction, int64_t* first, cairn_error* error);

/* Hulls are shapes that contactors share: each call adds n of them and gives the number of the first.
 * Polygons: vertex (2, v) [m] in order, those of hull i from first_vertex[i] on, first_vertex (n + 1). */
int32_t cairn_scene_add_polygons(cairn_scene* scene, int64_t n, const int64_t* first_vertex, const double* vertex,
                                 int32_t* first, cairn_error* error);
/* Convex polyhedra: vertex (3, v); faces of hull i from first_face[i] on, first_face (n + 1); corners of a face from
 * first_corner[face] on, first_corner (faces + 1): vertices numbered from 0 within the hull, anticlockwise from
 * outside. */
int32_t cairn_scene_add_polyhedra(cairn_scene* scene, int64_t n, const int64_t* first_vertex, const double* vertex,
                                  const int64_t* first_face, const int64_t* first_corner, const int64_t* corner,
                                  int32_t* first, cairn_error* error);
/* shape "capsule" or "cylinder": sizes (2, n) radius and length along the third axis of the body, without round ends
 * [m]; "superquadric": sizes (5, n) half axes a, b, c [m], exponents e1 towards z, e2 in the section, 0.05 to 1.95. */
int32_t cairn_scene_add_round_hulls(cairn_scene* scene, const char* shape, int64_t n, const double* sizes,
                                    int32_t* first, cairn_error* error);
/* Contactors that are hulls: shape "polygon", "polyhedron", "capsule", "cylinder" or "superquadric"; hull (n); the rest
 * as above. */
int32_t cairn_scene_add_hull_contactors(cairn_scene* scene, const char* shape, int64_t n, const int64_t* body,
                                        const int32_t* material, const int32_t* hull, const double* offset,
                                        int64_t* first, cairn_error* error);
/* A surface of triangles (3, m) on a body, solid behind: anticlockwise from the free side. vertex (3, v) [m] from the
 * centre of the body, in its axes. */
int32_t cairn_scene_add_surface(cairn_scene* scene, int64_t body, int32_t material, int64_t vertices,
                                const double* vertex, int64_t triangles, const int32_t* triangle, cairn_error* error);

/* Joins body a to body b, or with b = -1 to the world, as they stand; see docs/joints.md. Of a mesh a body is one of
 * its nodes, joined where it is; what is of angles is refused of it. kind: "Ball", "Hinge" (3D), "Pivot" (2D),
 * "Fixed", "Slider", "Distance" or "Cable". point (dim) [m]: where, absolute, of a Distance (dim, 2), on a and on b,
 * of a Cable (dim, 3), on a, at its pulley and on b. axis (dim): of a Hinge or a Slider, of all others NULL. Numbers
 * by names and values (count each), what is not named is without: "strength" [N]; of all but a Ball and a Fixed
 * "lowest" and "highest" of the coordinate, "stiffness", "damping" and "rest" of a spring along it; of a Hinge, a
 * Pivot and a Slider "speed" and "effort" of a motor; of a Cable none of these but "length" [m], or it is as long as
 * it then is, and "pulley", the id of the body that carries that, or the world does; one of its ends may be a node.
 * ends (2), may be NULL: ids of its contactors, which the field "key" of contacts names: on their contact a is the
 * first body, "impulse" and "moment" are the reaction, "beta" is 0 where it broke. The world is a body of its own, with
 * the next id. */
int32_t cairn_scene_add_joint(cairn_scene* scene, const char* kind, int64_t a, int64_t b, const double* point,
                              const double* axis, int32_t count, const char* const* names, const double* values,
                              int64_t* ends, cairn_error* error);

/* Values (components, n) of a field of bodies: "position" (absolute), "rotation", "velocity", "force" (applied force
 * and torque, in space axes, from now on [N, N m]), "damping" (viscous, per unit of mass [1/s]) or "surface_velocity"
 * (of a belt: velocity of the surface along the body, then its spin about the centre of mass, in the axes of the body
 * [m/s, rad/s]; its part in the tangent plane of a contact acts). bodies (n) ids; NULL: all, in the order of insertion.
 */
int32_t cairn_scene_set_body_field(cairn_scene* scene, const char* name, int64_t n, const int64_t* bodies,
                                   const double* values, cairn_error* error);
/* Bit i of mask: dof i takes its value from velocity (nd, n), may be NULL: zero. */
int32_t cairn_scene_drive(cairn_scene* scene, int64_t n, const int64_t* bodies, uint8_t mask, const double* velocity,
                          cairn_error* error);

/* ---------------------------------------------------------------- deformable bodies
 * Small displacements, but of cells whose kinematics are not small. A mesh is made, described, and added to scenes; it
 * may be destroyed then. Nodes count from 0; dof dim i + k is the displacement of node i along axis k. */
int32_t cairn_mesh_create(int32_t dim, int64_t nodes, const double* position, cairn_mesh** mesh,
                          cairn_error* error); /* position (dim, nodes) [m] */
void cairn_mesh_destroy(cairn_mesh* mesh);     /* NULL is allowed */
/* n isotropic elastic cells of an element of elements.def ("t3", "q8", "hex20", ...): node (nodes of a cell, n),
 * anticlockwise in 2D; young [Pa], poisson, density [kg/m3]; in 2D plane_stress 0 (strain) or 1, thickness [m]. Cells
 * of several calls add up. */
int32_t cairn_mesh_add_elastic_cells(cairn_mesh* mesh, const char* element, int64_t n, const int32_t* node,
                                     double young, double poisson, double density, int32_t plane_stress,
                                     double thickness, cairn_error* error);
/* n cells of a material of bulk_materials.def ("neo_hookean", "j2_plasticity", ...), whose strains may be large:
 * parameters by names and values (count each); those that are not given have their defaults. kinematics "small",
 * "corotational", "total_lagrangian" (materials that take the gradient of deformation need it) or "logarithmic"; plane
 * "strain", "stress" or "axisymmetric" round y, in 2D; mean_dilatation 1: cells do not lock near poisson = 1/2, which
 * is of no use to triangle and tetra cells, and refused once the mesh is in a simulation. */
int32_t cairn_mesh_add_solid_cells(cairn_mesh* mesh, const char* element, int64_t n, const int32_t* node,
                                   const char* material, int32_t count, const char* const* names, const double* values,
                                   double density, const char* kinematics, const char* plane, int32_t mean_dilatation,
                                   double thickness, cairn_error* error);
/* True (Cauchy's) stress of the cells that the mesh has, before it moves: (6, n) [Pa], 11 22 33 12 13 23, n cells in
 * the order in which they came in, or all of their points, whose places cairn_mesh_stress_points tells: *count numbers
 * (dim, points) [m], written if capacity is enough. Materials yield at what is left of their strength. */
int32_t cairn_mesh_stress_points(const cairn_mesh* mesh, int64_t capacity, double* position, int64_t* count,
                                 cairn_error* error);
int32_t cairn_mesh_set_initial_stress(cairn_mesh* mesh, int64_t n, const double* stress, cairn_error* error);
/* Of cells: C = by_mass M + by_stiffness K [1/s, s]; lumped 1: mass in the nodes alone. Default: 0, 0, 0. */
int32_t cairn_mesh_set_damping(cairn_mesh* mesh, double by_mass, double by_stiffness, int32_t lumped,
                               cairn_error* error);
/* Instead of cells, matrices of your own: lower triangles by columns on one pattern, start (dofs + 1), row, each column
 * from its diagonal on, rows rising; damping may be NULL: none. [kg], [N/m], [N s/m] */
int32_t cairn_mesh_set_matrices(cairn_mesh* mesh, const int64_t* start, const int32_t* row, const double* mass,
                                const double* stiffness, const double* damping, cairn_error* error);
/* Instead of cells, n bars (2, n) between nodes, about which they turn freely, half of their mass at each of both:
 * young [Pa], area [m2], density [kg/m3] (n); initial_stress (n) along each before it moves, tension positive [Pa], or
 * NULL: it pulls nodes back across, too. Damping: cairn_mesh_set_damping. */
int32_t cairn_mesh_set_bars(cairn_mesh* mesh, int64_t n, const int32_t* node, const double* young, const double* area,
                            const double* density, const double* initial_stress, cairn_error* error);
/* The same of beams, stiffly joined: inertia [m4] (n), in 3D (2, n), of bending along the second axis of the section,
 * which lies in the plane of up (3) and the beam, and along the third; shear_area (n) [m2], NULL: they do not shear;
 * torsion (n) [m4], NULL: the sum of both moments; up NULL: z; clamped: nodes that do not turn. Rotations have no
 * inertia and follow the displacements: the stiffness is full, for frames of some hundred nodes. */
int32_t cairn_mesh_set_beams(cairn_mesh* mesh, int64_t n, const int32_t* node, const double* young, const double* area,
                             const double* density, const double* initial_stress, const double* inertia,
                             const double* shear_area, const double* torsion, double poisson, const double* up,
                             int64_t clamped, const int32_t* clamped_node, cairn_error* error);
/* How far these bars or beams move, after the call that gives them: "small" (default), their matrices; "corotational",
 * turns of any size, forces by the change of length and, of beams, by rotations against the axes that move with each;
 * of bars also "total_lagrangian", Green's strain and the second stress of Piola and Kirchhoff. */
int32_t cairn_mesh_set_kinematics(cairn_mesh* mesh, const char* kinematics, cairn_error* error);
/* Instead of cells, forces of another code by calls (cairn/body_calls.h), with the pattern of their tangent: start
 * (dofs + 1), row, rising in each column, of a lower triangle or of all entries, of which the symmetric part counts.
 * Either mass, on that pattern, or node_mass (nodes) [kg]; the other is NULL. calls is copied; its context serves the
 * simulation until that is destroyed. Damping: cairn_mesh_set_damping, by_stiffness of the tangent at rest, for which
 * the forces are asked at once. */
int32_t cairn_mesh_set_calls(cairn_mesh* mesh, const int64_t* start, const int32_t* row, const double* mass,
                             const double* node_mass, const cairn_body_calls* calls, cairn_error* error);
/* The same by the routine `body` of a shared library, which describes it (cairn/plug.h), with its count parameters in
 * the order of the descriptor; each simulation opens one of its own. */
int32_t cairn_mesh_plug_body(cairn_mesh* mesh, const char* library, const char* body, int32_t count,
                             const double* params, const int64_t* start, const int32_t* row, const double* mass,
                             const double* node_mass, cairn_error* error);
/* What touches: nodes (n); points between nodes, node (4, n), -1 where fewer, and their weights (4, n); sides, against
 * which other bodies come: in 2D edges (2, n), the body on their left, in 3D faces (4, n), anticlockwise from outside,
 * -1 for the fourth node of a triangle. Calls add up. Nodes and points meet disks, spheres, walls, polygons and
 * polyhedra and the sides of other meshes; edges meet disks, faces spheres, and both points of other meshes. */
int32_t cairn_mesh_touch_nodes(cairn_mesh* mesh, int64_t n, const int32_t* node, cairn_error* error);
int32_t cairn_mesh_touch_points(cairn_mesh* mesh, int64_t n, const int32_t* node, const double* weight,
                                cairn_error* error);
int32_t cairn_mesh_touch_sides(cairn_mesh* mesh, int64_t n, const int32_t* node, cairn_error* error);
/* Of a mesh whose forces another code finds, after these: the sides of its boundary, as cairn_mesh_touch_sides takes
 * them, which pressures may press; the tangent then holds what a pressure couples. plane ("strain", "stress",
 * "axisymmetric" round y) and thickness [m]: what pressures take edges for, in 2D. */
int32_t cairn_mesh_set_sides(cairn_mesh* mesh, int64_t n, const int32_t* node, const char* plane, double thickness,
                             cairn_error* error);
/* Sides of one cell alone, or those that were given, as cairn_mesh_touch_sides takes them: *count numbers, written if
 * capacity is enough. */
int32_t cairn_mesh_boundary(const cairn_mesh* mesh, int64_t capacity, int32_t* node, int64_t* count,
                            cairn_error* error);
/* Bit k of mask: displacement along axis k of these nodes is held, or driven by cairn_simulation_load_mesh. */
int32_t cairn_mesh_hold(cairn_mesh* mesh, int64_t n, const int32_t* node, uint8_t mask, cairn_error* error);
/* Sides follow others on average, by dual multipliers on what they have in common, through which a uniform stress goes
 * to rounding; both as cairn_mesh_touch_sides takes them. Give the finer side as the one that follows. within: distance
 * of a side that follows from the others, over its length or the root of its area, and width of the strip by which it
 * may reach beyond their end (1e-6 as a rule). */
int32_t cairn_mesh_tie_sides(cairn_mesh* mesh, int64_t followers, const int32_t* follow, int64_t leaders,
                             const int32_t* lead, double within, cairn_error* error);
/* n nodes move as one rigid body, which turns as far as it likes where strains of the cells may be large; calls add
 * parts. */
int32_t cairn_mesh_set_rigid(cairn_mesh* mesh, int64_t n, const int32_t* node, cairn_error* error);
/* The displacement of a node is the sum of those of n others by their weights, which follow nothing themselves. */
int32_t cairn_mesh_tie_node(cairn_mesh* mesh, int32_t node, int64_t n, const int32_t* leader, const double* weight,
                            cairn_error* error);
/* self_contact 1: its points meet its own sides, but for those next to them; mortar 1: its nodes meet sides of other
 * meshes on average over its own sides, those of cells of second order as wholes. Both are of nodes (or points) and
 * sides that touch, else the mesh is refused where it comes in. Default: 0, 0. */
int32_t cairn_mesh_set_contact(cairn_mesh* mesh, int32_t self_contact, int32_t mortar, cairn_error* error);
/* At the start, (dim, nodes) each [m], [m/s]; may be NULL: zero. */
int32_t cairn_mesh_set_motion(cairn_mesh* mesh, const double* displacement, const double* velocity, cairn_error* error);
/* name: its own, a group that rules may name; its sides are of the group "NAME edges" (2D), "NAME faces" (3D).
 * side_material of -1: as material. *first: id of the body of node 0, others follow; *number: the mesh in the
 * simulation. Either may be NULL. Nodes of all meshes pass through each other unless a rule names both groups. */
int32_t cairn_scene_add_mesh(cairn_scene* scene, const cairn_mesh* mesh, const char* name, int32_t material,
                             int32_t side_material, int64_t* first, int32_t* number, cairn_error* error);
/* Stiffness [N/m] and mass [kg] (dofs, dofs, n) of n elements at position (dim, nodes, n) [m]; elasticity (3, 3) or
 * (6, 6) on strains xx yy [zz] xy [yz zx] [Pa], as density times the thickness in 2D. */
int32_t cairn_element_matrices(const char* element, int64_t n, const double* position, double density,
                               const double* elasticity, double* stiffness, double* mass, cairn_error* error);

/* ---------------------------------------------------------------- simulation */
/* Non-Smooth Contact Dynamics: theta-method in time, block nonlinear Gauss-Seidel over the contacts. */
typedef struct cairn_nscd {
  double theta;              /* 1/2 to 1 */
  double tolerance;          /* on the error of the contact problem, natural map in the energy norm [-] */
  int32_t min_iterations;    /* of the solver in a step */
  int32_t max_iterations;    /* of the solver in a step */
  int32_t threads;           /* 0: as OpenMP decides */
  int32_t warm_start;        /* 0 or 1: impulses of the last step are the first guess */
  int32_t project_positions; /* 0 or 1: overlap is removed without changing a velocity */
  double margin;             /* gap up to which a pair is a candidate [m]; negative: from sizes and speeds */
} cairn_nscd;

typedef struct cairn_report {
  int64_t step;
  int64_t contacts;      /* candidates that were solved */
  int32_t status;        /* see cairn_solve_status */
  int32_t iterations;    /* of the solver */
  double time;           /* end of the step [s] */
  double error;          /* of the contact problem [-] */
  double worst_error;    /* of one contact, on its own scale [-] */
  double penetration;    /* deepest overlap / size of the smaller body */
  double kinetic;        /* energy [J] */
  double closure;        /* what is left of the energy balance since the start [J] */
  double energy_in_play; /* the scale of closure [J] */
} cairn_report;

void cairn_nscd_defaults(cairn_nscd* options);
/* The simulation takes a copy of the scene. options may be NULL: the defaults. */
int32_t cairn_simulation_create(const cairn_scene* scene, const cairn_nscd* options, cairn_simulation** simulation,
                                cairn_error* error);
void cairn_simulation_destroy(cairn_simulation* simulation); /* NULL is allowed */
/* One step of h [s]. report may be NULL. */
int32_t cairn_simulation_step(cairn_simulation* simulation, double h, cairn_report* report, cairn_error* error);

/* Options by their names in options.def, of the strategy in use; those that a number cannot say: "strategy" (a row of
 * strategies.def: "nscd", "carpenter", "granular_element", "smooth_dem", "event_driven"), "solver" ("nlgs", "auto", or
 * a solver of solvers.def) and "integrator" (a row of integrators.def, whose parameters are options from then on).
 * Flags are 0 or 1; a number that is NaN brings back what is found from the scene. Text: capacity characters with the
 * nought at the end. */
int32_t cairn_simulation_set_option(cairn_simulation* simulation, const char* name, const char* text,
                                    cairn_error* error);
int32_t cairn_simulation_set_number(cairn_simulation* simulation, const char* name, double value, cairn_error* error);
int32_t cairn_simulation_get_option(const cairn_simulation* simulation, const char* name, int64_t capacity, char* text,
                                    cairn_error* error);
int32_t cairn_simulation_get_number(const cairn_simulation* simulation, const char* name, double* value,
                                    cairn_error* error);

/* Between steps: as the functions of the scene. hull: of contactors that are hulls of the scene, NULL for all else. */
int32_t cairn_simulation_set_gravity(cairn_simulation* simulation, const double* gravity, cairn_error* error);
int32_t cairn_simulation_set_body_field(cairn_simulation* simulation, const char* name, int64_t n,
                                        const int64_t* bodies, const double* values, cairn_error* error);
/* "position" (absolute) or "velocity" (dim, n) of nodes of meshes; nodes (n) numbers, NULL: of all, in the order of
 * insertion. */
int32_t cairn_simulation_set_node_field(cairn_simulation* simulation, const char* name, int64_t n, const int64_t* nodes,
                                        const double* values, cairn_error* error);
int32_t cairn_simulation_add_bodies(cairn_simulation* simulation, int64_t n, const double* position,
                                    const double* rotation, const double* velocity, const double* mass,
                                    const double* inertia, int64_t* first, cairn_error* error);
int32_t cairn_simulation_add_contactors(cairn_simulation* simulation, const char* shape, int64_t n, const int64_t* body,
                                        const int32_t* material, const double* radius, const double* offset,
                                        const double* direction, const int32_t* hull, int64_t* first,
                                        cairn_error* error);
int32_t cairn_simulation_remove_bodies(cairn_simulation* simulation, int64_t n, const int64_t* bodies,
                                       cairn_error* error);
/* A joint of rigid bodies as they stand now, with the arguments of cairn_scene_add_joint: velocities that it does not
 * allow are an impact in the next step. A restart goes into a simulation with as many joints, made in the same order.
 */
int32_t cairn_simulation_add_joint(cairn_simulation* simulation, const char* kind, int64_t a, int64_t b,
                                   const double* point, const double* axis, int32_t count, const char* const* names,
                                   const double* values, int64_t* ends, cairn_error* error);
/* Lets go the joint of these ends (2), of the scene or of the run: what a spring of it stores is in the energy
 * "dissipated_reshaping". */
int32_t cairn_simulation_remove_joint(cairn_simulation* simulation, const int64_t* ends, cairn_error* error);
int32_t cairn_simulation_drive(cairn_simulation* simulation, int64_t n, const int64_t* bodies, uint8_t mask,
                               const double* velocity, cairn_error* error);

/* Functions of time as text, "1e4*min(t/0.1, 1)", compiled once: numbers, + - * / ^, t [s], pi, e, sin cos tan asin
 * acos atan sinh cosh tanh exp log sqrt abs sign floor, min max pow atan2 mod (x, y), clip(x, low, high), where(x, a,
 * b) (a for x > 0) and table(x, x1, y1, x2, y2, ...), piecewise linear. Checkpoints hold none of them: give them again.
 * Velocity of a dof ("vx", "vy", "w"; in 3D "vx" to "vz", "wx" to "wz") of n bodies at the end of each step;
 * cairn_simulation_drive ends it. */
int32_t cairn_simulation_drive_by(cairn_simulation* simulation, int64_t n, const int64_t* bodies, const char* dof,
                                  const char* velocity, cairn_error* error);
/* Force of a body, that of a stress [Pa] on an area along a normal (dim) out of the solid. area: "grains" or NULL,
 * their extent across the normal; "walls", the distance of planes that face each other across it; or an expression
 * [m2]. Along the axes of a periodic cell it is its length, in 2D times depth [m]. */
int32_t cairn_simulation_set_servo(cairn_simulation* simulation, int64_t body, const double* normal, const char* stress,
                                   const char* area, double depth, cairn_error* error);
/* Sizes of n bodies grow by d(ln size)/dt = rate(t) [1/s], a function as above, shapes and densities kept; NULL: no
 * more. Grains pack so without gravity. Refused: bodies without a finite mass, that expand with their temperature, or
 * that a law holds at points. Checkpoints hold sizes, and no rates. */
int32_t cairn_simulation_grow(cairn_simulation* simulation, int64_t n, const int64_t* bodies, const char* rate,
                              cairn_error* error);
/* Component "xx", "yy", "zz", "xy", "xz" or "yz" of the velocity gradient of the periodic cell [1/s], or of the stress
 * of contacts that it follows, compression positive [Pa]; components that nobody names stay. */
int32_t cairn_simulation_drive_cell(cairn_simulation* simulation, const char* component, const char* rate,
                                    cairn_error* error);
int32_t cairn_simulation_press_cell(cairn_simulation* simulation, const char* component, const char* stress,
                                    cairn_error* error);
/* Inertia of the cell over the mass of the bodies (1), its thickness in 2D [m] (1); keeps_volume 1: lengths that
 * nothing drives keep the volume of now. */
int32_t cairn_simulation_weigh_cell(cairn_simulation* simulation, double inertia, double depth, int32_t keeps_volume,
                                    cairn_error* error);
/* (dim, dim) each, NULL: not asked for: cell vectors by columns [m], velocity gradient [1/s], stress of a driven cell
 * in the last step [Pa]. */
int32_t cairn_simulation_cell(const cairn_simulation* simulation, double* vectors, double* rate, double* stress,
                              cairn_error* error);
/* A number that is kept every so many steps: a field of bodies ("position.z", "velocity.w"), "contact_force.x" [N],
 * "energy.kinetic", "report.error", "stress.xx", "cell.xx". bodies (n), 0: all; take: "mean", "sum", "min", "max",
 * NULL: mean. Rows are read as fields are: *count, and nothing if that is more than capacity. */
int32_t cairn_simulation_add_probe(cairn_simulation* simulation, const char* quantity, int64_t n, const int64_t* bodies,
                                   const char* take, int32_t every, int32_t* probe, cairn_error* error);
int32_t cairn_simulation_read_probe(const cairn_simulation* simulation, int32_t probe, int64_t capacity, double* times,
                                    double* values, int64_t* count, cairn_error* error);
/* Forces on the dofs of a mesh at the begin and the end of the coming steps, from now on [N]; one NULL: as the other,
 * both: none. held_velocity (dofs): of held dofs at the end of the steps [m/s], NULL: zero. */
int32_t cairn_simulation_load_mesh(cairn_simulation* simulation, int32_t mesh, const double* begin, const double* end,
                                   const double* held_velocity, cairn_error* error);

/* n nodes of a mesh, held along axis 'x', 'y' or 'z' by cairn_mesh_hold, whose displacement [m] or velocity [m/s] along
 * it is a function of time from now on: a table (rows), piecewise linear, constant before its first and after its last
 * row, or a function of the program with its context, asked at the begin (of a displacement), in the middle and at the
 * end of each step and each of its parts. A displaced node ends steps where the function says, to the cube of the step
 * (with theta 1 to rounding), two steps after its begin and after its slope leaps. What it was given before along that
 * axis counts no more. Checkpoints hold no functions: give them again. A function leaves the simulation alone. */
int32_t cairn_simulation_displace_nodes(cairn_simulation* simulation, int32_t mesh, int64_t n, const int32_t* node,
                                        char axis, int64_t rows, const double* time, const double* displacement,
                                        cairn_error* error);
int32_t cairn_simulation_displace_nodes_by(cairn_simulation* simulation, int32_t mesh, int64_t n, const int32_t* node,
                                           char axis, double (*displacement)(double time, void* context), void* context,
                                           cairn_error* error);
int32_t cairn_simulation_drive_nodes(cairn_simulation* simulation, int32_t mesh, int64_t n, const int32_t* node,
                                     char axis, int64_t rows, const double* time, const double* velocity,
                                     cairn_error* error);
int32_t cairn_simulation_drive_nodes_by(cairn_simulation* simulation, int32_t mesh, int64_t n, const int32_t* node,
                                        char axis, double (*velocity)(double time, void* context), void* context,
                                        cairn_error* error);

/* Called before each part of a step that the option "cut_back" makes in parts, from time on over h [s]: gives loads and
 * motions of that part by the calls above. NULL: loads of meshes go along a straight line from begin to end of the
 * whole step. */
int32_t cairn_simulation_before_parts(cairn_simulation* simulation,
                                      void (*function)(cairn_simulation* simulation, double time, double h,
                                                       void* context),
                                      void* context, cairn_error* error);

/* Pressure on n sides of the boundary of a mesh that is not linear, of `nodes` nodes each as cairn_mesh_boundary has
 * them (2D: 2, or 3 with the middle last; 3D: 3 or 4; 6, 8, 9: triangle6, quad8, quad9); *set: its number, from 0. */
int32_t cairn_simulation_press_mesh(cairn_simulation* simulation, int32_t mesh, int32_t nodes, int64_t n,
                                    const int32_t* node, int32_t* set, cairn_error* error);
/* Pressures of a set at the begin and the end of the coming steps, from now on [Pa]; before the first: none. */
int32_t cairn_simulation_set_pressure(cairn_simulation* simulation, int32_t mesh, int32_t set, double begin, double end,
                                      cairn_error* error);
/* Between steps a rigid body becomes deformable: the mesh, of cells, of its shape as it stood when it came in, takes
 * its place, mass, momentum and angular momentum, its force and damping, and what its contacts remember, which passes
 * to the nearest ones. It touches with its whole surface where nothing else is said of it; name: NULL, "body N";
 * materials: of its nodes and sides, -1: that of the first contactor of the body, of the nodes. *number: of the mesh.
 * Its loads are the force of the body until cairn_simulation_load_mesh gives others. What kinetic energy it cannot keep
 * is "dissipated_reshaping". */
int32_t cairn_simulation_deform(cairn_simulation* simulation, int64_t body, const cairn_mesh* mesh, const char* name,
                                int32_t material, int32_t side_material, int32_t* number, cairn_error* error);
/* Between steps such a mesh becomes the rigid body that it was, where its nodes stand, with their momentum and angular
 * momentum, under its number (*body). Meshes after it count one less. What it stored, and the energy of its
 * deformation, is "dissipated_reshaping". */
int32_t cairn_simulation_rigidify(cairn_simulation* simulation, int32_t mesh, int64_t* body, cairn_error* error);
/* The same as a body of another shape, which keeps a new number, and for a mesh that was no rigid body before. The
 * shape stands where the mesh is: rotation (1 | 4) as of cairn_scene_add_bodies, may be NULL: none; mass [kg] and
 * inertia (1 | 3) [kg m2] of it, both scaled to the mass of the mesh; n contactors as of
 * cairn_simulation_add_contactors, but without their body, each array of n. Force and damping are those of the body
 * that the mesh was. */
int32_t cairn_simulation_rigidify_as(cairn_simulation* simulation, int32_t mesh, const double* rotation, double mass,
                                     const double* inertia, const char* shape, int64_t n, const int32_t* material,
                                     const double* radius, const double* offset, const double* direction,
                                     const int32_t* hull, int64_t* body, cairn_error* error);
/* From now on n rigid bodies, by their ids, are made deformable (cairn_simulation_deform with that mesh and materials,
 * "body N") after a step in which one of their contacts bore more than `force` [N], or a principal value of their mean
 * stress, the forces times their arms over the volume of the mesh, was above `stress` [Pa] (inf: none of that); and
 * rigid again after one in which none of their contacts bore `back` [N] (0: never). mesh is copied. A body that then
 * cannot be reshaped is an error of cairn_simulation_step, whose step is made. */
int32_t cairn_simulation_reshape_when(cairn_simulation* simulation, int64_t n, const int64_t* bodies,
                                      const cairn_mesh* mesh, double force, double stress, double back,
                                      int32_t material, int32_t side_material, cairn_error* error);
/* The mesh that a body was made, -1: it is rigid. */
int32_t cairn_simulation_mesh_of_body(const cairn_simulation* simulation, int64_t body, int32_t* mesh,
                                      cairn_error* error);
/* Of the cells of a mesh of materials of solids, in the order in which they came in: "stress" (6, cells), true, the
 * mean of each cell, 11 22 33 12 23 13 [Pa], or a state of their materials by its name (cells), 0 in those without. */
int32_t cairn_simulation_mesh_cells(cairn_simulation* simulation, int32_t mesh, const char* name, int64_t capacity,
                                    double* values, int64_t* count, cairn_error* error);

int64_t cairn_simulation_bodies(const cairn_simulation* simulation); /* rigid ones */
int64_t cairn_simulation_nodes(const cairn_simulation* simulation);  /* of all meshes */
/* Of the last step; -1 if they cannot be read, and cairn_simulation_contact_field tells why. */
int64_t cairn_simulation_contacts(const cairn_simulation* simulation);
/* A field of bodies by its name in fields.def ("position", "velocity", "rotation", "mass", "reaction", ...), in the
 * order of insertion; positions are absolute. values has room for capacity numbers; *count is how many there are, and
 * nothing is written if that is more. */
int32_t cairn_simulation_body_field(cairn_simulation* simulation, const char* name, int64_t capacity, double* values,
                                    int64_t* count, cairn_error* error);
/* The same of the nodes of meshes ("id", "position", "velocity", "mass", "temperature", ...), (components, n). */
int32_t cairn_simulation_node_field(cairn_simulation* simulation, const char* name, int64_t capacity, double* values,
                                    int64_t* count, cairn_error* error);
/* "position" (absolute), "displacement", "velocity", and of the last step "reaction", of held dofs [N], and "impulse",
 * of contacts [N s] (dim, nodes) of a mesh. */
int32_t cairn_simulation_mesh_field(cairn_simulation* simulation, int32_t mesh, const char* name, int64_t capacity,
                                    double* values, int64_t* count, cairn_error* error);
/* A field of the contacts of the last step by its name in contact_fields.def ("bodies", "gap", "status", ...),
 * (components, n), n of cairn_simulation_contacts; whole numbers, too, are doubles. */
int32_t cairn_simulation_contact_field(cairn_simulation* simulation, const char* name, int64_t capacity, double* values,
                                       int64_t* count, cairn_error* error);
/* By the names of report.def: a term of the energy since the start [J] ("kinetic", "stored", "closure", ...), a number
 * of the last step ("worst_contact", "penetration", ...), a text of it: "status", "solver", "hint", and "warning", of
 * what a step that converged may still have wrong: bodies that overlap by more than half the size of the smaller one,
 * or moved by more than their size, and shapes without a contact between them; empty: none of these. */
int32_t cairn_simulation_energy(const cairn_simulation* simulation, const char* term, double* value,
                                cairn_error* error);
int32_t cairn_simulation_report(const cairn_simulation* simulation, const char* name, double* value,
                                cairn_error* error);
int32_t cairn_simulation_report_text(const cairn_simulation* simulation, const char* name, int64_t capacity, char* text,
                                     cairn_error* error);
/* Contacts of the last step, each array may be NULL: ids of the bodies (2, n), antagonist second; gap (n) [m]; normal
 * (dim, n), from the antagonist to the candidate; point (dim, n) [m]; impulse (dim, n) on the candidate, in space axes
 * [N s]. n is cairn_simulation_contacts. */
int32_t cairn_simulation_contact_arrays(cairn_simulation* simulation, int64_t* bodies, double* gap, double* normal,
                                        double* point, double* impulse, cairn_error* error);

/* ---------------------------------------------------------------- networks of heat and current
 * kind: "electrical" or "thermal". A network has nothing at first: its numbers, materials, conductances and sources are
 * given by name. It is advanced by each step. */
int32_t cairn_simulation_add_network(cairn_simulation* simulation, const char* kind, cairn_error* error);
/* "theta", "steady", "tolerance", "depth" [m], "reference" [K], "switched_share"; "friction" and "joule" of heat: 0
 * none, 1 by halves, 2 by effusivity; "method": 0 as the size asks, 1 direct, 2 multigrid. */
int32_t cairn_simulation_set_network(cairn_simulation* simulation, const char* kind, const char* name, double value,
                                     cairn_error* error);
/* Of material `material` of the scene: "conductivity" [S/m | W/(m K)], "capacity" [J/(kg K)], "density", "young",
 * "poisson", "hardness", "expansion". */
int32_t cairn_simulation_set_network_material(cairn_simulation* simulation, const char* kind, int32_t material,
                                              const char* name, double value, cairn_error* error);
/* A conductance of contacts, beside those that there are, by its name in networks.def ("Holm", or "holm"). */
int32_t cairn_simulation_add_conductance(cairn_simulation* simulation, const char* kind, const char* name,
                                         int32_t parameters, const double* parameter, cairn_error* error);
/* Of the electrical network: conductance of the film [S], power at which it breaks [W], its ratio to radius times force
 * [1/s], speed that rubs it away [m/s]; inf: never. */
int32_t cairn_simulation_set_film(cairn_simulation* simulation, double conductance, double power, double ratio,
                                  double sliding, cairn_error* error);
/* what: "held", "flow", "convection" or "radiation"; value (n) [V | K], [A | W], outside [K]; coefficient (n) of the
 * last two, h A [W/K] and epsilon A [m2], else NULL. electrode, not 0: the bodies are one conductor, and share the
 * first value. *source is its number. */
int32_t cairn_simulation_add_network_source(cairn_simulation* simulation, const char* kind, const char* what, int64_t n,
                                            const int64_t* bodies, const double* value, const double* coefficient,
                                            int32_t electrode, int32_t* source, cairn_error* error);
int32_t cairn_simulation_set_network_source(cairn_simulation* simulation, const char* kind, int32_t source, int64_t n,
                                            const double* value, cairn_error* error);
/* Branches beside the contacts: bodies (2, n), conductance (n). */
int32_t cairn_simulation_add_wires(cairn_simulation* simulation, const char* kind, int64_t n, const int64_t* bodies,
                                   const double* conductance, cairn_error* error);
/* Temperatures of bodies or nodes (n) [K]; bodies NULL: of all bodies, then of all nodes, in the order of insertion. */
int32_t cairn_simulation_set_temperature(cairn_simulation* simulation, int64_t n, const int64_t* bodies,
                                         const double* temperature, cairn_error* error);
/* Of the last step: "status" (0 converged, 1 iteration limit, 2 not finite, 3 open), "branches", "floating", "open",
 * "rounds", "residual", "closure", "power", "flow"; since the start: "stored", "held", "given", "convection",
 * "radiation", "friction", "joule" [J], "charge_in", "charge_out" [C], "supplied", "balance", "in_play" [J]. */
int32_t cairn_simulation_network_report(const cairn_simulation* simulation, const char* kind, const char* name,
                                        double* value, cairn_error* error);

/* ---------------------------------------------------------------- files
 * The same as Python's: HDF5, see docs/files.md. */
/* All that the future depends on but laws, options, gravity and loads; replaced as a whole or not at all. */
int32_t cairn_simulation_write_checkpoint(cairn_simulation* simulation, const char* path, cairn_error* error);
/* Goes back, or on, to a checkpoint of the same scene: to the same bits. One that is refused, being damaged or of
 * another scene, leaves the simulation as it was. */
int32_t cairn_simulation_restart(cairn_simulation* simulation, const char* path, cairn_error* error);

/* Writes a run, a .vtkhdf file. A kill at any instant leaves what was written as outputs. mode: below; with
 * cairn_go_on, a run is gone on with at its end, or after a restart, where outputs later than the step at hand are
 * dropped; the file of another scene, or one that reaches farther without a restart, is refused and stays as it is. */
enum cairn_run_mode { cairn_new_file = 0, cairn_replace = 1, cairn_go_on = 2 };
int32_t cairn_run_writer_create(cairn_simulation* simulation, const char* path, int32_t mode, cairn_run_writer** writer,
                                cairn_error* error);
/* Bodies and contacts as they are now. */
int32_t cairn_run_writer_output(cairn_run_writer* writer, cairn_simulation* simulation, cairn_error* error);
/* The numbers of the last step, for the history: after each step. */
int32_t cairn_run_writer_step(cairn_run_writer* writer, const cairn_simulation* simulation, cairn_error* error);
int32_t cairn_run_writer_close(cairn_run_writer* writer, cairn_error* error); /* NULL is allowed */

/* Reads a run, also while it is written. */
int32_t cairn_run_open(const char* path, cairn_run** run, cairn_error* error);
void cairn_run_close(cairn_run* run); /* NULL is allowed */
int64_t cairn_run_outputs(const cairn_run* run);
/* Of the outputs [s]. values has room for capacity numbers; *count is how many there are, and nothing is written if
 * that is more: here and below. */
int32_t cairn_run_times(const cairn_run* run, int64_t capacity, double* times, int64_t* count, cairn_error* error);
/* A field of the bodies, the nodes of meshes or the contacts of an output, from 0, (components, n): "position",
 * "velocity", "radius", "id", ...; "point", "normal", "gap", "impulse", "body_a", ... Files of before format 1.2 have
 * nodes among their bodies. */
int32_t cairn_run_body_field(const cairn_run* run, int64_t output, const char* name, int64_t capacity, double* values,
                             int64_t* count, cairn_error* error);
int32_t cairn_run_node_field(const cairn_run* run, int64_t output, const char* name, int64_t capacity, double* values,
                             int64_t* count, cairn_error* error);
int32_t cairn_run_contact_field(const cairn_run* run, int64_t output, const char* name, int64_t capacity,
                                double* values, int64_t* count, cairn_error* error);
/* A column of the history, a row for each step: "time", "step", "contacts", "error", "energy_kinetic", ... */
int32_t cairn_run_history(const cairn_run* run, const char* name, int64_t capacity, double* values, int64_t* count,
                          cairn_error* error);

#ifdef __cplusplus
}
#endif
#endif
