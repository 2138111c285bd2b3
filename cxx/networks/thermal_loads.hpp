// Temperatures that mechanics see in a step, and the loads of meshes by them.
#pragma once
#include <vector>

#include "network_input.hpp"

namespace cairn {

class Simulation;

class ThermalLoads {
public:
  const double* seen(const double* at_begin) const { return expected_.empty() ? at_begin : expected_.data(); }
  void expect(std::vector<double> end) { expected_ = std::move(end); }
  void load_meshes(Simulation& s, const NetworkInput& in);
  // NetworkReport::coupling, by temperatures at both ends of the step.
  double coupling(const Simulation& s, const NetworkInput& in, const std::vector<double>& begin,
                  const std::vector<double>& end) const;

private:
  std::vector<double> expected_; // at the end of the step by its last pass; empty: none
  std::vector<double> room_;
};

} // namespace cairn
