// One contact under a law of the list, driven by the slots that a step calls, in its order.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "contacts/interaction.hpp"
#include "laws/law_geometry.hpp"

namespace cairn::test {

inline const LawInfo& law_called(const std::string& name) {
  for (const LawInfo& law : law_infos())
    if (law.python_name == name) return law;
  throw std::runtime_error("no law " + name);
}

// Eight that are the same, on a diagonal W.
struct OneContact {
  static constexpr int n = 8;
  using Values = std::map<std::string, double>;
  const LawInfo& law;
  int dim, c;
  double h, area = 1e-4, radius = 1, across = 0, gap[n], w[6] = {1, 1, 1, 1, 1, 1};
  std::vector<double> params, state, energy = std::vector<double>(4 * n, 0.0);
  double begin[6] = {}; // relative velocity at the start of the step
  double r[6] = {}, u[6] = {}, work = 0, stored = 0, taken = 0, released = 0, residual = 0; // of the step; sums [J]
  std::int32_t status[n];

  OneContact(const std::string& name, const Values& given, int dim = 2, double h = 1e-5, double first_state = 1)
      : law(law_called(name)), dim(dim), c(law.components(dim)), h(h),
        params((law.parameters.size() + 1 + std::size_t(geometry_columns(law))) * n),
        state(std::size_t(std::max(1, law.state_columns(dim)) * n)) {
    for (std::size_t p = 0; p < law.parameters.size(); ++p)
      fill(&params[p * n], given.contains(law.parameters[p].name)
                               ? std::min(given.at(law.parameters[p].name), std::numeric_limits<double>::max())
                               : std::min(law.parameters[p].standard, std::numeric_limits<double>::max()));
    for (const auto& [word, value] : given)
      EXPECT_TRUE(std::any_of(law.parameters.begin(), law.parameters.end(), [&](auto& p) { return p.name == word; }))
          << word;
    fill(gap, 0);
    std::fill(state.begin(), state.end(), 0.0);
    fill(state.data(), first_state);
  }
  static void fill(double* column, double value) { std::fill_n(column, n, value); }

  // One step from this velocity without contact.
  void advance(const std::vector<double>& free) {
    std::vector<double> block(n * c * c, 0.0), q(n * c), bias(n * c), extra(n * c), mu(n), one(n * c, 0.0), f(n * c),
        weight(n * c), rho(n), v(n * c), before_step(n * c), geometry(std::size_t(geometry_columns(law)) * n);
    for (int k = 0; k < c; ++k) fill(&before_step[k * n], begin[k]);
    fill(geometry.data(), area);
    fill(geometry.data() + n, radius);
    fill(geometry.data() + 2 * n, 1 / w[0]);
    if (rolls(law)) fill(geometry.data() + 3 * n, radius), fill(geometry.data() + 5 * n, across > 0 ? across : radius);
    const std::size_t own = law.parameters.size() * n;
    fill(&params[own], h);
    std::copy_n(geometry.data(), geometry.size(), &params[own + n]);
    const cairn_law_context context{h, 0.5, geometry.data(), nullptr, 0};
    law.prepare(n, c, &context, gap, before_step.data(), params.data(), state.data(), bias.data(), extra.data(),
                mu.data());
    fill(rho.data(), 1 / w[0]);
    for (int k = 0; k < c; ++k) {
      fill(&block[n * (k * c + k)], w[k] + extra[k * n]);
      for (int i = 0; i < n; ++i) q[k * n + i] = free[k] + bias[k * n + i];
    }
    if (law.solve)
      law.solve(n, c, block.data(), q.data(), bias.data(), params.data(), state.data(), one.data(), status);
    else
      (dim == 2 ? cairn_cone_full2 : cairn_cone_full3)(n, c, block.data(), q.data(), bias.data(), mu.data(), nullptr,
                                                       one.data(), status);
    for (int k = 0; k < c; ++k)
      for (int i = 0; i < n; ++i) v[k * n + i] = q[k * n + i] + block[n * (k * c + k) + i] * one[k * n + i];
    if (law.residual)
      law.residual(n, c, &context, rho.data(), block.data(), v.data(), bias.data(), one.data(), params.data(),
                   state.data(), f.data(), weight.data(), status);
    residual = 0;
    for (int k = 0; k < c; ++k) {
      residual = std::max(residual, std::abs(f[k * n]));
      for (int i = 0; i < n; ++i) v[k * n + i] = free[k] + w[k] * one[k * n + i]; // a bias may be as large as it likes
      r[k] = one[k * n];
      u[k] = v[k * n];
      work -= r[k] * u[k];
    }
    const std::vector<double> before = state;
    if (law.commit) law.commit(n, c, &context, gap, v.data(), one.data(), params.data(), state.data());
    if (law.energy) {
      law.energy(n, c, &context, gap, v.data(), one.data(), params.data(), before.data(), state.data(), energy.data());
      stored = energy[0];
      taken += energy[n] + energy[2 * n];
      released += energy[3 * n];
    }
    for (int i = 0; i < n; ++i) gap[i] += h * v[i];
  }
};

} // namespace cairn::test
