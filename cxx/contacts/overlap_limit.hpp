// Overlap beyond what a strategy allows.
#pragma once
#include "batch_storage.hpp"
#include "contact_energy.hpp"

namespace cairn {

// Opens contacts whose bodies overlap by more than a share of the smaller one.
class OverlapLimit {
public:
  OverlapLimit(const AssemblyInput& in, const BatchStorage& storage, const ContactSystem& system, ContactEnergy& energy)
      : in_(in), storage_(storage), system_(system), energy_(energy) {}
  void open(const cairn_batch& b, double* bias) const;
  double deepest_drift() const; // overlap beyond the limit over the size of the smaller body
  void count() const;           // work of overlap that is taken back

private:
  bool applies_to(const cairn_batch& b) const;
  double overlap_beyond(std::int64_t i, double& size) const;
  double speed_at(std::int64_t i) const;

  const AssemblyInput& in_;
  const BatchStorage& storage_;
  const ContactSystem& system_;
  ContactEnergy& energy_;
};

} // namespace cairn
