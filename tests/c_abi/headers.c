/* The public headers are C, alone and together. */
#include "cairn/cairn.h"
#include "cairn/core.h"
#include "cairn/fluids.h"

int cairn_headers_are_c(void) { return sizeof(cairn_error) > 0; }
