// Warm start of contacts.
#pragma once
#include "contact_matcher.hpp"
#include "midpoint_motion.hpp"
#include "new_bonds.hpp"

namespace cairn {

// Starts the impulses and internal variables of contacts from those of the last step.
class WarmStart {
public:
  WarmStart(const AssemblyInput& in, const ContactMatcher& matcher, const MidpointMotion& motion,
            const NewBonds& new_bonds, const ContactMemory& memory, const ContactSystem& system)
      : in_(in), matcher_(matcher), motion_(motion), new_bonds_(new_bonds), memory_(memory), system_(system) {}
  void fill(cairn_batch& b) const;
  template <int d>
  void fill_packed(cairn_batch& b) const;

private:
  void fill_states(const cairn_batch& b) const;
  void lay_into_plane(const cairn_batch& b, int lane, std::int32_t where, double x[3], double t[2]) const;
  double twist_since_last(const cairn_batch& b, int lane, const double* normal) const;

  const AssemblyInput& in_;
  const ContactMatcher& matcher_;
  const MidpointMotion& motion_;
  const NewBonds& new_bonds_;
  const ContactMemory& memory_;
  const ContactSystem& system_;
};

} // namespace cairn
