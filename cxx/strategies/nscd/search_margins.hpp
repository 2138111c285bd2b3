// Margins within which pairs are candidates of a step.
#pragma once
#include "../../simulation/simulation.hpp"

namespace cairn {

class SearchMargins {
public:
  // Finds those of pairs that could close within a step at the speeds at hand. Returns the longest way of a body over
  // its size.
  double measure(const Simulation& s, double h);
  Array<double>& each() { return each_; }
  const Array<double>& each() const { return each_; }
  std::int64_t bytes() const { return std::int64_t(each_.capacity() * sizeof(double)); }

private:
  Array<double> each_; // of contactors [m]
};

} // namespace cairn
