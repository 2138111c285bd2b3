// Batches of two round bodies that move.
#pragma once
#include "contact_growth.hpp"
#include "plugged_laws.hpp"
#include "warm_start.hpp"

namespace cairn {

// Fills packed batches, all numbers of a contact at once.
class PackedBatches {
public:
  PackedBatches(const AssemblyInput& in, const ContactClasses& classes, const BatchStorage& storage,
                const ContactAreas& areas, const ContactCurvature& curvature, const MidpointMotion& motion,
                const ContactGrowth& growth, const WarmStart& warm_start, PluggedLawChecks& plugged,
                const ContactSystem& system)
      : in_(in), classes_(classes), storage_(storage), areas_(areas), curvature_(curvature), motion_(motion),
        growth_(growth), warm_start_(warm_start), plugged_(plugged), system_(system) {}
  template <int d>
  void fill(cairn_batch& b, double& deepest) const;
  // From columns to a pack, in the same memory: for this step the law is as good as one with a bias along the normal
  // alone.
  template <int d>
  void pack_columns(cairn_batch& b) const;

private:
  void keep_for_commit(const cairn_batch& b, const double* change, int d) const;

  const AssemblyInput& in_;
  const ContactClasses& classes_;
  const BatchStorage& storage_;
  const ContactAreas& areas_;
  const ContactCurvature& curvature_;
  const MidpointMotion& motion_;
  const ContactGrowth& growth_;
  const WarmStart& warm_start_;
  PluggedLawChecks& plugged_;
  const ContactSystem& system_;
};

} // namespace cairn
