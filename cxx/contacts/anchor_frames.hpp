// Frames that two bodies carry at an anchored contact.
#pragma once
#include <cstdint>
#include <vector>

#include "anchored_contacts.hpp"
#include "contact_classes.hpp"
#include "midpoint_motion.hpp"
#include "ropes.hpp"

namespace cairn {

// The end on A from that on B [m], and how far A turned from where B has it: a quaternion, in 2D an angle.
struct JointPose {
  double between[3] = {}, turned[4] = {}, far = 0; // far: length of the far part of a rope [m]
  bool turns = false, ahead = false;
};

// Measures the position errors of joints or held bonds between the frames of their bodies.
class AnchorFrames {
public:
  AnchorFrames(const AssemblyInput& in, const ContactClasses& classes, const AnchoredContacts& anchors,
               const Ropes& ropes, const MidpointMotion& motion, const ContactSystem& system)
      : in_(in), classes_(classes), anchors_(anchors), ropes_(ropes), motion_(motion), system_(system) {}
  void find_joints(); // materials of the ends of joints
  bool any_joints() const { return !joint_material_.empty(); }
  bool is_of_joint(int material) const { return any_joints() && joint_material_[std::size_t(material)]; }
  // True if joints hold where the next step detects them.
  bool joints_at_midpoint() const { return in_.at_midpoint() && !in_.options.pose.kernel && any_joints(); }

  void keep_turn(std::int32_t contactor_a, std::int32_t contactor_b, Anchor& made) const;
  void turned_from(const double* A, const double* B, const Anchor& anchor, double found[4]) const; // of rotations
  void pose_of(const cairn_batch& b, int lane, JointPose& pose) const;                             // as bodies stand
  // Errors of n, t, s and about them [m], [rad]; returns the coordinate of the joint.
  double errors(const cairn_batch& b, int lane, const JointPose& pose, double error[6]) const;
  void measure(const cairn_batch& b) const;     // errors of joints, before the law prepares
  void hold_places(const cairn_batch& b) const; // slips and turns of bonds that hold fast

private:
  void turned_from(std::int32_t A, std::int32_t B, const Anchor& anchor, double found[4]) const;

  const AssemblyInput& in_;
  const ContactClasses& classes_;
  const AnchoredContacts& anchors_;
  const Ropes& ropes_;
  const MidpointMotion& motion_;
  const ContactSystem& system_;
  std::vector<std::uint8_t> joint_material_; // per material; empty where there are no joints
};

} // namespace cairn
