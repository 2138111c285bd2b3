// Pressures that keep a fluid from being compressed, by products with a symmetric matrix alone.
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

namespace cairn {

// 0 <= A p + c, p >= 0, one of them 0 everywhere, or A p + c = 0 where p may have either sign, with A symmetric and not
// negative: modified proportioning with reduced gradient projections (Dostal & Schoeberl 2005) in the scale of the
// diagonal. Sums are in the order of particles, whatever the number of threads.
class PressureSolver {
public:
  struct Problem {
    std::function<void(const std::vector<double>& p, std::vector<double>& product)> apply;
    const std::vector<double>*constant, *diagonal; // c [1/s], of A [1/(Pa s)]
    // A c by which residuals are measured: impulses on light bodies that cancel each other make the one above large.
    const std::vector<double>* measure;
    bool unilateral = true;
    double tolerance = 1e-3; // of the residual over that of `measure` at p = 0
    int most = 1000;         // products
  };
  struct Report {
    int products = 0;
    double residual = 0; // over that of p = 0
    bool converged = false;
  };
  // p: the first guess, and the solution. norm: largest eigenvalue met so far in the scale of the diagonal, kept
  // between calls, 0: none.
  Report solve(const Problem& problem, std::vector<double>& p, double& norm);
  std::int64_t bytes() const;

private:
  void product(const std::vector<double>& x, std::vector<double>& out);
  double split(const std::vector<double>& x, bool unilateral); // gradient into free_ and chopped_; its square
  void measure_norm(double& norm);

  const Problem* problem_ = nullptr;
  int products_ = 0;
  std::vector<double> scale_, x_, gradient_, free_, chopped_, way_, product_, pressure_;
};

} // namespace cairn
