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

#include "cairn/error.h"

#ifdef __cplusplus
extern "C" {
#endif

enum cairn_code { cairn_ok = 0, cairn_wrong_input = 1, cairn_out_of_memory = 2, cairn_internal_error = 3 };
enum cairn_solve_status { cairn_converged = 0, cairn_iteration_limit = 1, cairn_diverged = 2 };

typedef struct cairn_scene cairn_scene;
typedef struct cairn_simulation cairn_simulation;

/* "0.1.0" */
const char* cairn_version(void);

/* The contact law `law` of a shared library, which describes it (cairn/plug.h), is known by that name from now on.
 * replace, not 0: it takes the place of a law of that name. */
int32_t cairn_plug_contact_law(const char* library, const char* law, int32_t replace, cairn_error* error);

/* ---------------------------------------------------------------- scene */
int32_t cairn_scene_create(int32_t dim, cairn_scene** scene, cairn_error* error);
void cairn_scene_destroy(cairn_scene* scene); /* NULL is allowed */

int32_t cairn_scene_set_gravity(cairn_scene* scene, const double* gravity, cairn_error* error); /* (dim) [m/s2] */
/* The point that stored positions are relative to; before the first body. (dim) [m] */
int32_t cairn_scene_set_origin(cairn_scene* scene, const double* origin, cairn_error* error);
int32_t cairn_scene_add_material(cairn_scene* scene, const char* name, int32_t* material, cairn_error* error);
/* law: a name of laws.def, as in Python ("Coulomb") or as its file ("signorini_coulomb"), with its parameters in the
 * order of that list. A material of -1 on both sides: the law of all pairs that have none of their own. */
int32_t cairn_scene_set_law(cairn_scene* scene, int32_t material_a, int32_t material_b, const char* law,
                            int32_t parameters, const double* parameter, cairn_error* error);

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
/* Bit i of mask: dof i takes its value from velocity (nd, n), may be NULL: zero. */
int32_t cairn_scene_drive(cairn_scene* scene, int64_t n, const int64_t* bodies, uint8_t mask, const double* velocity,
                          cairn_error* error);

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
/* As cairn_scene_drive, between steps. */
int32_t cairn_simulation_drive(cairn_simulation* simulation, int64_t n, const int64_t* bodies, uint8_t mask,
                               const double* velocity, cairn_error* error);

int64_t cairn_simulation_bodies(const cairn_simulation* simulation);
int64_t cairn_simulation_contacts(const cairn_simulation* simulation); /* of the last step */
/* A field of bodies by its name in fields.def ("position", "velocity", "rotation", "mass", "reaction", ...), in the
 * order of insertion; positions are absolute. values has room for capacity numbers; *count is how many there are, and
 * nothing is written if that is more. */
int32_t cairn_simulation_body_field(cairn_simulation* simulation, const char* name, int64_t capacity, double* values,
                                    int64_t* count, cairn_error* error);
/* Contacts of the last step, each array may be NULL: ids of the bodies (2, n), antagonist second; gap (n) [m]; normal
 * (dim, n), from the antagonist to the candidate; point (dim, n) [m]; impulse (dim, n) on the candidate, in space axes
 * [N s]. n is cairn_simulation_contacts. */
int32_t cairn_simulation_contact_arrays(cairn_simulation* simulation, int64_t* bodies, double* gap, double* normal,
                                        double* point, double* impulse, cairn_error* error);

#ifdef __cplusplus
}
#endif
#endif
