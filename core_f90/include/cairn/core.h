/* Cairn's numerical kernels, as C sees them. Written in Fortran (core_f90), stateless: they allocate, print and open nothing.
 * Arrays are in Fortran order (first index fastest); sizes and units stand at the Fortran declarations.
 * Every prototype is compiled against the Fortran itself at build time. */
#ifndef CAIRN_CORE_H
#define CAIRN_CORE_H
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif

/* What a kernel reports when it was called wrongly; owned by the caller, code 0 is success. */
typedef struct cairn_error {
  int32_t code;
  int64_t item;
  char message[256];
} cairn_error;

/* ------------------------------------------------------------------ contact laws */
/* What a law may ask about the step beside its own contact. Fields are added at the end only. */
typedef struct cairn_law_context {
  double h;                /* step [s] */
  double theta;            /* of the theta-method */
  const double* geometry;  /* (n, 3) contact area [m2], effective radius [m], effective mass [kg]; NULL if no law of the scene asks */
  const double* fields;    /* (n, 4) temperatures and potentials of both sides; NULL unless the scene has them */
} cairn_law_context;

/* c = local components of the law in this dimension, p = parameters, s = state variables.
 * bias (n, c) [m/s] is added to the relative velocity; compliance (n, c) [1/kg] to the diagonal of W; mu (n) is the friction of the cone. */
typedef void cairn_law_prepare(int32_t n, const cairn_law_context* context, const double* gap, const double* u_begin,
                               const double* params, double* state, double* bias, double* compliance, double* mu);
/* w is (n, c, c), u_free (n, c), bias (n, c), params (n, p), state (n, s); r (n, c) out; status (n) out: see cairn_contact_status. */
typedef void cairn_law_solve(int32_t n, const double* w, const double* u_free, const double* bias, const double* params,
                             const double* state, double* r, int32_t* status);
typedef void cairn_law_commit(int32_t n, const cairn_law_context* context, const double* gap, const double* u, const double* r,
                              const double* params, double* state);
enum cairn_contact_status { cairn_open = 0, cairn_stick = 1, cairn_slip = 2, cairn_bonded = 3 };

#ifdef __cplusplus
}
#endif
#endif
