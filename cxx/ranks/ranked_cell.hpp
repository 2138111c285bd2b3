// A periodic cell over ranks, whose rates and stress follow the impulses: as in solvers/sweeps/moving_cell.hpp, where
// the equations are, with exact sums over the contacts of all ranks, so that all have the same rates.
#pragma once
#include <cstdint>
#include <vector>

#include "../solvers/sweeps/moving_cell.hpp"
#include "exact_sum.hpp"
#include "exchange.hpp"
#include "part.hpp"

namespace cairn {

class RankedCell {
public:
  // Without it the rates of the cell stay as they are, and there is no stress.
  void begin(const std::vector<Part>& parts, double h, Exchange& exchange);
  bool driven() const { return driven_; }
  bool follows() const { return follows_; } // a stress
  void follow(std::vector<Part>& parts, Exchange& exchange);
  void end(std::vector<Part>& parts) const;

private:
  bool driven_ = false, follows_ = false;
  std::vector<std::vector<AcrossBoundary>> places_; // of each part
  double rate_[9] = {}, free_[9] = {}, inverse_[9] = {}, sum_[9] = {};
  double over_ = 0; // 1/(h V)
  int dim_ = 2;
};

} // namespace cairn
