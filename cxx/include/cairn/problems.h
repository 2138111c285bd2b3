/* Frictional contact problems on their own: a part of the C API, cairn/cairn.h.
 *
 * u = W r + q, and at each contact, with u_N, r_N along its normal and u_T, r_T along its tangents,
 *   0 <= r_N perpendicular to u_N + mu |u_T| >= 0 with r in Coulomb's cone, r_T against u_T where friction is spent.
 * Contact-major: r, u and q (dim, n), normal first. */
#ifndef CAIRN_PROBLEMS_H
#define CAIRN_PROBLEMS_H
#include <stdint.h>

#include "cairn/error.h"

#ifdef __cplusplus
extern "C" {
#endif

enum cairn_problem_status {
  cairn_problem_converged = 0,
  cairn_problem_iteration_limit = 1,
  cairn_problem_time_limit = 2,
  cairn_problem_diverged = 3,
  cairn_problem_stalled = 4,
  cairn_problem_no_solution = 5,
  cairn_problem_memory_limit = 6
};

typedef struct cairn_problem cairn_problem;

typedef struct cairn_problem_report {
  int32_t status;          /* see cairn_problem_status */
  int64_t iterations;      /* of the solver */
  int64_t worst_contact;   /* -1: none */
  double error;            /* of the impulses given back: natural map in the energy norm [-] */
  double worst_error;      /* of one contact, on its own scale [-] */
  double penetration_rate; /* largest -u_N / largest |q| of a contact [-] */
  double cone_distance;    /* of impulses outside their cone / impulse [-] */
  double energy_created;   /* by contacts that gave energy / energy in play [-] */
  double cpu_seconds;
  char solver[64]; /* that gave the answer: "auto" names its last choice */
  char hint[256];  /* what to do where it did not converge, else empty */
} cairn_problem_report;

/* W in blocks by rows: those of row i from row_start[i] on, row_start (n + 1), columns (blocks) rising, the diagonal
 * block of each row there; block (dim, dim, blocks) [1/kg], the row of a block fastest. q (dim, n) [m/s], mu (n). */
int32_t cairn_problem_create(int32_t dim, int64_t n, const int64_t* row_start, const int32_t* column,
                             const double* block, const double* q, const double* mu, cairn_problem** problem,
                             cairn_error* error);
/* The local problem of a file in the layout of FCLIB, without compression; cairn.problems in Python reads all others.
 */
int32_t cairn_problem_read(const char* path, cairn_problem** problem, cairn_error* error);
void cairn_problem_destroy(cairn_problem* problem); /* NULL is allowed */
int32_t cairn_problem_dimension(const cairn_problem* problem);
int64_t cairn_problem_contacts(const cairn_problem* problem);
/* solver: a row of solvers.def ("nlgs", "ppa_newton", "interior_point", ...) or "auto". impulse (dim, n): the first
 * guess if warm_start is not 0; then what was found. tolerance: on the error, 0 to 1. report may be NULL. */
int32_t cairn_problem_solve(const cairn_problem* problem, const char* solver, double tolerance, int32_t max_iterations,
                            int32_t warm_start, double* impulse, cairn_problem_report* report, cairn_error* error);
/* The figures of impulses (dim, n) of any origin. */
int32_t cairn_problem_measure(const cairn_problem* problem, const double* impulse, cairn_problem_report* report,
                              cairn_error* error);

#ifdef __cplusplus
}
#endif
#endif
