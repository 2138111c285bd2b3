// LU factors of matrices on the graph of contacts: the order (approximate minimum degree, Amestoy, Davis & Duff 1996,
// in SuiteSparse) and the fill are found once, whatever contacts are active afterwards.
#pragma once
#include "friction_problem.hpp"

namespace cairn {

// Throws Error where this build has no SuiteSparse, and says what to do.
void need_factorisations(const char* solver);

class BlockFactors {
public:
  explicit BlockFactors(const FrictionProblem&);
  // block (dim, dim, blocks) on the pattern of W; active (contacts): 0 leaves a contact out. False: a pivot vanished.
  bool factor(const double* block, const std::int32_t* active);
  // Solution in place of b (dim, contacts).
  void solve(double* b);
  std::int64_t fill() const { return std::int64_t(upper_.size()); } // blocks right of the diagonal

private:
  void find_order();
  void find_fill();
  const FrictionProblem& p_;
  const std::int32_t* active_ = nullptr;
  std::vector<std::int32_t> order_, place_, lower_, upper_, lower_kept_, upper_kept_;
  std::vector<std::int64_t> lower_start_, upper_start_, lower_last_, upper_last_;
  Array<double> lower_block_, upper_block_, diagonal_, work_, x_;
};

} // namespace cairn
