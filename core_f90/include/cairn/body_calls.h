/* A deformable body whose forces another finite element code finds: what that code hands to Cairn, by cairn/cairn.h or
 * as a routine of a library (cairn/plug.h). */
#ifndef CAIRN_BODY_CALLS_H
#define CAIRN_BODY_CALLS_H
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { CAIRN_BODY_CALLS_ABI = 1 };

/* Internal forces of the nodes [N], which the body opposes to its deformation, at displacements [m] and velocities
 * [m/s] (dofs), dof dim i + k of node i along axis k. What is kept between steps is that of the last commit, whatever
 * was asked since; the last call before a commit is of where the step ended. time: there [s]; step: its length [s].
 * tangent (entries): derivative of the forces by the displacements on the pattern that was given [N/m], NULL where it
 * is not asked for; velocities change with displacements by rate [1/s], so that it is K + rate C of forces with
 * derivatives K and C. energy: stored there, dissipated: in the step until there [J], left alone if not known.
 * Returns 0; anything else: there are no forces there, and Cairn tries a smaller change, or gives up the step. */
typedef int32_t cairn_body_forces(void* context, int64_t dofs, int64_t entries, double time, double step, double rate,
                                  const double* displacement, const double* velocity, double* force, double* tangent,
                                  double* energy, double* dissipated);
typedef int32_t cairn_body_history(void* context); /* returns 0, anything else: failed */
typedef int64_t cairn_body_state_size(void* context);
typedef int32_t cairn_body_save(void* context, int64_t size, double* state);
typedef int32_t cairn_body_load(void* context, int64_t size, const double* state);
typedef int32_t cairn_body_create(void* context, void** another);
typedef void cairn_body_destroy(void* context);
typedef const char* cairn_body_complaint(void* context);

/* Given zeroed but for abi and size. One thread calls at a time. */
typedef struct cairn_body_calls {
  int32_t abi;               /* CAIRN_BODY_CALLS_ABI of the header that the code was compiled with */
  int32_t size;              /* sizeof(cairn_body_calls) */
  int32_t gives_energy;      /* 1: forces fills energy */
  int32_t gives_dissipation; /* 1: forces fills dissipated; of a code that spends nothing it is 0 */
  int64_t dofs, entries;     /* as the code knows them: refused where the mesh or its pattern has others */
  void* context;             /* handed to each call */
  cairn_body_forces* forces;
  cairn_body_history* commit;   /* the step is accepted: where it ended, the next begins; NULL: nothing is kept */
  cairn_body_history* rollback; /* the step was undone; may be NULL */
  /* What is kept, as numbers for a checkpoint; all NULL: a body with a commit has no checkpoint. size may change. */
  cairn_body_state_size* state_size;
  cairn_body_save* save;
  cairn_body_load* load;
  cairn_body_create* create;       /* a context at the start of its history for another simulation; may be NULL */
  cairn_body_destroy* destroy;     /* of a context that create or a library made; may be NULL */
  cairn_body_complaint* complaint; /* why the last call failed, or NULL; may be NULL */
} cairn_body_calls;

#ifdef __cplusplus
}
#endif
#endif
