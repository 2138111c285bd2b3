// Projection of bodies onto the constraints of joints that came in.
#pragma once
#include <vector>

#include "joint_drift.hpp"

namespace cairn {

// Moves bodies to where joints that came in hold them.
class JointProjection {
public:
  JointProjection(const AssemblyInput& in, const ContactClasses& classes, const AnchoredContacts& anchors,
                  const AnchorFrames& frames, const JointDrift& drift, const ContactMemory& memory,
                  ContactSystem& system)
      : in_(in), classes_(classes), anchors_(anchors), frames_(frames), drift_(drift), memory_(memory),
        system_(system) {}
  // True if joints came in, or the step length changed.
  bool is_due() const;
  // Selects the joints to project, as assembled, before bodies are displaced.
  void choose(const Bodies& bodies);
  // Largest position error of these joints, as assembled, over that of rounding; 0 if below 1.
  double violation() const;
  // Velocities (3 | 6, bodies) that undo it in a step, the smallest in the metric of mass. False: there are none, or
  // they are more than those of the bodies. Impulses at hand are lost.
  bool find_velocities(const Bodies& bodies, Array<double>& velocity);

private:
  bool swings_alike(const cairn_batch& b, int lane) const;
  double off_limits(const cairn_batch& b, int lane, double along) const;
  bool is_chosen(const cairn_batch& b, int lane) const;

  const AssemblyInput& in_;
  const ContactClasses& classes_;
  const AnchoredContacts& anchors_;
  const AnchorFrames& frames_;
  const JointDrift& drift_;
  const ContactMemory& memory_;
  ContactSystem& system_;
  std::vector<char> chosen_; // by number of the anchor
};

} // namespace cairn
