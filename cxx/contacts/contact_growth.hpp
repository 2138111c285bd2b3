// Contacts of bodies that grow.
#pragma once
#include "batch_storage.hpp"
#include "contact_energy.hpp"
#include "contact_matcher.hpp"

namespace cairn {

// Parts bodies that overlap because they grew.
class ContactGrowth {
public:
  ContactGrowth(const AssemblyInput& in, const BatchStorage& storage, const ContactMatcher& matcher,
                const ContactMemory& memory, const ContactSystem& system, ContactEnergy& energy)
      : in_(in), storage_(storage), matcher_(matcher), memory_(memory), system_(system), energy_(energy) {}
  void add(const cairn_batch& b, const double* gap, double* bias) const;
  void count() const; // its work, which contacts do not make from nothing
  // Work that the bodies of a contact which grew give it [J].
  double work_at(const cairn_batch& b, int lane) const;

private:
  double grown_at(const cairn_batch& b, int lane, const Field<double>& stretch, const Field<double>& bend) const;

  const AssemblyInput& in_;
  const BatchStorage& storage_;
  const ContactMatcher& matcher_;
  const ContactMemory& memory_;
  const ContactSystem& system_;
  ContactEnergy& energy_;
};

} // namespace cairn
