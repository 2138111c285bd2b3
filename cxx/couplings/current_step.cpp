// Potentials and currents of a step (Kirchhoff's laws), with films that break down.
#include "../networks/current_step.hpp"

#include <algorithm>
#include <cmath>

#include "../networks/unknowns.hpp"
#include "../simulation/simulation.hpp"

namespace cairn {

// Currents and potentials that are given.
void CurrentStep::begin(const Simulation& s, const NetworkInput& in) {
  const auto n = std::size_t(unknowns(s.scene));
  source_.assign(n, 0.0);
  leak_.assign(n, 0.0);
  held_.assign(n, 0);
  copy_to(potential_, s.scene.bodies.potential, s.scene.nodes.potential);
  for (std::size_t j = 0; j < in.sources.size(); ++j)
    take_source(in.sources[j], rows_.source_body[j], held_.data(), potential_.data(), source_.data());
}

// One way within a step, so that the rounds come to an end: solve, let films break, solve again.
void CurrentStep::solve(std::int64_t count, const NetworkInput& in, NetworkOutput& out) {
  for (out.report.rounds = 1;; ++out.report.rounds) {
    if (in.film)
      cairn_film_conductance(count, in.film->conductance, clean_.data(), films_.broken.data(), out.conductance.data());
    else
      std::copy_n(clean_.begin(), count, out.conductance.begin());
    branches_.weigh(out.conductance, in);
    out.report.solve = branches_.solve(in, source_, leak_, held_, potential_.data(), out.report);
    std::fill_n(out.flow.begin(), count, 0.0);
    for (std::int64_t e = 0; e < branches_.of_contacts; ++e) out.flow[branches_.of_contact[e]] += branches_.through[e];
    if (!in.film || out.report.solve.status != ConductionReport::converged) break;
    std::int64_t switched = 0;
    cairn_film_break(count, in.film->power, in.film->ratio, spots_.radius.data(), spots_.force.data(),
                     out.conductance.data(), out.flow.data(), films_.broken.data(), &switched);
    if (double(switched) <= in.switched_share * double(count)) break;
  }
}

void CurrentStep::advance(Simulation& s, double h, const NetworkInput& in, NetworkOutput& out,
                          const double* temperature) {
  begin(s, in);
  fit(clean_, std::size_t(s.candidates.count));
  spots_.conduct(s, in, temperature, clean_);
  films_.recall(s, in, spots_, out.broken_keys);
  branches_.lay(s);
  branches_.join_electrodes(in);
  solve(s.candidates.count, in, out);
  films_.remember(s, in, out.broken_keys);
  give_back(potential_, s.scene.bodies.potential, s.scene.nodes.potential);
  settle(s, h, out);
}

// Totals of the step: currents in and out, and dissipation.
void CurrentStep::settle(const Simulation& s, double h, NetworkOutput& out) {
  const std::vector<double>& x = potential_;
  const Candidates& c = s.candidates;
  const std::size_t n = x.size();
  net_.assign(n, 0.0); // net current out of each body [A]
  double dissipated = 0;
  for (std::size_t e = 0; e < branches_.a.size(); ++e) {
    net_[branches_.a[e]] += branches_.through[e];
    net_[branches_.b[e]] -= branches_.through[e];
    if (std::isfinite(branches_.value[e]) && std::abs(branches_.value[e]) > 0)
      dissipated += branches_.through[e] * branches_.through[e] / branches_.value[e];
  }
  for (std::int64_t i = 0; i < c.count; ++i)
    out.power[i] = out.conductance[i] > 0 ? out.flow[i] * out.flow[i] / out.conductance[i] : 0;
  double inflow = 0, outflow = 0, left = 0, largest = 0, supplied = 0;
  for (std::size_t i = 0; i < n; ++i) {
    largest = std::max(largest, std::abs(net_[i]));
    const bool given = held_[i] || std::abs(source_[i]) > 0;
    if (!given || !std::isfinite(x[i])) {
      left = std::max(left, std::abs(net_[i]));
      continue;
    }
    (net_[i] > 0 ? inflow : outflow) += std::abs(net_[i]);
    supplied += net_[i] * x[i];
  }
  out.report.unfit = spots_.unfit;
  out.report.branches = std::count_if(out.conductance.begin(), out.conductance.end(), [](double g) { return g > 0; });
  out.report.broken = std::int64_t(out.broken_keys.size());
  out.report.residual = out.report.solve.residual;
  out.report.power = dissipated;
  out.report.flow = inflow;
  out.report.closure = inflow > 0 ? std::max(std::abs(inflow - outflow) / inflow, left / std::max(inflow, largest)) : 0;
  out.report.status =
      out.report.solve.status == ConductionReport::converged
          ? (out.report.solve.open > 0 ? "open" : "converged")
          : (out.report.solve.status == ConductionReport::not_finite ? "not_finite" : "iteration_limit");
  out.balance.charge_in += inflow * h;
  out.balance.charge_out += outflow * h;
  out.balance.joule += dissipated * h;
  out.balance.supplied += supplied * h;
  out.balance.closure += std::abs(supplied - dissipated) * h;
  out.balance.in_play += std::max(std::abs(supplied), dissipated) * h;
}

std::int64_t CurrentStep::bytes() const {
  std::int64_t sum = 0;
  for (const auto* v : {&potential_, &source_, &net_, &leak_, &clean_}) sum += std::int64_t(8 * v->capacity());
  return sum;
}

} // namespace cairn
