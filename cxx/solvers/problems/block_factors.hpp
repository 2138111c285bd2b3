// LU factors of matrices on the graph of contacts or of bodies: order (approximate minimum degree, Amestoy, Davis &
// Duff 1996, in SuiteSparse) and fill are found once, for any later set of active contacts.
#pragma once
#include <cstdint>
#include <vector>

#include "../../base/field.hpp"

namespace cairn {

// Throws Error where this build has no SuiteSparse, and says what to do.
void need_factorisations(const char* solver);
bool has_factorisations();

// Thrown before the memory is taken; solve_problem makes a status of it.
struct FactorsTooLarge {
  double bytes; // that they would take
};

class BlockFactors {
public:
  // Blocks of dim (2, 3 or 6) by rows, each diagonal block there; the caller keeps the pattern.
  // Throws FactorsTooLarge where they would take more than max_bytes.
  BlockFactors(int dim, const std::vector<std::int64_t>& row_start, const std::vector<std::int32_t>& column,
               double max_bytes);
  // block (dim, dim, blocks) on the pattern; active (rows): 0 leaves a row out. False: a pivot vanished.
  bool factor(const double* block, const std::int32_t* active);
  // Solution in place of b (dim, rows).
  void solve(double* b);
  // Cost of a factorisation with all rows active, and its memory.
  double operations() const;
  double bytes() const;
  // Blocks of U beside the diagonal, with all rows active.
  double blocks() const { return double(upper_.size()); }

private:
  double find_order(); // returns the blocks of U beside the diagonal
  double bytes_of(double blocks) const;
  void find_fill();
  void make_room();
  int dim_;
  std::int64_t n_;
  const std::vector<std::int64_t>& row_start_;
  const std::vector<std::int32_t>& column_;
  const std::int32_t* active_ = nullptr;
  std::vector<std::int32_t> order_, place_, lower_, upper_, lower_kept_, upper_kept_;
  std::vector<std::int64_t> lower_start_, upper_start_, lower_last_, upper_last_;
  Array<double> lower_block_, upper_block_, diagonal_, work_, x_;
};

} // namespace cairn
