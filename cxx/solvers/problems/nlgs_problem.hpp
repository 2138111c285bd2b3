// Sweeps of block nonlinear Gauss-Seidel over a problem, in an order that its variants choose.
#pragma once
#include "problem_monitor.hpp"

namespace cairn {

// W prepared for sweeps, their order, and where contacts slipped last.
class Sweeper {
public:
  explicit Sweeper(const FrictionProblem&);
  // One sweep over r; returns sum W_NN |change of r|^2 [J], in the order of contacts.
  double sweep(double* r, double relaxation = 1);

  std::vector<std::int32_t> order;        // (contacts)
  std::vector<std::int64_t> colour_start; // contacts between two of these may be done at once if threads > 1
  int threads = 1;

private:
  const FrictionProblem& problem_;
  std::vector<std::int32_t> column_;
  Array<double> beside_, local_, slip_, change_;
};

// Draws the order of the next sweep; empty if it stays.
using NextOrder = std::function<void(std::vector<std::int32_t>&)>;

ProblemReport sweep_problem(const FrictionProblem&, const ProblemOptions&, double* r, const std::string& name, Sweeper&,
                            const NextOrder& = {});

} // namespace cairn
