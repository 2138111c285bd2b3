// Brittle joints at several points of one face.
#pragma once
#include <cstdint>
#include <vector>

#include "contact_classes.hpp"

namespace cairn {

// Shares the force and moment of a face among its points, as an elastic layer between stiff faces would.
class BrittleFaces {
public:
  BrittleFaces(const AssemblyInput& in, const ContactClasses& classes, const ContactSystem& system)
      : in_(in), classes_(classes), system_(system) {}
  void share();
  // Impulses (3) by which the joint at a place is judged, the first NaN for others; null: there are none.
  const double* at_place(std::int64_t place) const {
    return shared_.empty() ? nullptr : &shared_[3 * std::size_t(place)];
  }

private:
  struct JointPoint {
    std::int32_t body_a, body_b, image, entry, candidate, batch, lane;
  };
  bool on_one_face(const JointPoint& one, const JointPoint& other) const;
  void share_face(const std::vector<JointPoint>& face);

  const AssemblyInput& in_;
  const ContactClasses& classes_;
  const ContactSystem& system_;
  std::vector<JointPoint> points_;
  std::vector<double> shared_; // (3, places)
};

} // namespace cairn
