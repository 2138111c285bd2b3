// Swing of joints under tension.
#pragma once
#include <vector>

#include "../solvers/solve_report.hpp"
#include "anchor_frames.hpp"

namespace cairn {

// Finds the geometric stiffness that the loads of joints give to their bodies.
class JointSwing {
public:
  JointSwing(const AssemblyInput& in, const ContactClasses& classes, const AnchoredContacts& anchors,
             const AnchorFrames& frames, const Ropes& ropes, const ContactSystem& system)
      : in_(in), classes_(classes), anchors_(anchors), frames_(frames), ropes_(ropes), system_(system) {}
  // Loads by the impulses at hand, in the order of bodies.
  void loads(std::vector<JointLoad>& loads) const;
  // Largest square of step times rate at which bars and ropes swing across their axis, beyond the implicit part.
  double swing_across() const;
  void fill(const cairn_batch& b) const; // implicit part of bars and ropes, by the impulses at hand

private:
  double gives_across(const cairn_batch& b, int lane) const;
  double length_across(const cairn_batch& b, int lane) const;

  const AssemblyInput& in_;
  const ContactClasses& classes_;
  const AnchoredContacts& anchors_;
  const AnchorFrames& frames_;
  const Ropes& ropes_;
  const ContactSystem& system_;
};

} // namespace cairn
