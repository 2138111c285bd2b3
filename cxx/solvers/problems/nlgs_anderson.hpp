// Sweeps with Anderson's acceleration.
#pragma once
#include "nlgs_problem.hpp"

namespace cairn {

class Anderson {
public:
  // memory: columns, at most 32
  Anderson(const FrictionProblem&, const Array<double>& w_nn, int memory);
  // From r, g(r) and sum W_NN |g - r|^2 to the next r; back to plain sweeps where a combination made it worse.
  void next(const double* g, double change, double* r);
  void forget();

private:
  const FrictionProblem& problem_;
  std::int64_t size_;
  int memory_, columns_ = 0, stored_ = 0;
  bool has_last_ = false, mixed_ = false;
  double change_last_ = 0;
  Array<double> weight_, f_, f_last_, g_, g_last_, df_, dg_, work_, gram_;
};

// Asked with the iterations so far and the last error.
using GivesUp = std::function<bool(std::int64_t, double)>;

// Sweeps until the monitor ends it, or the caller gives up; returns iterations, counted on.
std::int64_t sweep_with_memory(const FrictionProblem&, const ProblemOptions&, ProblemMonitor&, const double* start,
                               std::int64_t iterations, const GivesUp&);

} // namespace cairn
