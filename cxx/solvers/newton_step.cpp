#include "newton_step.hpp"

#include "cairn/core.h"

namespace cairn {

NewtonStep::NewtonStep(const FrictionProblem& p, NewtonFunction* function, const std::vector<std::int64_t>& place)
    : p_(p), function_(function), rho_(2 * p.contacts), f_(p.unknowns()), left_(p.dim * p.unknowns()),
      basis_(p.dim * p.unknowns()), own_(p.dim * p.unknowns()), step_(p.unknowns()), target_(p.unknowns()),
      change_(p.unknowns()), matrix_(p.block.size()), rhs_(p.unknowns()), zero_(p.unknowns()), unknowns_(p.contacts),
      factors_(p) {
  cairn_newton_weights(p.dim, p.contacts, place.data(), p.block.data(), rho_.data());
}

void NewtonStep::evaluate(const double* r, const double* u, int want) {
  function_(p_.dim, p_.contacts, p_.mu.data(), rho_.data(), r, u, want, f_.data(), unknowns_.data(), left_.data(),
            basis_.data(), own_.data(), step_.data(), target_.data());
}

double NewtonStep::sum_of_squares() const {
  double sum = 0;
  for (std::int64_t a = 0; a < p_.contacts; ++a)
    for (int i = 0; i < p_.dim; ++i) sum += f_[p_.dim * a + i] * f_[p_.dim * a + i] / rho_[2 * a];
  return sum;
}

double NewtonStep::merit(const double* r, const double* u) {
  evaluate(r, u, 0);
  return sum_of_squares();
}

bool NewtonStep::find(const double* r, const double* u, double alpha, double& merit) {
  evaluate(r, u, 1);
  merit = sum_of_squares();
  const int d = p_.dim;
  const std::int64_t n = p_.contacts;
  const std::int64_t* rows = p_.row_start.data();
  cairn_newton_blocks(d, n, rows, p_.column.data(), p_.block.data(), alpha, unknowns_.data(), left_.data(),
                      basis_.data(), own_.data(), matrix_.data());
  cairn_block_product(d, n, rows, p_.column.data(), p_.block.data(), zero_.data(), step_.data(), change_.data(), 1);
  cairn_newton_targets(d, n, alpha, unknowns_.data(), left_.data(), step_.data(), change_.data(), target_.data(),
                       rhs_.data());
  if (!factors_.factor(matrix_.data(), unknowns_.data())) return false;
  factors_.solve(rhs_.data());
  cairn_newton_step(d, n, unknowns_.data(), basis_.data(), rhs_.data(), step_.data());
  return true;
}

} // namespace cairn
