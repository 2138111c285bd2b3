// Newton's method over bodies by proximal points: contacts give way by a share of their own block.
#pragma once
#include <functional>
#include <vector>

#include "law_tangent.hpp"
#include "solid_self_stress.hpp"

namespace cairn {

class ProximalPoints {
public:
  ProximalPoints(SolidSystem& solid, LawTangent& tangent, SelfStress& self_stress)
      : solid_(solid), tangent_(tangent), self_stress_(self_stress) {}
  // Keeps the best impulses, whose error is then in error_square. Returns how many passes led to them, 0: none did.
  int improve(double& error_square, double wanted_square, const std::function<double()>& measure);

private:
  void begin(double share);
  int find(double share, int most);
  LawTangent::Question question(std::size_t batch, const double* velocity) const;
  void linearise();
  double slope(double step);
  double step_length(bool cut);
  void velocities_of_contacts();

  SolidSystem& solid_;
  LawTangent& tangent_;
  SelfStress& self_stress_;
  struct Place {
    std::size_t contact = 0, value = 0, block = 0;
  };
  std::vector<Place> places_; // where the columns of each batch begin, dummies counted
  std::vector<double> block_, free_, begun_, moved_, moving_, bias_, params_; // columns
  std::vector<double> none_;                                                  // zeros in the place of a block
  std::vector<double> way_, mass_way_, mass_step_;                            // of unknowns
  double speed_ = 0;                                                          // the largest where it begins
};

} // namespace cairn
