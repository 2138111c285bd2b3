// One exchange a sweep, in the place of one after each colour: each rank sweeps its contacts alone, then changes of
// velocities of shared bodies are added up, and a share of the sweep is taken (Preclik & Ruede 2015). The share is less
// where the error did not fall. Messages are fewer; bits depend on the number of ranks.
#pragma once
#include <limits>
#include <vector>

#include "../base/field.hpp"
#include "cairn/core.h"
#include "colouring.hpp"
#include "exchange.hpp"

namespace cairn {

class SweepExchange {
public:
  // numbers: of a velocity.
  void link(const std::vector<ColourShare>& shares, const Exchange& exchange, int numbers);
  // Velocities of each rank before contacts change them.
  void begin(std::size_t rank, const Array<cairn_record>& record);
  // velocity = that before + share of the changes by all ranks, which are added in the order of ranks.
  void end(const std::vector<Array<cairn_record>*>& records, Exchange& exchange, double share);
  // Share of a sweep that is taken; less where the error did not fall.
  double share() const { return share_; }
  void start() { share_ = first_share, last_ = std::numeric_limits<double>::infinity(); }
  void follow(double square);

private:
  static constexpr double first_share = 0.9;
  struct Followed { // a shared body
    std::int32_t body;
    std::vector<std::int32_t> place, at; // of the links whose ranks share it, rising by rank; where it is in each
    std::size_t before = 0;              // how many of these ranks come before this one
  };
  int numbers_ = 3;
  Links links_;
  std::vector<std::vector<Followed>> followed_;
  std::vector<Array<double>> velocity_; // (numbers, bodies) of each rank
  double share_ = first_share, last_ = std::numeric_limits<double>::infinity();
};

} // namespace cairn
