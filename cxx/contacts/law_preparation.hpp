// Laws of the contacts of a batch.
#pragma once
#include "anchor_frames.hpp"
#include "applied_pose.hpp"
#include "packed_batches.hpp"

namespace cairn {

// Prepares the law of a batch: its bias, its compliance and the Delassus blocks that it is solved with.
class LawPreparation {
public:
  LawPreparation(const AssemblyInput& in, const ContactClasses& classes, const BatchStorage& storage,
                 const ContactAreas& areas, const ContactCurvature& curvature, const MidpointMotion& motion,
                 const AnchoredContacts& anchors, const AnchorFrames& frames, const ContactGrowth& growth,
                 const AppliedPose& pose, const PackedBatches& packs, PluggedLawChecks& plugged,
                 const ContactSystem& system)
      : in_(in), classes_(classes), storage_(storage), areas_(areas), curvature_(curvature), motion_(motion),
        anchors_(anchors), frames_(frames), growth_(growth), pose_(pose), packs_(packs), plugged_(plugged),
        system_(system) {}
  void fill(const cairn_schedule& schedule, cairn_batch& b, int thread) const;
  static void forget_open(cairn_batch& b);

private:
  double free_opening(const cairn_batch& b, int lane, double begin) const;
  bool wants_area(const cairn_batch& b, int lane) const;

  const AssemblyInput& in_;
  const ContactClasses& classes_;
  const BatchStorage& storage_;
  const ContactAreas& areas_;
  const ContactCurvature& curvature_;
  const MidpointMotion& motion_;
  const AnchoredContacts& anchors_;
  const AnchorFrames& frames_;
  const ContactGrowth& growth_;
  const AppliedPose& pose_;
  const PackedBatches& packs_;
  PluggedLawChecks& plugged_;
  const ContactSystem& system_;
};

} // namespace cairn
