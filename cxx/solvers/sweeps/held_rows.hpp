// Equalities among the velocities of a step: impulses x of S x = b, S = G A^-1 G' + C of the rows G that are held.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "../../soe/soe.hpp"

namespace cairn {

// Equality rows of joints, which may depend on each other, as in a ring of hinges, so that S is singular: the factors
// are those of S + delta diag(S), and steps of the proximal point method (Rockafellar 1976) remove delta again. The
// result is the smallest of all solutions; a part of the right side that no impulse can balance remains.
class HeldRows {
public:
  // Lower triangle of S with its values, all of its diagonal above zero.
  explicit HeldRows(SparseMatrix matrix);
  std::int64_t count() const { return matrix_.n; }
  // False: there are no factors, since numbers are not finite.
  bool factored() const { return factored_; }
  // Rows that hold each other, over others or at once, are of one assembly.
  std::int32_t assemblies() const { return assemblies_; }
  std::int32_t assembly(std::int64_t row) const { return assembly_[std::size_t(row)]; }
  // x in place of b, (columns, n) with the rows of a column side by side.
  void solve(double* b, std::int64_t columns);

private:
  void find_assemblies();
  void refine(double* b, std::int64_t columns);
  void subtract_product(const double* x, double* from) const; // S x
  double size(const double* b) const;                         // its square, each row in its own unit
  SparseMatrix matrix_;
  std::unique_ptr<Soe> soe_;
  std::vector<std::int32_t> assembly_;
  std::vector<double> left_, step_, best_;
  std::int32_t assemblies_ = 0;
  bool factored_ = true;
};

} // namespace cairn
