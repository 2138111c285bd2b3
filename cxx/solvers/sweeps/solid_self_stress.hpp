// Self-stress of closed loops of bonds.
#pragma once
#include <functional>
#include <vector>

#include "law_tangent.hpp"

namespace cairn {

class SelfStress {
public:
  SelfStress(SolidSystem& solid, LawTangent& tangent) : solid_(solid), tangent_(tangent) {}
  // Size of the impulses before self-stress was last dropped.
  double size() const { return size_; }
  // The smallest impulses of bonds with the same momentum of bodies.
  void drop();
  // The same, if their error is within the tolerance.
  void drop_within(double tolerance, const std::function<double()>& measure);
  // Limits biases of bonds in rings to those that some velocities can satisfy.
  void limit_biases();

private:
  using Contact = SolidSystem::Contact;
  bool bonds_close_rings() const;
  bool find_smallest();
  void velocities_at_contacts(std::vector<double>& u) const;
  void answers_to(const std::vector<double>& u, std::vector<double>& impulse) const;
  void answer_by_blocks(double share);

  SolidSystem& solid_;
  LawTangent& tangent_;
  double size_ = 0;
};

} // namespace cairn
