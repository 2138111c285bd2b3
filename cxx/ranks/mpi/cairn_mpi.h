/* The calls of MPI that ranks need, in a library of their own (cairn_mpi), which is loaded when it is asked for:
 * whoever has no MPI needs none. Calls give 0, or the code of MPI. */
#ifndef CAIRN_MPI_H
#define CAIRN_MPI_H
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct cairn_mpi_message {
  int32_t rank, tag;
  void* bytes;
  int64_t count;
} cairn_mpi_message;

typedef struct cairn_mpi_calls {
  int32_t version; /* of this table */
  /* communicator: MPI_Fint, less than one can be: MPI_COMM_WORLD; one for all calls of a process. MPI is started if it
   * was not, and ended with the program */
  int32_t (*open)(int64_t communicator, int32_t* rank, int32_t* ranks);
  int32_t (*sum)(int64_t* values, int64_t n);
  int32_t (*largest)(double* values, int64_t n);
  int32_t (*share_counts)(const int64_t* to, int64_t* from); /* one number from each rank to each */
  int32_t (*exchange)(const cairn_mpi_message* out, int64_t n_out, const cairn_mpi_message* in, int64_t n_in);
  /* n = counts[rank], for all; mine NULL: it stands in its place within all */
  int32_t (*gather)(const void* mine, int64_t n, const int64_t* counts, void* all);
  void (*abort)(int32_t code);
  int32_t (*before_end)(void (*call)(void)); /* to be called once before MPI ends, where it may still be used */
} cairn_mpi_calls;

enum { cairn_mpi_version = 3 };
const cairn_mpi_calls* cairn_mpi_table(void);

#ifdef __cplusplus
}
#endif
#endif
