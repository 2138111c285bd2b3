// Numbers of all batches.
#pragma once
#include "batch_geometry.hpp"
#include "joint_swing.hpp"
#include "law_preparation.hpp"
#include "overlap_limit.hpp"

namespace cairn {

// Runs the stages that fill a batch, on all threads.
class BatchAssembly {
public:
  BatchAssembly(const AssemblyInput& in, const ContactClasses& classes, const Ropes& ropes, const JointSwing& swing,
                const WarmStart& warm_start, const OverlapLimit& overlap, const PackedBatches& packs,
                const LawPreparation& preparation, PluggedLawChecks& plugged, ContactSystem& system)
      : in_(in), classes_(classes), ropes_(ropes), swing_(swing), warm_start_(warm_start), overlap_(overlap),
        packs_(packs), preparation_(preparation), plugged_(plugged), system_(system), geometry_(in, system) {}
  void fill();

private:
  void fill_batch(int which, int thread, double& deepest);

  const AssemblyInput& in_;
  const ContactClasses& classes_;
  const Ropes& ropes_;
  const JointSwing& swing_;
  const WarmStart& warm_start_;
  const OverlapLimit& overlap_;
  const PackedBatches& packs_;
  const LawPreparation& preparation_;
  PluggedLawChecks& plugged_;
  ContactSystem& system_;
  BatchGeometry geometry_;
};

} // namespace cairn
