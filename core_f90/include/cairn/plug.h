/* What a user's shared library tells Cairn of a routine that it offers: `void cairn_describe_NAME(descriptor*)` fills
 * the descriptor of the routine NAME. The routine has the form of a built-in kernel, see cairn/core.h. Fortran users
 * take the module cairn_plug, which says the same. */
#ifndef CAIRN_PLUG_H
#define CAIRN_PLUG_H
#include "cairn/body_calls.h"
#include "cairn/core.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { CAIRN_PLUG_ABI = 2 }; /* libraries of version 1, whose descriptor ends with complaint, are taken too */
enum cairn_plug_kind {
  cairn_plug_law = 1,
  cairn_plug_solver,
  cairn_plug_pair,
  cairn_plug_velocity,
  cairn_plug_force,
  cairn_plug_body
};

typedef void cairn_plug_slot(void);

/* Given zeroed. Texts end with a null. */
typedef struct cairn_plug_descriptor {
  int32_t abi;                /* CAIRN_PLUG_ABI of the header that the library was compiled with */
  int32_t size;               /* sizeof(cairn_plug_descriptor) */
  int32_t context_size;       /* sizeof(cairn_law_context) */
  int32_t kind;               /* see cairn_plug_kind */
  int32_t components2;        /* unknowns of a contact in 2D: 2, or 3 with the rotation; 0: not in 2D */
  int32_t components3;        /* in 3D: 3, or 6 with rotations; 0: not in 3D */
  int32_t normal_bias;        /* 1: a cone, whose bias is along the normal and asks for the gap and parameters alone */
  int32_t thread_unsafe;      /* 1: one call at a time (SAVE, COMMON, static data) */
  char name[64];              /* as in cairn_describe_NAME */
  char parameters[1024];      /* "name:default:smallest:largest ...", no default: required */
  char state[1024];           /* "name:value of a new contact ..." */
  cairn_law_prepare* prepare; /* of other kinds than law: their routine, see below, cast */
  cairn_law_solve* solve;     /* NULL: the law is a cone after prepare, which Cairn solves */
  cairn_law_commit* commit;
  cairn_plug_slot* force;         /* of explicit strategies */
  const char* (*complaint)(void); /* may be NULL: why the last call gave no number, or NULL */
  cairn_law_residual* residual;   /* NULL: contacts of a law with solve are solved once more to see how far they are */
  cairn_law_energy* energy;
  int32_t keeps; /* 1: a pair stays a contact while its first state variable is above 0, see laws.def */
  int32_t unused;
} cairn_plug_descriptor;
typedef void cairn_plug_describe(cairn_plug_descriptor* descriptor);

/* Routines of other kinds than law. params: in the order of the descriptor.
 * solver: r (dim, contacts) of a frictional contact problem u = W r + q, from the r that is there; W by rows of blocks,
 * columns from 0 and rising, block (dim, dim, blocks) with its row fastest; components N, T (, T). iterations: how many
 * it took. */
typedef void cairn_plug_solve(int32_t dim, int64_t contacts, const int64_t* row_start, const int32_t* column,
                              const double* block, const double* q, const double* mu, double tolerance,
                              int32_t max_iterations, const double* params, double* r, int32_t* iterations);
/* pair: a cairn_pair_contact, see cairn/core.h, without parameters.
 * velocity: of all bodies at the end of the step without contacts, (dofs, bodies), and the diagonal of A^-1; both hold
 * what Cairn found. driven: bit j of a body says that dof j is driven, or NULL. */
typedef void cairn_plug_free_velocity(int32_t dim, int32_t dofs, int64_t bodies, double h, double theta, double time,
                                      const double* params, const int64_t* id, const double* mass,
                                      const double* inertia, const double* position, const double* velocity,
                                      const int8_t* driven, double* velocity_free, double* inverse_mass);
/* force: to be added to force (dofs, bodies), in space axes [N, N m]; time is that of the theta-method. */
typedef void cairn_plug_body_force(int32_t dim, int32_t dofs, int64_t bodies, double time, const double* params,
                                   const int64_t* id, const double* mass, const double* position,
                                   const double* velocity, double* force);
/* body: forces of a mesh of nodes at position (dim, nodes) [m], whose tangent has the entries start (dofs + 1), row:
 * fills calls, which are given with abi, size, dofs and entries, with a context at the start of its history; called
 * once for each simulation. Returns 0; anything else: the mesh or the parameters are none of this code's. */
typedef int32_t cairn_plug_open_body(int32_t dim, int64_t nodes, const double* position, const int64_t* start,
                                     const int32_t* row, const double* params, cairn_body_calls* calls);

#ifdef __cplusplus
}
#endif
#endif
