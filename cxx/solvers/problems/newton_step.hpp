// One step of a generalised Newton method on f(r, W r + q + alpha (r - centre)) = 0: f and its derivative over all
// contacts, the sparse system of the unknowns that are left, its solution. Where the problem knows the bodies, the
// unknowns of the system are theirs (alpha > 0).
#pragma once
#include <optional>

#include "block_factors.hpp"
#include "friction_problem.hpp"

namespace cairn {

// Kernels newton_<function>.
using NewtonFunction = void(std::int32_t dim, std::int64_t n, const double* mu, const double* rho, const double* r,
                            const double* u, std::int32_t want, double* f, std::int32_t* unknowns, double* left,
                            double* basis, double* own, double* step, double* target);

class NewtonStep {
public:
  // place: of the diagonal blocks; max_bytes: of factors, see BlockFactors.
  NewtonStep(const FrictionProblem&, NewtonFunction*, const std::vector<std::int64_t>& place, double max_bytes);
  // |f|^2 / rho_N alone.
  double merit(const double* r, const double* u);
  // |f|^2 and dr, which stays in step(); u holds alpha (r - centre). False: the system is singular.
  bool find(const double* r, const double* u, double alpha, double& merit);
  const Array<double>& step() const { return step_; }
  double operations() const { return factors_->operations(); }
  double bytes() const { return factors_->bytes(); }

private:
  double sum_of_squares() const;
  void evaluate(const double* r, const double* u, int want);
  void join_bodies();
  bool find_by_contacts(double alpha);
  bool find_by_bodies(double alpha);
  const FrictionProblem& p_;
  NewtonFunction* function_;
  Array<double> rho_, f_, left_, basis_, own_, step_, target_, change_, matrix_, rhs_, zero_;
  std::vector<std::int32_t> unknowns_;
  std::optional<BlockFactors> factors_;
  // over bodies: the graph of those that touch, and where the blocks of a contact stand on it
  std::vector<std::int64_t> row_start_, diagonal_, place_;
  std::vector<std::int32_t> column_, active_;
  Array<double> answer_, known_, velocity_;
};

} // namespace cairn
