#include "newton_step.hpp"

#include <algorithm>

#include "cairn/core.h"

namespace cairn {

NewtonStep::NewtonStep(const FrictionProblem& p, NewtonFunction* function, const std::vector<std::int64_t>& place,
                       double max_bytes)
    : p_(p), function_(function), rho_(2 * p.contacts), f_(p.unknowns()), left_(p.dim * p.unknowns()),
      basis_(p.dim * p.unknowns()), own_(p.dim * p.unknowns()), step_(p.unknowns()), target_(p.unknowns()),
      change_(p.unknowns()), rhs_(p.unknowns()), zero_(p.unknowns()), unknowns_(p.contacts) {
  cairn_newton_weights(p.dim, p.contacts, place.data(), p.block.data(), rho_.data());
  if (p.bodies) {
    join_bodies();
    answer_.resize(p.dim * p.unknowns());
    known_.resize(p.unknowns());
    velocity_.resize(p.bodies->velocity.size());
    factors_.emplace(p.bodies->dofs, row_start_, column_, max_bytes);
  } else {
    matrix_.resize(p.block.size());
    factors_.emplace(p.dim, p.row_start, p.column, max_bytes);
  }
}

// The graph of bodies: a block for each pair that touches, and each on itself.
void NewtonStep::join_bodies() {
  const ContactBodies& bodies = *p_.bodies;
  const std::int64_t n = bodies.count;
  std::vector<std::int64_t> pairs; // row * n + column
  for (std::int64_t b = 0; b < n; ++b) pairs.push_back(b * n + b);
  for (std::int64_t a = 0; a < p_.contacts; ++a) {
    const std::int64_t i = bodies.body[2 * a], j = bodies.body[2 * a + 1];
    if (i < 0 || j < 0) continue;
    pairs.push_back(i * n + j);
    pairs.push_back(j * n + i);
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  row_start_.assign(n + 1, 0);
  diagonal_.resize(n);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const std::int64_t i = pairs[k] / n, j = pairs[k] % n;
    row_start_[i + 1] = std::int64_t(k) + 1;
    column_.push_back(std::int32_t(j));
    if (i == j) diagonal_[i] = std::int64_t(k);
  }
  const auto place = [&](std::int64_t i, std::int64_t j) {
    return std::int64_t(std::lower_bound(pairs.begin(), pairs.end(), i * n + j) - pairs.begin());
  };
  place_.assign(2 * p_.contacts, -1);
  for (std::int64_t a = 0; a < p_.contacts; ++a) {
    const std::int64_t i = bodies.body[2 * a], j = bodies.body[2 * a + 1];
    if (i < 0 || j < 0) continue;
    place_[2 * a] = place(i, j);
    place_[2 * a + 1] = place(j, i);
  }
  active_.assign(n, 1);
  matrix_.resize(std::size_t(bodies.dofs) * bodies.dofs * pairs.size());
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
  return p_.bodies ? find_by_bodies(alpha) : find_by_contacts(alpha);
}

bool NewtonStep::find_by_contacts(double alpha) {
  const int d = p_.dim;
  const std::int64_t n = p_.contacts;
  const std::int64_t* rows = p_.row_start.data();
  cairn_newton_blocks(d, n, rows, p_.column.data(), p_.block.data(), alpha, unknowns_.data(), left_.data(),
                      basis_.data(), own_.data(), matrix_.data());
  cairn_block_product(d, n, rows, p_.column.data(), p_.block.data(), zero_.data(), step_.data(), change_.data(), 1);
  cairn_newton_targets(d, n, alpha, unknowns_.data(), left_.data(), step_.data(), change_.data(), target_.data(),
                       rhs_.data());
  if (!factors_->factor(matrix_.data(), unknowns_.data())) return false;
  factors_->solve(rhs_.data());
  cairn_newton_step(d, n, unknowns_.data(), basis_.data(), rhs_.data(), step_.data());
  return true;
}

bool NewtonStep::find_by_bodies(double alpha) {
  const ContactBodies& b = *p_.bodies;
  cairn_newton_answers(p_.dim, p_.contacts, alpha, unknowns_.data(), left_.data(), basis_.data(), own_.data(),
                       step_.data(), target_.data(), answer_.data(), known_.data());
  cairn_newton_body_blocks(p_.dim, b.dofs, p_.contacts, b.count, b.body.data(), b.rows.data(), answer_.data(),
                           b.mass.data(), diagonal_.data(), place_.data(), std::int64_t(column_.size()),
                           matrix_.data());
  cairn_body_impulses(p_.dim, b.dofs, p_.contacts, b.count, b.body.data(), b.rows.data(), known_.data(),
                      velocity_.data());
  if (!factors_->factor(matrix_.data(), active_.data())) return false;
  factors_->solve(velocity_.data());
  cairn_body_velocities(p_.dim, b.dofs, p_.contacts, b.count, b.body.data(), b.rows.data(), velocity_.data(),
                        zero_.data(), change_.data());
  cairn_newton_body_step(p_.dim, p_.contacts, answer_.data(), known_.data(), change_.data(), step_.data());
  return true;
}

} // namespace cairn
