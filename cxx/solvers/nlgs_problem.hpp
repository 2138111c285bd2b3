// Sweeps of block nonlinear Gauss-Seidel over a problem, in an order that its variants choose.
#pragma once
#include "problem_monitor.hpp"

namespace cairn {

struct SweepOrder {
  std::vector<std::int32_t> contact;      // (contacts) in the order of the sweep
  std::vector<std::int64_t> colour_start; // contacts between two of these may be done at once if threads > 1
  int threads = 1;
};
// Draws the order of the next sweep; empty if it stays.
using NextOrder = std::function<void(std::vector<std::int32_t>&)>;

ProblemReport sweep_problem(const FrictionProblem&, const ProblemOptions&, double* r, const std::string& name,
                            SweepOrder, const NextOrder&);

} // namespace cairn
