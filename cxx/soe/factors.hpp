// Interface of every storage of a system of equations, behind Soe, which has scaled the matrix and eliminated held
// unknowns.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "soe.hpp"

namespace cairn {

// Which node of the factors hands on to which.
struct SoeTree {
  std::vector<std::int32_t> parent; // of each node, or -1
  std::vector<std::int32_t> first;  // (nodes + 1) place of a node's first column; empty: each is one column
  std::vector<std::int32_t> node;   // of each place; empty likewise
};

// A node of the tree as a block of columns of L, its own rows first and those below by their places.
struct SoeBlock {
  std::int32_t first = 0; // place of its first column
  std::int64_t columns = 1, below = 0;
  const std::int32_t* row = nullptr; // (below)
  const double* value = nullptr;     // (columns + below, columns); of a column of L D L' the entries below the diagonal
  double pivot = 0;                  // D, and 0 of L L'
};

class SoeFactors {
public:
  virtual ~SoeFactors() = default;
  // The matrix has the pattern the factors were made with; its diagonal entries are positive, if it is symmetric.
  virtual SoeStatus factor(const SparseMatrix& a) = 0;
  // Equation at each place of y below; empty: each at its own.
  virtual std::span<const std::int32_t> order() const { return {}; }
  // Solution in place of y (n, lanes), by places; `lanes` is 1 or 8. `work` has work_per_lane() numbers a lane.
  virtual void solve(int lanes, double* y, double* work) const = 0;
  virtual std::int64_t work_per_lane() const { return 0; }
  virtual const SoeTree* tree() const { return nullptr; }            // null: none; known once factorised
  virtual SoeBlock block(std::int32_t /*node*/) const { return {}; } // of the tree
  virtual const double* diagonal() const { return nullptr; }         // of a matrix that is diagonal, by places
  virtual std::int64_t bytes() const = 0;
  virtual std::int64_t entries() const = 0;
  virtual const char* storage() const = 0;
  virtual const char* library() const = 0;
};

// A pivot against the diagonal entry it came from: see SoeStatus.
SoeStatus judge_pivot(double pivot, double diagonal, std::int64_t row);

std::unique_ptr<SoeFactors> make_diagonal(const SparseMatrix& pattern, const char* storage = "diagonal");
std::unique_ptr<SoeFactors> make_banded(const SparseMatrix& pattern, std::vector<std::int32_t> order);
std::unique_ptr<SoeFactors> make_dense(const SparseMatrix& pattern);
std::unique_ptr<SoeFactors> make_cholmod(const SparseMatrix& pattern, const SoeOptions& options);
std::unique_ptr<SoeFactors> make_ldlt(const SparseMatrix& pattern, const SoeOptions& options);
std::unique_ptr<SoeFactors> make_unsymmetric(const SparseMatrix& pattern, const SoeOptions& options);

// An order of small band: Cuthill and McKee's, backwards, of the lower triangle's graph.
std::vector<std::int32_t> cuthill_mckee(const SparseMatrix& pattern);
// Entries below the diagonal that a band has in this order.
std::int64_t half_band(const SparseMatrix& pattern, const std::vector<std::int32_t>& order);

} // namespace cairn
