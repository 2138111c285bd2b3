// Pairs that laws keep, which begin where bodies stand when they come in, before anything moves.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "step_scheme.hpp"

namespace cairn {

class BondSearch {
public:
  // Bonds contactors that came in since the last step. free_velocity: finds it, since detection leaves out pairs that
  // nothing moves; contacts that were known are no more.
  void make(Simulation& s, const StepScheme& step, const std::function<void()>& free_velocity);

private:
  void find(Simulation& s, const StepScheme& step, const std::function<void()>& free_velocity);
  Array<double> margins_; // of contactors [m]
  std::string unjoined_;  // hint on joints without a partner
  std::int64_t unjoined_step_ = -1;
};

// Contacts of bonds, at the points that hold them.
class BondGaps {
public:
  void measure(Simulation& s);

private:
  std::vector<std::int32_t> contactors_; // of the keys of the memory, two each
};

// Converts memory read from old files, in which the state of a bond was its gap alone.
void read_gaps_of_bonds(const Simulation& s, ContactMemory& m);

} // namespace cairn
