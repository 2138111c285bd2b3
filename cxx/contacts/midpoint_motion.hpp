// Motion of contacts between two detections.
#pragma once
#include "anchored_contacts.hpp"
#include "contact_classes.hpp"
#include "contact_curvature.hpp"
#include "ropes.hpp"

namespace cairn {

// Finds how the relative velocity of a contact changes up to the midpoint of the motion to the next detection.
class MidpointMotion {
public:
  MidpointMotion(const AssemblyInput& in, const ContactClasses& classes, const AnchoredContacts& anchors,
                 const ContactCurvature& curvature, const Ropes& ropes, const ContactSystem& system)
      : in_(in), classes_(classes), anchors_(anchors), curvature_(curvature), ropes_(ropes), system_(system) {}
  // Changes for all contacts of an unpacked batch, by components [m/s]; false if all are zero.
  bool fill(const cairn_batch& b, double* change) const;
  bool applies_to_balls() const;
  // True for a sound bond that holds along the tangents as well: its errors there add up from step to step.
  bool is_sound_bond(const cairn_batch& b, int lane) const;
  void change_beside_mesh(const cairn_batch& b, int lane, double out[3]) const;
  bool rocks_on_mesh(const cairn_batch& b, int lane) const;

private:
  void change_of(const cairn_batch& b, int lane, double out[3]) const;
  void change_of_surfaces(const cairn_batch& b, int lane, double out[3]) const;
  void change_of_carried(const cairn_batch& b, int lane, double out[3]) const;
  void change_of_anchored(const cairn_batch& b, int lane, double out[3]) const;
  void turn_of_bond(const cairn_batch& b, int lane, double out[3]) const;

  const AssemblyInput& in_;
  const ContactClasses& classes_;
  const AnchoredContacts& anchors_;
  const ContactCurvature& curvature_;
  const Ropes& ropes_;
  const ContactSystem& system_;
};

} // namespace cairn
