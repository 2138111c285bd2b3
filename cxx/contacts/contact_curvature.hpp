// How the surfaces of two bodies are curved where they touch.
#pragma once
#include "../contactors/shape_surface.hpp"
#include "contact_classes.hpp"

namespace cairn {

struct SurfacePair {
  SurfaceCurvature a, b;
  double size = 0;    // of the smaller shape that bodies are made of [m]
  bool known = false; // of both shapes
  // Radii of rolling, 1/(Ka + Kb) [m]: 0 along directions sharp on either side, and along those flat on both, where
  // contact points carry moments by themselves; false where the sum is hollow.
  bool radii(double p[3]) const;
};

// Finds curvatures of the surfaces of a contact.
class ContactCurvature {
public:
  ContactCurvature(const AssemblyInput& in, const ContactClasses& classes, const ContactSystem& system)
      : in_(in), classes_(classes), system_(system) {}
  // Effective radius [m]: that of the ball against flat sides, more in a hollow. Bodies with corners count by the
  // radius of their bounding ball, as a size where no ball is there.
  double effective_radius(std::int64_t i) const;
  SurfacePair of(std::int64_t i, const double axes[3][3]) const;
  // Effective radius and radii about the axes t and s of a rolling contact, in columns of its geometry.
  void rolling_radii(const cairn_batch& b, int lane, double* geometry) const;

private:
  bool surface_at(std::int64_t i, int side, const double axes[3][3], SurfaceCurvature& out) const;

  const AssemblyInput& in_;
  const ContactClasses& classes_;
  const ContactSystem& system_;
};

} // namespace cairn
