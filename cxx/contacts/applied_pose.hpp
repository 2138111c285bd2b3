// The condition that a strategy poses at contacts.
#pragma once
#include "batch_storage.hpp"
#include "contact_matcher.hpp"

namespace cairn {

// Applies the pose of a strategy in place of prepared laws.
class AppliedPose {
public:
  AppliedPose(const AssemblyInput& in, const BatchStorage& storage, const ContactMatcher& matcher,
              const ContactMemory& memory, ContactSystem& system)
      : in_(in), storage_(storage), matcher_(matcher), memory_(memory), system_(system) {}
  void apply(const cairn_batch& b, const double* gap, const double* u, double* compliance) const;
  // Free velocities with the impulses that the pose gives beforehand.
  Velocities free_with_given(const Bodies& bodies);
  void add_given_to_solution() const;

private:
  void swap_in() const;

  const AssemblyInput& in_;
  const BatchStorage& storage_;
  const ContactMatcher& matcher_;
  const ContactMemory& memory_;
  ContactSystem& system_;
  Field<double> velocity_given_, nodes_given_;
};

} // namespace cairn
