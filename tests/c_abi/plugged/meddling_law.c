/* A contact law of a shared library that calls what its program gave it, in each of its calls. */
#include <string.h>

#include "cairn/plug.h"

void (*meddle)(void) = 0;

static void prepare(int32_t n, int32_t c, const cairn_law_context* context, const double* gap, const double* u_begin,
                    const double* params, double* state, double* bias, double* compliance, double* mu) {
  (void)u_begin, (void)state;
  if (meddle) meddle();
  memset(bias, 0, sizeof(double) * (size_t)(n * c));
  memset(compliance, 0, sizeof(double) * (size_t)(n * c));
  for (int32_t i = 0; i < n; ++i) {
    bias[i] = gap[i] > 0 ? gap[i] / context->h : 0;
    mu[i] = params[i];
  }
}

void cairn_describe_meddling(cairn_plug_descriptor* descriptor) {
  descriptor->abi = CAIRN_PLUG_ABI;
  descriptor->size = sizeof *descriptor;
  descriptor->context_size = sizeof(cairn_law_context);
  descriptor->kind = cairn_plug_law;
  descriptor->components2 = 2;
  descriptor->components3 = 3;
  descriptor->normal_bias = 1;
  strcpy(descriptor->name, "meddling");
  strcpy(descriptor->parameters, "mu::0:inf");
  descriptor->prepare = prepare;
}
