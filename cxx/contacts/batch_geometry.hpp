// Frames of the contacts of a batch.
#pragma once
#include "assembly_input.hpp"

namespace cairn {

// Fills the frames of contacts, with the levers or nodes by which their sides move.
class BatchGeometry {
public:
  BatchGeometry(const AssemblyInput& in, const ContactSystem& system) : in_(in), system_(system) {}
  void fill(cairn_batch& b, double& deepest) const;

private:
  void fill_mapping(cairn_batch& b, int side, int lane, std::int64_t candidate) const;
  void fill_spin(const cairn_batch& b, int side, int lane, std::int64_t candidate, const Mapping& mapping) const;

  const AssemblyInput& in_;
  const ContactSystem& system_;
};

} // namespace cairn
