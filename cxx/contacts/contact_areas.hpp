// Areas of contacts.
#pragma once
#include "anchored_contacts.hpp"
#include "contact_classes.hpp"
#include "contact_curvature.hpp"
#include "face_overlap.hpp"

namespace cairn {

// Finds the area that a contact stands for.
class ContactAreas {
public:
  ContactAreas(const AssemblyInput& in, const ContactClasses& classes, const AnchoredContacts& anchors,
               const ContactCurvature& curvature)
      : in_(in), classes_(classes), anchors_(anchors), curvature_(curvature) {}
  double area_of(std::int64_t i) const; // [m2], in 2D [m]

private:
  double cap_radius(std::int64_t i) const;
  double face_area(std::int64_t i) const;
  double shared_face(std::int64_t i) const;

  const AssemblyInput& in_;
  const ContactClasses& classes_;
  const AnchoredContacts& anchors_;
  const ContactCurvature& curvature_;
};

class AnchorFrames;

// Finds the tributary areas of meshes, unless they are there.
void find_tributary_areas(const AssemblyInput& in, AnchorFrames& frames);

// Outline of the face of a contactor that looks along sense times a normal, projected across it; false where no face
// lies flat there.
bool see_face(const AssemblyInput& in, const FaceView& from, std::int32_t contactor, int sense, const double* shift,
              FaceOutline& face);

} // namespace cairn
