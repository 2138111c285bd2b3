// Drift of joints up to the next detection.
#pragma once
#include <vector>

#include "anchor_frames.hpp"
#include "joint_miss.hpp"

namespace cairn {

// Corrects the position errors that joints would have at the next detection.
class JointDrift {
public:
  JointDrift(const AssemblyInput& in, const ContactClasses& classes, const AnchoredContacts& anchors,
             const AnchorFrames& frames, const Ropes& ropes, ContactSystem& system)
      : in_(in), classes_(classes), anchors_(anchors), frames_(frames), ropes_(ropes), system_(system) {}
  // Once a solution is there; small: no more than `least` of the speed of joints.
  JointMiss miss(const Bodies& bodies, double least);
  // Stores the errors that miss() found last and the biases for the next solution; then sets biases that correct a
  // share of these errors.
  void keep();
  void correct(double share);
  bool ease(const Bodies& bodies, bool settled);

  // Pose after a flight of that time, at the velocities of the records.
  void pose_ahead(const cairn_batch& b, int lane, double time, JointPose& pose) const;
  // How far a coordinate is above its highest place, below 0: below its lowest [m, rad].
  double beyond_limits(const cairn_batch& b, int lane, double along) const;
  double length_of_joint(const cairn_batch& b, int lane, const Anchor& anchor) const;

private:
  struct Missed { // a blocked component
    std::size_t batch;
    int lane, component;
    double error, bias; // [m or rad], [m/s or rad/s]
  };
  struct Speeds {
    double fastest = 0, rounding = 0; // [m/s]
  };
  void velocity_of_mapped(const cairn_batch& b, bool of_b, int lane, double out[3]) const;
  void velocity_of_end(const cairn_batch& b, bool of_b, int lane, double out[6]) const;
  bool bends(const cairn_batch& b, int lane) const;
  JointMiss largest_miss(double least);
  void add_speeds(const cairn_batch& b, int lane, Speeds& speeds) const;
  double* bias_of(const Missed& one) const;
  double far_ahead(std::int64_t i, double time) const;
  double swing_of(const cairn_batch& b, int lane, double length) const;
  bool any_spans() const;
  bool ease();
  double flown(const cairn_batch& b, int lane) const;
  double missed_more(const cairn_batch& b, int lane) const;

  const AssemblyInput& in_;
  const ContactClasses& classes_;
  const AnchoredContacts& anchors_;
  const AnchorFrames& frames_;
  const Ropes& ropes_;
  ContactSystem& system_;
  std::vector<Missed> missed_, kept_; // by the last velocities, and those that keep() stored
};

} // namespace cairn
