// The theta-method as a scheme, for tests that move a body by hand.
#pragma once

#include "cairn/core.h"
#include "cairn/rows.h"

inline cairn_scheme scheme_of(double h, double theta) {
  cairn_scheme scheme;
  cairn_integrator_theta(h, &theta, &scheme);
  return scheme;
}
