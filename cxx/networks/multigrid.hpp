// Conjugate gradients with aggregation multigrid for equations of conduction (Notay 2010: double pairwise aggregation,
// K-cycle). Coarse equations are sums of conductances again, so that a weak conductance keeps all digits beside a
// strong one.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "../soe/soe.hpp"

namespace cairn {

// Row i: (leak_i + sum c_ij) x_i - sum c_ij x_j; c_ij of both triangles.
struct LaplacianMatrix {
  std::int64_t n = 0;
  std::vector<std::int64_t> start{0};
  std::vector<std::int32_t> column;
  std::vector<double> conductance, leak, diagonal;
  void multiply(const double* x, double* out) const; // by differences
  void sum_diagonal();
};

class Multigrid {
public:
  // Keeps a pointer to the matrix.
  void prepare(const LaplacianMatrix& matrix);
  // x of A x = b, from zero, until the residual has gone down by `reduction`. Returns the iterations that it took.
  int solve(const double* b, double* x, double reduction, int max_iterations);
  std::int64_t bytes() const;

private:
  struct Level {
    const LaplacianMatrix* matrix = nullptr;
    LaplacianMatrix own;
    std::vector<std::int32_t> aggregate; // of each row, -1: the smoother is enough for it
    std::vector<double> r, x, c, v, d, w, s;
  };
  static std::int64_t pair(const LaplacianMatrix& a, std::vector<std::int32_t>& aggregate, bool leave_out);
  static void contract(const LaplacianMatrix& a, const std::vector<std::int32_t>& aggregate, std::int64_t count,
                       LaplacianMatrix& out);
  void factor_coarsest();
  void solve_coarsest(Level& level);
  void cycle(std::size_t l, const double* r, double* z);
  void kcycle(std::size_t l); // level.x from level.r
  std::vector<std::unique_ptr<Level>> levels_;
  std::size_t used_ = 0;
  std::unique_ptr<Soe> coarsest_;
  bool factored_ = false;
  std::vector<double> r_, z_, p_, q_, z_before_;
};

} // namespace cairn
