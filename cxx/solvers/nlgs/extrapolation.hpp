// Criteria for the extrapolation of sweeps.
#pragma once
#include "../sweeps/contact_system.hpp"

namespace cairn {

struct ExtrapolationGrounds {
  double mass_ratio = 1;     // the largest of moving bodies
  double faced_share = 0;    // of the contacts, between faces or of meshes that are swept in turn
  bool extrapolates() const; // whether they are, unless the solver forbids it
};
ExtrapolationGrounds extrapolation_grounds(const ContactSystem& system);

} // namespace cairn
