/* Cairn's numerical kernels, as C sees them. Written in Fortran (core_f90), stateless: they allocate, print and open
 * nothing. Arrays are in Fortran order (first index fastest); sizes and units stand at the Fortran declarations. Every
 * prototype is compiled against the Fortran itself at build time. */
#ifndef CAIRN_CORE_H
#define CAIRN_CORE_H
#include "cairn/error.h"
#include "cairn/integrators.h"
#include "cairn/networks.h"
#include "cairn/smooth.h"
#include "cairn/solids.h"
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ------------------------------------------------------------------ contact laws */
/* Data of the step for laws. Fields are added at the end only. */
typedef struct cairn_law_context {
  double h, theta;        /* step [s]; parameter of the theta-method */
  const double* geometry; /* (n, 3) contact area [m2], effective radius [m], mass [kg]; see law_geometry.hpp; or NULL */
  const double* fields;   /* (n, 4) temperatures and potentials of both sides; NULL unless the scene has them */
  int32_t over_bodies;    /* 1: zones are solved over all bodies at once, and have the damage that neighbours hold */
} cairn_law_context;

/* c = local components of the law in this dimension, p = parameters, s = state variables.
 * bias (n, c) [m/s] is added to the relative velocity; compliance (n, c) [1/kg] to the diagonal of W; mu (n) is the
 * friction of the cone. Contacts come by eights: lanes that are left over hold the last one again. */
typedef void cairn_law_prepare(int32_t n, int32_t c, const cairn_law_context* context, const double* gap,
                               const double* u_begin, const double* params, double* state, double* bias,
                               double* compliance, double* mu);
/* w is (n, c, c), or W_NN and W_TT (n, 2) where the batch says so; u_free (n, c) with the bias in it, bias (n, c),
 * state (n, s) read only; r (n, c) and status (n), may be NULL, out; params (n, p + 4): then the step and geometry. */
typedef void cairn_law_solve(int32_t n, int32_t c, const double* w, const double* u_free, const double* bias,
                             const double* params, const double* state, double* r, int32_t* status);
typedef void cairn_law_commit(int32_t n, int32_t c, const cairn_law_context* context, const double* gap,
                              const double* u, const double* r, const double* params, double* state);
/* How far a law with its own solution is from it. rho (n): 1 / W_NN [kg]; w, params, state as solve has them; u (n, c)
 * is the velocity that r leaves, bias included. Out: f (n, c) [N s], 0 where the law is obeyed, else about the change
 * that would mend r, weight (n, c) [1/kg], by which squares of f are energies, status (n). Asked with r = 0, too. */
typedef void cairn_law_residual(int32_t n, int32_t c, const cairn_law_context* context, const double* rho,
                                const double* w, const double* u, const double* bias, const double* r,
                                const double* params, const double* state, double* f, double* weight, int32_t* status);
/* Called after commit, with states of before and after: energy (n, 4) [J]: stored; taken from the bodies in the step
 * along the normal, and along tangents and rotations; released of what was taken. The store gains the difference. */
typedef void cairn_law_energy(int32_t n, int32_t c, const cairn_law_context* context, const double* gap,
                              const double* u, const double* r, const double* params, const double* state_begin,
                              const double* state, double* energy);
/* For explicit strategies. u (n, c) at the middle of the step, params (p) of all n contacts, state (n, s) in and out;
 * out: f (n, c) on A [N], energy (n, 3) stored, dissipated by damping, by friction [J], or NULL. */
typedef void cairn_law_force(int32_t n, int32_t c, const cairn_law_context* context, const double* gap, const double* u,
                             const double* params, double* state, double* f, double* energy);
/* k (n, 4): normal, tangential stiffness [N/m] at an overlap, damping ratio, of spins [N m]; reach (n): first gap. */
typedef void cairn_law_stiffness(int32_t n, int32_t c, const double* overlap, const double* radius,
                                 const double* params, double* k, double* reach);
/* softening: what solve alone may say, of a bond that loses stiffness in this step by the impulse that is found. */
enum cairn_contact_status { cairn_open = 0, cairn_stick = 1, cairn_slip = 2, cairn_bonded = 3, cairn_softening = 4 };
/* Which rule is about two materials. word (2, materials): of the group, -1 without, and of the material; apart
 * (materials): 1, those that do not meet each other unless a rule names both groups; alone (words): the last rule about
 * a word and anything, any: about anything and anything, -1: none; key (2, places), rule (places): a hash table of
 * rules about two words, places a power of two or 0. */
enum cairn_law_rule { cairn_no_rule = -1, cairn_kept_apart = -2 };
void cairn_law_rule_between(int32_t a, int32_t b, const int32_t* word, const int8_t* apart, const int32_t* alone,
                            int32_t any, int64_t places, const int32_t* key, const int32_t* rule, int32_t* found);
void cairn_law_rule_place(int32_t a, int32_t b, int32_t number, int64_t places, int32_t* key, int32_t* rule,
                          int32_t* added);

/* ------------------------------------------------------------------ integrators */
void cairn_theta_free_velocity(int32_t dim, int32_t nd, int64_t nb, double h, double theta, const double* gravity,
                               const double* mass, const double* inertia, const double* velocity, double* velocity_free,
                               double* inverse_mass, const double* force, const double* damping, const int8_t* driven,
                               const double* driven_velocity);
void cairn_energy_terms(int32_t dim, int32_t nd, int64_t nb, double h, double theta, const double* gravity,
                        const double* mass, const double* inertia, const double* velocity_begin, const double* velocity,
                        double* terms, const double* force, const double* damping, const int8_t* driven,
                        double* reaction, const double* momentum_begin, const double* angular_momentum,
                        const cairn_scheme* scheme, const double* way, const double* a2, const double* a3,
                        const double* a4, const double* a5);
void cairn_theta_advance(int32_t dim, int32_t nd, int64_t nb, double time, const double* velocity, double* position,
                         double* angle);
void cairn_rotate(int64_t nb, double time, const double* inertia, const double* velocity, double* rotation,
                  const double* angular_momentum, const int8_t* driven, int64_t* unsolved);
void cairn_inverse_inertia(int64_t nb, const double* inertia, const double* rotation, const double* inverse_mass,
                           double* inverse_inertia, const int8_t* driven);
void cairn_free_spin(int64_t nb, double h, double theta, const double* inertia, const double* angular_momentum,
                     double* inverse_inertia, double* velocity, double* velocity_free, const double* force,
                     const double* damping, const int8_t* driven);
void cairn_momentum_update(int64_t nb, int32_t mode, const double* inertia, const double* rotation,
                           const double* velocity_begin, double* velocity, double* angular_momentum,
                           const int8_t* driven);

void cairn_verlet_begin(int32_t dim, int32_t nd, int64_t first, int64_t last, double h, const double* gravity,
                        const double* inverse_mass, const double* contact_force, double* velocity, double* position,
                        double* fastest, double* angle, const double* force, const double* damping,
                        const int8_t* driven, const double* driven_velocity, double* reaction);
void cairn_verlet_end(int32_t dim, int32_t nd, int64_t first, int64_t last, double h, const double* gravity,
                      const double* inverse_mass, const double* contact_force, double* velocity, int64_t* wrong,
                      const double* force, const double* damping, const int8_t* driven, const double* driven_velocity,
                      double* reaction, double* terms);
double cairn_verlet_kinetic(int32_t nd, int64_t first, int64_t last, const double* inverse_mass,
                            const double* velocity);
void cairn_verlet_begin_spheres(int64_t first, int64_t last, double h, const double* gravity,
                                const double* inverse_mass, const double* contact_force, const double* radius,
                                double* velocity, double* position, double* record, double* fastest);
void cairn_verlet_end_spheres(int64_t first, int64_t last, double h, const double* gravity, const double* inverse_mass,
                              const double* contact_force, double* velocity, int64_t* wrong, double* terms);
void cairn_verlet_turn(int64_t first, int64_t last, double h, const double* velocity, double* rotation);
void cairn_inverse_masses(int32_t dim, int32_t nd, int64_t nb, const double* mass, const double* inertia,
                          double* inverse_mass);

/* ------------------------------------------------------------------ contacts of smooth scenes */
typedef void cairn_smooth_gather(int32_t n, int32_t m, const int32_t* lane, const int32_t* body_a,
                                 const int32_t* body_b, const double* velocity, const double* grain_a,
                                 const double* grain_b, const double* gap, const double* normal, const double* lever_a,
                                 const double* lever_b, double h, int32_t scalars, int32_t vectors,
                                 const double* stored, double* frame, double* u, double* lane_gap, double* geometry,
                                 double* state, const double* jump);
typedef void cairn_smooth_scatter(int32_t n, int32_t count, int32_t m, const int32_t* lane, const int32_t* body_a,
                                  const int32_t* body_b, const double* lever_a, const double* lever_b,
                                  const double* frame, const double* f, int32_t scalars, int32_t vectors,
                                  const double* state, double* stored, double* lane_force, double* force,
                                  double* other);
void cairn_sphere_records(int64_t first, int64_t last, const double* position, const double* velocity,
                          const double* radius, const double* inverse_mass, double* record);
void cairn_sphere_gather(int32_t n, const int32_t* body_a, const int32_t* body_b, const double* record, double reach,
                         double h, double* stored, int8_t* active, int32_t* lane, int32_t* count, int32_t* filled,
                         double* frame, double* arm, double* u, double* gap, double* geometry, double* state);
void cairn_sphere_scatter(int32_t n, int32_t count, int32_t m, const int32_t* lane, const int32_t* body_a,
                          const int32_t* body_b, const double* frame, const double* arm, const double* f,
                          const double* state, double* stored, double* lane_force, double* force, double* other);
cairn_smooth_gather cairn_smooth_gather2, cairn_smooth_gather3;
cairn_smooth_scatter cairn_smooth_scatter2, cairn_smooth_scatter3;

/* ------------------------------------------------------------------ batches of contacts and the sides they rest on */
/* Mutually independent contacts of one law on one pair of kinds of side.
 * Most contacts rest on two round bodies that move and obey Coulomb's cone with a bias of the normal velocity alone, by
 * what their law says or by what it gave in this step. They are swept in one loop, and stored for it: contacts by
 * eights, one line of eight numbers after the other, normal (2 or 3), lever of A, of B, bias, mu, r (2 or 3); `frame`,
 * `lever_a` and so on then point to the first of their lines, and their blocks do not exist. A field with c components
 * is a block (count, c): each component contiguous. count is a multiple of 8; past `contacts` stand dummies on the
 * spare record, which never act. */
typedef struct cairn_condensed cairn_condensed;
typedef struct cairn_batch {
  int32_t count, contacts;    /* with and without dummies */
  int32_t components;         /* unknowns of a contact */
  int32_t block;              /* 0: Delassus block diag(W_NN, W_TT, ...), stored (n, 2); 1: full, (n, c, c) */
  int32_t side_a, side_b;     /* rows of sides.def */
  int32_t moves_a, moves_b;   /* 0: no finite inverse mass on that side, read only */
  int32_t hub;                /* 1: all contacts share body A, 2: body B, and each sees its velocity at the start */
  int32_t group;              /* by which the inverse mass of the hub is multiplied in delassus */
  int32_t law;                /* row of laws.def */
  int32_t first;              /* place of its first contact in the order of batches */
  int32_t velocities;         /* numbers of a record that are velocities: 3 in 2D, 6 in 3D */
  int32_t pack;               /* 0, or the lines of a pack: see above */
  int32_t relaxes;            /* 1: over-relaxation applies; 2: and sweeps refine it; 0: the law has its own solution */
  int32_t bonds;              /* 1: held fast where the first state is above 0, a cone where it is 0 */
  int32_t repeats;            /* 1: solve is handed the last contact again where there is a dummy */
  int32_t mapped_a, mapped_b; /* 1: that side rests on nodes of a condensed body, its lever is their weights; 2: and
                               * one of these bodies has a reach */
  int32_t in_turn;          /* 1: its contacts see each other, and are swept one after the other; a cone, full blocks */
  int32_t nodes_a, nodes_b; /* of a mapped side: nodes of a contact, at most */
  int32_t stride_a, stride_b; /* of a mapped side: rows of a response; 0: there are none */
  int32_t *body_a, *body_b;   /* (n) places of velocity records, of condensed bodies where mapped */
  int32_t *node_a, *node_b;   /* (n, 4) of a mapped side: places among the contact nodes of its body; else null */
  int32_t *dof_a, *dof_b;  /* (n, 6) of a mapped side: places in `condensed_velocity` of the first dof of its nodes (4)
                            * and of its body, and rows of the response that are the body's */
  int32_t* turns;          /* (n) 1: the mapped side has a spin, that of its face, and takes moments as couples on the
                            * nodes of the face; null: none has, and no moment passes */
  double *spin_a, *spin_b; /* (n, dimension, 4, c - dimension) of a mapped side that turns: its spin about the axes of
                            * the contact by the velocities of its nodes, node by node [1/m]; else null */
  const cairn_condensed* condensed; /* bodies of mapped sides */
  double* condensed_velocity;       /* of all condensed bodies, each from the start of a cache line on [m/s] */
  double *response_a, *response_b; /* (stride, dimension, or c where it turns, n) what a unit impulse along each axis of
                                    * the contact, then a unit moment, does to the velocities of its body, zero beyond
                                    * its dofs [1/kg], [1/(kg m)] */
  double* frame;                   /* 2D (n, 2) normal; 3D (n, 6) normal, first tangent */
  double *lever_a, *lever_b;       /* (n, lever of the side) [m] */
  double* delassus;                /* [1/kg] */
  double* bias;                    /* (n, c) [m/s] */
  double* compliance;              /* (n, c) diagonal that W has besides that of bodies [1/kg]; null: none */
  double* params;                  /* (n, p + 4) as solve has them, or mu (n) of the cone */
  double* r;                       /* (n, c) impulse [N s] */
  double* rho;                     /* (n) 1 / true W_NN [kg] */
  double* scale;                   /* (n) |F(0)|^2 / rho [J] */
  double* state;                   /* (n, s) of the law */
  int32_t* status;                 /* (n) see cairn_contact_status */
  cairn_law_solve* solve;
  cairn_law_residual* residual;     /* null: the cone's; without a cone, by what solve changes */
  const cairn_law_context* context; /* for residual */
  int32_t* rope_body;               /* (2, n) velocity records that the far part of a rope moves; null: none */
  double* rope; /* (26, n) what that part adds to u_N when it was read last [m/s] and to W_NN [1/kg]; for each of these
                 * bodies its row of H' (6, in 2D 3), then A^-1 H of it (6) */
} cairn_batch;

/* A kind of side. Velocity records: 8 numbers a body, 2D: velocity (2), spin, inverse mass (2), inverse inertia, 0, 0;
 * 3D: velocity (3), spin (3), inverse mass along x, inverse inertia (isotropic). A side of width 16 reads 8 more, 3D:
 * inverse mass along y and z, inverse inertia xx yy zz xy xz yz. Records come as columns v (n, width); sign is +1 on A,
 * -1 on B. */
typedef void cairn_side_gather(int32_t n, int32_t c, int32_t width, double sign, const double* v, const double* frame,
                               const double* lever, double* u); /* u (n, c) += sign H'v */
typedef void cairn_side_scatter(int32_t n, int32_t c, int32_t width, double sign, const double* dr, const double* frame,
                                const double* lever, double* v); /* v += sign A^-1 H dr */
typedef void cairn_side_delassus(int32_t n, int32_t c, int32_t width, double factor, const double* v,
                                 const double* frame, const double* lever,
                                 double* w); /* w (n, c, c) += factor H' A^-1 H */
typedef struct cairn_side {
  cairn_side_gather* gather;
  cairn_side_scatter* scatter;
  cairn_side_delassus* delassus;
  int32_t lever; /* numbers of the lever */
  int32_t width; /* numbers of a record: 8 or 16 */
} cairn_side;

typedef struct cairn_record {
  double x[8];
} cairn_record;
/* A body that deforms as contacts see it: velocities of its contact nodes, node by node, and S = B A^-1 B' on their
 * dofs, A the matrix of the body's step. An impulse on one of them moves them all. */
struct cairn_condensed {
  int64_t dofs;                    /* of contact nodes */
  int64_t leading;                 /* rows of a column of the compliance */
  double* velocity;                /* (dofs) [m/s] */
  double* compliance;              /* (leading, dofs) [1/kg]; not read where there is a reach */
  const struct cairn_reach* reach; /* null: S is formed */
};
/* S = unit Z' Z by columns of Z (reached_bodies.f90). Of contact node i segments first[i] to first[i + 1] - 1: rows
 * from `place` on, `length` of them, places rising; its numbers (length, dimension) segment by segment from value[i]
 * on. The velocity of a node is that in `velocity`, which impulses leave as it is, and Z' y. */
typedef struct cairn_reach {
  int64_t numbers; /* of y */
  double unit;     /* a power of two */
  const int64_t *first, *place, *length;
  const double* const* value; /* [kg^-1/2] over the root of the unit */
  double* y;                  /* (numbers) unit Z times the impulses */
} cairn_reach;
/* What impulses made of the velocity of a contact node, Z' y; and the compliance between two nodes of any such body,
 * block (dimension, dimension) [1/kg]. */
void cairn_reached_velocity(int32_t dimension, const cairn_condensed* body, int32_t node, double* velocity);
void cairn_condensed_block(int32_t dimension, const cairn_condensed* body, int32_t row, int32_t column, double* block);
void cairn_mapped_responses(const cairn_batch* batch, int32_t dimension);
/* What a strategy poses at contacts in place of Moreau's condition, from what their law prepared; columns (n, c).
 * params (2) of the strategy; force_begin that of the contact at the start of the step; given: impulses besides those
 * that are solved for. */
typedef void cairn_pose(int32_t n, int32_t c, double h, double theta, const double* params, const double* gap,
                        const double* u_begin, const double* force_begin, double* bias, double* compliance,
                        double* given);
cairn_law_solve cairn_cone_isotropic2, cairn_cone_isotropic3, cairn_cone_full2, cairn_cone_full3;

/* ------------------------------------------------------------------ sweeps and passes over batches
 * A stage is a range of tasks that share no body that moves; a task is a range of batches, done in order. */
typedef struct cairn_schedule {
  int32_t stages;
  int32_t batches;
  int32_t threads;
  int32_t associated; /* 1: packed contacts that slip open as well, see radial_sweep.f90 */
  double relaxation;  /* by which a change of impulse exceeds what its contact alone would ask, 1 to 2 (Cryer 1971) */
  double softening_relaxation; /* share of its change that a bond which softens takes in a sweep, up to 1 */
  const int32_t* first_task;   /* (stages + 1) */
  const int32_t* first_batch;  /* (tasks + 1) */
  const cairn_batch* batch;    /* (batches) */
  const cairn_side* side;      /* rows of sides.def */
  cairn_record* record;        /* (bodies + 1) velocity records; the last is the spare one */
  cairn_record* general;       /* (bodies + 1), or any address if no side is wide */
  double* work;                /* (cairn_batch_workspace, threads) */
} cairn_schedule;
enum { cairn_batch_workspace = 128 * 80 };
void cairn_nlgs_sweep(int32_t sweeps, const cairn_schedule* schedule, double* change);
void cairn_extrapolated_sweep(const cairn_schedule* schedule, double factor, int64_t bodies, int32_t velocities,
                              double* before, int32_t stride, double* r_before, double* change, double* along);
void cairn_sweep_chosen(int32_t sweeps, const cairn_schedule* schedule, const int32_t* chosen, double* change);
void cairn_normal_sweep(int32_t sweeps, const cairn_schedule* schedule, const double* asked, double* p, double* change);
void cairn_add_impulses(const cairn_schedule* schedule);
void cairn_relative_velocities(const cairn_schedule* schedule, int32_t batch, int32_t thread, double* u);
void cairn_delassus(const cairn_schedule* schedule, int32_t batch, int32_t thread, double* w, double* w_true,
                    double* u);
void cairn_contact_work(const cairn_schedule* schedule, double* sums);
void cairn_contact_scale(const cairn_schedule* schedule, double* sums);
void cairn_contact_error(const cairn_schedule* schedule, int32_t want_status, double least_scale, double* sums);
void cairn_law_misses(const cairn_schedule* schedule, int32_t batch, double* missed);

/* The textbook's sweep, one contact after the other: what batches are checked against and timed by. */
void cairn_plain_sweep2(int64_t n, const int32_t* body, const double* normal, const double* lever, const double* mu,
                        const double* bias, const double* inverse_mass, const double* inverse_inertia, double* v,
                        double* r);
void cairn_plain_sweep3(int64_t n, const int32_t* body, const double* frame, const double* lever, const double* mu,
                        const double* bias, const double* inverse_mass, const double* inverse_inertia, double* v,
                        double* r);

/* ------------------------------------------------------------------ frictional contact problems on their own
 * W in dim x dim blocks by rows (Fortran order inside a block); vectors contact-major (dim, n); places from 0. */
void cairn_block_product(int32_t dim, int64_t n, const int64_t* row_start, const int32_t* column, const double* block,
                         const double* q, const double* r, double* u, int32_t threads);
void cairn_block_diagonal(int32_t dim, int64_t n, const int64_t* row_start, const int32_t* column, const double* block,
                          int64_t* place, double* w_nn);
void cairn_project_cones(int32_t dim, int64_t n, const double* mu, double* r);
void cairn_cone_derivatives(int32_t dim, int64_t n, const double* mu, const double* weight, const double* r,
                            double* derivative);
void cairn_problem_error(int32_t dim, int64_t n, const double* mu, const double* w_nn, const double* r, const double* u,
                         double* residual, double* size);
void cairn_problem_figures(int32_t dim, int64_t n, const double* mu, const double* w_nn, const double* q,
                           const double* r, const double* u, double* figures);
void cairn_problem_speeds(int32_t dim, int64_t n, const double* mu, const double* w_nn, const double* r,
                          const double* u, double* speed);
void cairn_law_breaks(int32_t dim, int64_t n, const double* mu, const double* w_nn, const double* r, const double* u,
                      double* broken);
void cairn_project_disks(int32_t dim, int64_t n, const double* mu, double* r);
void cairn_nesterov_lean(int64_t n, double factor, double* before, double* r, double* start);
void cairn_nesterov_along(int32_t dim, int64_t contacts, const double* w_nn, const double* start, const double* before,
                          const double* r, double* along);
void cairn_shuffle(int64_t n, int64_t* state, int32_t* order);
void cairn_colour_blocks(int64_t n, const int64_t* row_start, const int32_t* column, int32_t* colour, int32_t* order,
                         int64_t* colours, int64_t* colour_start);
void cairn_anderson_store(int64_t n, int32_t columns, int32_t slot, const double* weight, const double* f,
                          const double* f_last, const double* g, const double* g_last, double* df, double* dg,
                          double* gram, double* work);
void cairn_anderson_mix(int64_t n, int32_t columns, const double* weight, const double* f, const double* g,
                        const double* df, const double* dg, const double* gram, double* r, double* work);
void cairn_tangent_gradient(int32_t dim, int64_t n, const double* mu, const double* rho, const double* r,
                            const double* u, double* w);
void cairn_conjugate_direction(int32_t dim, int64_t n, const double* mu, const double* r, const double* w, double b,
                               double* p);
void cairn_disk_step(int32_t dim, int64_t n, const double* mu, double step, const double* p, double* r);
void cairn_contact_scales(int32_t dim, int64_t n, const double* block, const int64_t* place, double* rho);
void cairn_gradient_step(int32_t dim, int64_t n, const double* mu, const double* rho, double step, const double* y,
                         const double* u, double* r);
void cairn_extrapolate(int64_t n, double momentum, const double* r, const double* r_last, double* y,
                       int32_t* turned_back);
double cairn_gradient_ratio(int32_t dim, int64_t n, const double* mu, const double* rho, const double* r,
                            const double* u, const double* s, const double* v);
enum { cairn_contact_block_size = 16 };
void cairn_nlgs_prepare(int32_t dim, int64_t n, const int64_t* row_start, const int32_t* column, const double* block,
                        int32_t* beside_column, double* beside, double* local);
void cairn_nlgs_blocks(int32_t dim, int64_t n, const int64_t* row_start, const int32_t* beside_column,
                       const double* beside, const double* local, const double* q, const double* mu, int64_t first,
                       int64_t last, const int32_t* order, double relaxation, double* slip, double* r, double* change,
                       int32_t threads);

#define CAIRN_NEWTON_FUNCTION(name)                                                                                    \
  void cairn_newton_##name(int32_t dim, int64_t n, const double* mu, const double* rho, const double* r,               \
                           const double* u, int32_t want, double* f, int32_t* unknowns, double* left, double* basis,   \
                           double* own, double* step, double* target)
CAIRN_NEWTON_FUNCTION(alart_curnier);
CAIRN_NEWTON_FUNCTION(jean_moreau);
CAIRN_NEWTON_FUNCTION(fischer_burmeister);
#undef CAIRN_NEWTON_FUNCTION
void cairn_newton_blocks(int32_t dim, int64_t n, const int64_t* row_start, const int32_t* column, const double* block,
                         double alpha, const int32_t* unknowns, const double* left, const double* basis,
                         const double* own, double* matrix);
void cairn_newton_targets(int32_t dim, int64_t n, double alpha, const int32_t* unknowns, const double* left,
                          const double* step, const double* change, const double* target, double* rhs);
void cairn_newton_step(int32_t dim, int64_t n, const int32_t* unknowns, const double* basis, const double* y,
                       double* step);
/* The same over bodies: rows (dim, dofs, 2, n) of H' with their signs, body (2, n), -1 where a side does not move. */
void cairn_newton_answers(int32_t dim, int64_t n, double alpha, const int32_t* unknowns, const double* left,
                          const double* basis, const double* own, const double* step, const double* target,
                          double* answer, double* known);
void cairn_newton_body_blocks(int32_t dim, int32_t dofs, int64_t n, int64_t nb, const int32_t* body, const double* rows,
                              const double* answer, const double* mass, const int64_t* diagonal, const int64_t* place,
                              int64_t blocks, double* matrix);
void cairn_newton_add_body_blocks(int32_t dim, int32_t dofs, int64_t n, int64_t nb, const int32_t* body,
                                  const double* rows, const double* answer, const int64_t* diagonal,
                                  const int64_t* place, int64_t blocks, double* matrix);
void cairn_half_product(int32_t dofs, int64_t nb, const int64_t* row_start, const int32_t* column, const double* matrix,
                        const double* x, double* y);
void cairn_contact_nudges(int32_t n, int32_t c, int32_t axes, const double* w, const double* q, const double* r,
                          double speed, double* nudges);
void cairn_contact_responses(int32_t n, int32_t c, int32_t contacts, double proximal, const int32_t* held,
                             const double* w, const double* r, const double* target, const double* nudged,
                             const double* nudges, double* answer, double* known);
void cairn_newton_body_step(int32_t dim, int64_t n, const double* answer, const double* known, const double* change,
                            double* step);
void cairn_body_impulses(int32_t dim, int32_t dofs, int64_t n, int64_t nb, const int32_t* body, const double* rows,
                         const double* r, double* p);
void cairn_body_velocities(int32_t dim, int32_t dofs, int64_t n, int64_t nb, const int32_t* body, const double* rows,
                           const double* v, const double* q, double* u);
void cairn_body_product(int32_t dim, int32_t dofs, int64_t n, int64_t nb, const int32_t* body, const double* rows,
                        const double* inverse, const double* r, const double* q, double* v, double* u);
void cairn_body_blocks(int32_t dim, int32_t dofs, int64_t n, int64_t nb, const int32_t* body, const double* rows,
                       const double* inverse, const int64_t* row_start, const int32_t* column, double* block);
void cairn_admm_load(int32_t dim, int64_t n, double rho, const double* q, const double* z, const double* v,
                     const double* s, double* load);
void cairn_admm_update(int32_t dim, int64_t n, double rho, double relaxation, const double* mu, const double* r,
                       double* z, double* v, double* s, double* sums);
void cairn_interior_scaling(int32_t dim, int64_t n, const double* mu, const double* r, const double* y, double* theta,
                            double* inverse);
void cairn_interior_length(int32_t dim, int64_t n, const double* mu, const double* r, const double* dr, const double* y,
                           const double* dy, double* length);
void cairn_lemke_tableau(int32_t dim, int64_t n, int32_t facets, const int64_t* row_start, const int32_t* column,
                         const double* block, const double* q, const double* mu, const double* angle, int64_t m,
                         double* tableau);
int32_t cairn_lemke_pivots(int64_t m, int64_t most, double* tableau, int64_t* basis, int64_t* other, int64_t* pivots);
void cairn_lemke_impulses(int32_t dim, int64_t n, int32_t facets, const double* angle, int64_t m, const double* tableau,
                          const int64_t* basis, double* r);
void cairn_enumeration_impulses(int32_t dim, int64_t n, const double* w, const double* q, const double* mu,
                                const int32_t* state, int32_t rounds, double* matrix, double* right, double* direction,
                                double* r);
int64_t cairn_block_factor(int32_t dim, int64_t n, const int32_t* order, const int32_t* place, const int64_t* row_start,
                           const int32_t* column, const double* block, const int32_t* active,
                           const int64_t* lower_start, const int32_t* lower, const int64_t* upper_start,
                           const int32_t* upper, int64_t* lower_last, int32_t* lower_kept, int64_t* upper_last,
                           int32_t* upper_kept, double* lower_block, double* upper_block, double* diagonal,
                           double* work);
void cairn_block_solve(int32_t dim, int64_t n, const int32_t* order, const int32_t* active, const int64_t* lower_start,
                       const int64_t* lower_last, const int32_t* lower_kept, const int64_t* upper_start,
                       const int64_t* upper_last, const int32_t* upper_kept, const double* lower_block,
                       const double* upper_block, const double* diagonal, double* b, double* x);
void cairn_column_triangles(int32_t lanes, int64_t n, const int64_t* first, const int64_t* last, const int32_t* row,
                            const double* value, const double* pivot, double* y);
void cairn_front_triangles(int32_t lanes, int64_t blocks, const int32_t* column_start, const int32_t* row_start,
                           const int32_t* value_start, const int32_t* row, const double* value, double* y,
                           double* work);
void cairn_block_cholesky(int64_t n, int64_t blocks, const int32_t* column_start, const int32_t* row_start,
                          const int32_t* value_start, const int32_t* row, const int32_t* node, double* value,
                          int32_t* next, int32_t* head, int32_t* taken, int32_t* place, double* work, int32_t* failed);
void cairn_unit_front(int64_t lanes, int64_t leading, int64_t rows, int64_t columns, int64_t from, const double* l,
                      double* y);
void cairn_unit_column(int64_t lanes, int64_t leading, int64_t below, double pivot, const double* l, double* y);
void cairn_unit_products(int64_t lanes, int64_t leading, const double* a, int64_t others, int64_t leading_b,
                         const double* b, int64_t columns, int64_t from, const int64_t* place, const int64_t* place_b,
                         int64_t rows, double* out);
void cairn_band_triangles(int32_t lanes, int64_t n, int64_t half, const double* l, double* y);
void cairn_small_factor(int64_t groups, int32_t n, double zero, double* a, int32_t* failed, double* pivot);
void cairn_small_solve(int64_t groups, int32_t n, const double* a, double* b);
void cairn_small_inverse(int64_t groups, int32_t n, const double* a, double* inverse);
void cairn_newton_weights(int32_t dim, int64_t n, const int64_t* place, const double* block, double* rho);
void cairn_proximal_velocity(int64_t n, double alpha, const double* r, const double* centre, const double* u,
                             double* shifted);

/* ------------------------------------------------------------------ finite elements
 * An element is its rules of integration, one for mass, one for stresses, xi (dim, points) and weight (points), and its
 * shape functions at xi (dim): value (nodes), gradient (dim, nodes). */
typedef void cairn_element_rule(double* xi, double* weight);
typedef void cairn_element_shape(const double* xi, double* value, double* gradient);
/* n elements: x (dim, nodes, n); stiffness and mass (dofs, dofs, n), consistent; wrong (n) 1: flat or inside out;
 * stress (3 | 6, n), of displacements (dofs, n). */
void cairn_elastic_matrices(int32_t dim, int32_t nodes, int32_t points, const double* value, const double* gradient,
                            const double* weight, int64_t n, const double* x, double density, const double* elasticity,
                            double* stiffness, double* mass, int32_t* wrong);
void cairn_elastic_stress(int32_t dim, int32_t nodes, const double* gradient, int64_t n, const double* x,
                          const double* elasticity, const double* displacement, double* stress);

/* Of n bars (dim, 2, dim, 2, n) and beams (6 | 12, 6 | 12, n) between two nodes, x (dim, 2, n); inertia (2, n). */
void cairn_bar_stiffness(int32_t dim, int64_t n, const double* x, const double* young, const double* area,
                         double* stiffness);
void cairn_beam_stiffness(int32_t dim, int64_t n, const double* x, const double* up, const double* young,
                          const double* shear, const double* area, const double* inertia, const double* torsion,
                          const double* shear_area, double* stiffness);
/* Of n bars that move far, kinematics 1 corotational, 2 total Lagrangian: energy (n), force on the second end (3, n),
 * tangent (3, 3, n); fault (n). Of beams: d0, moved (3, n), axes (3, 3, n), turned (3, 3, 2, n), stiff (6, n); force
 * (9, n), tangent (9, 9, n). See corotational_frames.f90. */
void cairn_bars_moved(int64_t n, int32_t kinematics, const double* d0, const double* moved, const double* begin,
                      int32_t by_energy, const double* axial, const double* pull, double* energy, double* force,
                      double* tangent, int32_t* fault);
void cairn_beams_moved(int64_t n, const double* d0, const double* axes, const double* moved, const double* turned,
                       const double* stiff, const double* pull, int32_t want, double* energy, double* force,
                       double* tangent, int32_t* fault);

/* ------------------------------------------------------------------ detection */
void cairn_contactor_centres(int32_t dim, int64_t first, int64_t last, const int32_t* body, const double* position,
                             int32_t has_offset, const double* offset, int32_t has_rotation, const double* rotation,
                             double* centre, int64_t* not_finite);
void cairn_contactor_directions(int32_t dim, int64_t first, int64_t last, const int32_t* body, const double* direction,
                                int32_t has_rotation, const double* rotation, double* turned);
void cairn_contactor_reach(int32_t dim, int64_t first, int64_t last, const int16_t* shape, int32_t elongated,
                           const double* radius, const double* direction, double share, const double* margin,
                           double* reach, int64_t* wrong);
void cairn_periodic_items(int32_t dim, int64_t n, const int32_t* listed, const double* centre, const double* reach,
                          const int32_t* periodic, const double* vectors, const double* corner, double* x,
                          double* x_reach, int32_t* lattice);
void cairn_periodic_ghosts(int32_t dim, int64_t first, int64_t last, const double* x, const double* reach,
                           const int32_t* lattice, const int32_t* periodic, const double* vectors, const double* corner,
                           int64_t capacity, int32_t* ghost_of, double* ghost_x, double* ghost_reach,
                           int32_t* ghost_lattice, int64_t* found, int64_t* too_wide);
void cairn_grid_classes(int64_t n, const double* reach, int64_t* items, double* widest, double* smallest,
                        double* largest);
void cairn_grid_level(int64_t first, int64_t last, const double* reach, double unit, int32_t lowest, int32_t highest,
                      int32_t* level, int64_t* items);
void cairn_grid_box(int32_t dim, int64_t first, int64_t last, const double* x, const int32_t* level, int32_t lowest,
                    int32_t highest, double* low, double* high);
void cairn_grid_keys(int32_t dim, int64_t first, int64_t last, const double* x, const int32_t* level, int32_t lowest,
                     int32_t highest, const double* inverse_cell, const int64_t* origin, const int64_t* stride,
                     const int64_t* first_key, const int64_t* table_first, const int64_t* table_size,
                     const int64_t* table, const int64_t* table_place, int64_t* key);
void cairn_sort_keys(int64_t n, int64_t largest, int64_t* key, int32_t* order, int64_t* key_work, int32_t* order_work);
void cairn_grid_cells(int64_t n, const int64_t* key, int64_t* cell_key, int32_t* cell_start, int64_t* cells);
void cairn_grid_gather(int32_t dim, int64_t n, int64_t first, int64_t last, const int32_t* order, const double* x,
                       const double* reach, double* sorted);
void cairn_grid_search(int32_t dim, int64_t n, const double* sorted, int64_t cells, int64_t first, int64_t last,
                       const int64_t* cell_key, const int32_t* cell_start, int32_t levels, const int64_t* level_cell,
                       const double* inverse_cell, const int64_t* origin, const int64_t* extent, const int64_t* stride,
                       const int64_t* first_key, const int64_t* table_first, const int64_t* table_size,
                       const int64_t* table, const int64_t* table_place, const int8_t* apart, int64_t capacity,
                       int32_t* hits, int64_t* found, int64_t* needed);
void cairn_plane_search(int32_t dim, int64_t n, const int32_t* listed, const double* centre, const double* reach,
                        const double* origin, const double* normal, double margin, int64_t capacity, int32_t* near,
                        int64_t* found);
void cairn_tube_search(int32_t dim, int64_t n, const int32_t* listed, const double* centre, const double* reach,
                       const double* origin, const double* axis, double radius, double margin, int64_t capacity,
                       int32_t* near, int64_t* found);
void cairn_bar_search(int64_t n, int32_t* a, int32_t* b, int32_t* image, int32_t bar, const int16_t* shape,
                      const double* centre, const double* direction, const double* reach, const double* vectors,
                      int64_t* kept);
void cairn_pairs_of_hits(int64_t n, const int32_t* hits, const int32_t* order, const int32_t* item, int32_t* a,
                         int32_t* b, int32_t* image);
void cairn_pairs_of_ghosts(int64_t n, const int32_t* hits, const int32_t* order, const int32_t* item, int64_t nb_real,
                           const int32_t* lattice, const double* reach, int32_t* a, int32_t* b, int32_t* image,
                           int64_t* kept);
void cairn_pair_movable(int32_t dofs, int64_t first, int64_t last, const double* inverse_mass, int8_t* movable);
void cairn_pair_admit(int64_t n, int32_t* a, int32_t* b, int32_t* image, int32_t shapes, const int32_t* kind_of,
                      const int32_t* turn_of, const int32_t* body, const int16_t* shape, const int64_t* id,
                      const int8_t* movable, int32_t rules, const int32_t* material, const int8_t* meet,
                      const int32_t* word, const int8_t* apart, const int32_t* alone, int32_t any_rule, int64_t places,
                      const int32_t* key, const int32_t* rule, int32_t* kind, int64_t* kept);
void cairn_pair_count(int64_t n, int64_t contactors, const int32_t* slot_of_kind, const int32_t* kind, const int32_t* a,
                      int32_t* count);
void cairn_pair_starts(int64_t slots, int32_t* place);
void cairn_pair_scatter(int64_t n, int64_t contactors, const int32_t* slot_of_kind, const int32_t* kind,
                        const int32_t* a, const int32_t* b, const int32_t* image, int32_t* place, int32_t* a_out,
                        int32_t* b_out, int32_t* image_out);
void cairn_pair_tidy(int64_t first, int64_t last, const int32_t* place, int32_t* b, int32_t* image);
void cairn_pair_gather(int32_t dim, int32_t n, const int32_t* a, const int32_t* b, const int32_t* image,
                       const double* centre, const double* radius, int32_t has_direction, const double* direction,
                       int32_t periodic, const double* vectors, double* between, double* radius_a, double* radius_b,
                       double* direction_b);
void cairn_pair_keep(int32_t dim, int32_t n, const int32_t* a, const int32_t* b, const int32_t* image,
                     const double* centre, const double* gap, const double* normal, const double* point,
                     const int32_t* status, double constant, const double* margin, int32_t* a_out, int32_t* b_out,
                     int32_t* image_out, int32_t* feature_out, double* gap_out, double* normal_out, double* point_out,
                     int32_t* kept, int32_t* refused);
void cairn_pairs_beyond(int32_t dim, int64_t first, int64_t last, const double* centre, const double* reach,
                        const double* centre_then, const double* room, int64_t* beyond);
/* The narrow phase of a pair of shapes, on n pairs, each component contiguous: between (n, dim) is centre of A - centre
 * of B, direction_b (n, dim + 1); out: gap (n), normal (n, dim), point (n, dim) from the centre of A, status (n) see
 * below. */
typedef void cairn_pair_contact(int32_t n, const double* between, const double* radius_a, const double* radius_b,
                                const double* direction_b, double* gap, double* normal, double* point, int32_t* status);
enum cairn_pair_status { cairn_touches = 0, cairn_apart = 1, cairn_does_not_fit = 2, cairn_repeated = 3 };
/* What the one kernel of all convex shapes sees a shape as; a half space is B. See convex_shape.f90. */
enum cairn_convex {
  cairn_convex_none = -1,
  cairn_convex_point = 0,
  cairn_convex_segment = 1,
  cairn_convex_cylinder = 2,
  cairn_convex_superquadric = 3,
  cairn_convex_polyhedron = 4,
  cairn_convex_half_space = 5
};
/* Convex polygons, polyhedra and round shapes: what contactors share, numbered within a hull from 1, and a copy of each
 * contactor turned to where it is. first_... (n + 1) count from 0. */
typedef struct cairn_hulls {
  int32_t dim;
  int32_t most;                 /* contacts a pair of the present kind may have */
  int32_t seen_a, seen_b;       /* what cairn_pair_convex sees A and B as: enum cairn_convex */
  const int32_t* hull;          /* (contactors) -1: none */
  const int32_t* first_vertex;  /* (hulls + 1) */
  const int32_t* first_face;    /* (hulls + 1); sides in 2D */
  const int32_t* first_edge;    /* (hulls + 1); none in 2D */
  const int32_t* first_corner;  /* (faces + 1); none in 2D */
  const int32_t* corner_vertex; /* (corners) counterclockwise from outside */
  const int32_t* corner_edge;   /* (corners) from a corner to the next */
  const int32_t* edge;          /* (4, edges) vertices from and to, face left and right of it */
  const double* offset;         /* (faces) of their planes from the centre of the hull [m] */
  const double* inner;          /* (hulls) radius of the ball around the centre that a hull holds [m] */
  const int64_t* place;         /* (contactors) where the turned copy begins */
  const double* turned;         /* of each contactor: vertices (n, dim) from its centre [m], then normals (n, dim) */
  int32_t* recalled;            /* (2, pairs of the call) features of each pair's axis last time, then now; or 0 */
} cairn_hulls;
/* Begins to bring what kernels read of a contactor's hull, in 3D, into the cache. feature: as recalled. */
void cairn_fetch_hull(const cairn_hulls* hulls, int32_t contactor, int32_t feature);
void cairn_hull_place(int32_t dim, int64_t first, int64_t last, const int32_t* body, const int32_t* hull,
                      const int64_t* place, const int32_t* first_vertex, const int32_t* first_face,
                      const double* vertex, const double* normal, const double* offset, int32_t has_rotation,
                      const double* rotation, const double* radius, const double* reach, double* turned, double* box);
void cairn_box_search(int32_t dim, int64_t n, int32_t* a, int32_t* b, int32_t* image, const double* centre,
                      const double* box, const double* vectors, int64_t* kept);
/* The same for pairs that see hulls: count (n) points of each pair, gap and feature (most, n), normal and point
 * (dim, most, n); points with a gap above limit (n) are left out. */
typedef void cairn_hull_contact(int32_t n, const cairn_hulls* hulls, const int32_t* a, const int32_t* b,
                                const double* between, const double* radius_a, const double* radius_b,
                                const double* direction_b, const double* limit, int32_t* count, double* gap,
                                double* normal, double* point, int32_t* feature);
/* Features of declared pairs with a facet, whose limit is the largest number: the point is on the facet itself; or not,
 * and the contact is to be left out where another facet has it. */
enum cairn_declared_feature { cairn_spare = -1, cairn_own = -2 };
/* Of all rows CAIRN_CONVEX_PAIR: hulls says what A and what B is seen as. */
cairn_hull_contact cairn_pair_convex;
/* The plain way, to check against: see core_f90/reference. */
void cairn_reference_detection(int32_t dim, int32_t n, const int32_t* form, const int32_t* body, const int64_t* id,
                               const int32_t* immovable, const double* centre, const double* radius,
                               const double* direction, const double* margin, const double* vectors,
                               const int32_t* span, int64_t capacity, int32_t* a, int32_t* b, int32_t* lattice,
                               double* gap, double* normal, double* point, int64_t* found);
void cairn_hilbert_keys(int32_t dim, int64_t n, const double* position, const double* low, const double* width,
                        int64_t* key);

#ifdef __cplusplus
}
#endif
#endif
