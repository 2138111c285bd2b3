/* One scene over several ranks: a part of the C API, to be included beside cairn/cairn.h.
 *
 * Every process makes the same scene and simulation, then gives it to ranks before its first step. All calls that step,
 * change, gather, write or read files are made by all processes: one that another process does not make is refused on
 * all of them. Bodies and contacts may be read by one process alone. See docs/machines.md. */
#ifndef CAIRN_RANKS_H
#define CAIRN_RANKS_H
#include <stdint.h>

#include "cairn/cairn.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Over the ranks of a communicator of MPI, each a process; communicator: MPI_Comm_c2f(comm), MPI_Fint as Fortran has
 * it. library: path of libcairn_mpi.so, NULL or "": as the dynamic linker finds it. MPI is started if it was not.
 * once_a_sweep 0: velocities go between ranks after each colour of a sweep, with the same bits for every number of
 * ranks; 1: once a sweep, which is faster, and bits depend on the number. */
int32_t cairn_simulation_over_mpi(cairn_simulation* simulation, int32_t communicator, const char* library,
                                  int32_t once_a_sweep, cairn_error* error);
/* Over ranks that take turns in this process, as tests do. */
int32_t cairn_simulation_over_ranks(cairn_simulation* simulation, int32_t ranks, int32_t once_a_sweep,
                                    cairn_error* error);
/* The rank of this process, the first of those that it has, and their number; each may be NULL. */
int32_t cairn_simulation_ranks(cairn_simulation* simulation, int32_t* rank, int32_t* ranks, cairn_error* error);
/* Contacts of all ranks are gathered at once, in place of when they are first read after a step. */
int32_t cairn_simulation_gather(cairn_simulation* simulation, cairn_error* error);

#ifdef __cplusplus
}
#endif
#endif
