// Growth of rigid bodies with their temperature: lengths by a factor, shapes by a gradient.
#pragma once
#include <vector>

#include "network_unknowns.hpp"

namespace cairn {

class Scene;
struct Contactors;

class ThermalGrowth {
public:
  explicit ThermalGrowth(const NetworkUnknowns& rows) : rows_(rows) {}
  // Contactors that grow get a hull of their own each.
  void separate_hulls(Scene& scene, const NetworkInput& in) const;
  // Shapes as they came in: a gradient's bend is always counted from there, so that it leaves when the gradient goes.
  void remember_shapes(const Scene& scene, const ThermalGrowth* before);
  // Temperatures of the unknowns at both ends of the step [K].
  void grow(Simulation& s, const NetworkInput& in, const std::vector<double>& begin, const std::vector<double>& end);

private:
  // Of the step at hand.
  struct Rise {
    const NetworkInput& in;
    const std::vector<double>&begin, &end;
  };
  const NetworkMaterial& material_at(const Scene& scene, const NetworkInput& in, std::int64_t contactor) const;
  bool grows(const Scene& scene, const NetworkInput& in, std::int64_t contactor) const;
  double factor_of(const Simulation& s, const Rise& rise, std::int32_t contactor) const;
  void bend(Simulation& s, const NetworkInput& in);
  void bend_hull(Contactors& k, std::int64_t contactor, double factor, double expansion, const double* from,
                 const double* to) const;
  void move_anchors(Simulation& s, const Rise& rise) const;

  const NetworkUnknowns& rows_;
  std::vector<double> vertex_, offset_; // of hulls and contactors before they bend [m]
  std::vector<double> gradient_;        // (dim, bodies) at the end of the step [K/m]
};

} // namespace cairn
