// Potentials and currents of a step (Kirchhoff's laws), with films that break down.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../networks/network.hpp"
#include "../networks/unknowns.hpp"
#include "../simulation/simulation.hpp"

namespace cairn {

void Network::advance_potential(Simulation& s, double h, const Network* thermal) {
  place(s);
  gather(s, h);
  report = {};
  const auto n = std::size_t(unknowns(s.scene));
  source_.assign(n, 0.0);
  leak_.assign(n, 0.0);
  held_.assign(n, 0);
  Scene& scene = s.scene;
  copy_to(potential_, scene.bodies.potential, scene.nodes.potential);
  double* const x = potential_.data();
  for (std::size_t j = 0; j < sources.size(); ++j) {
    const NetworkSource& from = sources[j];
    bool first = true;
    for (std::size_t i = 0; i < from.ids.size(); ++i) {
      const std::int32_t body = source_body_[j][i];
      if (body < 0) continue;
      if (from.kind == NetworkSource::held) {
        held_[body] = 1;
        x[body] = from.value[i];
      } else if (!from.electrode || first) {
        source_[body] += from.value[i];
      }
      first = false;
    }
  }
  const double* warm = values_of(scene.bodies.temperature, scene.nodes.temperature, warm_);
  conduct(s, thermal ? thermal->seen(warm) : warm, clean_);
  recall_films(s);
  lay_branches(s);
  electrodes();
  const std::int64_t count = s.candidates.count;
  // one way within a step, so that the rounds come to an end: solve, let films break, solve again
  for (report.rounds = 1;; ++report.rounds) {
    if (film)
      cairn_film_conductance(count, film->conductance, clean_.data(), broken_.data(), conductance.data());
    else
      std::copy_n(clean_.begin(), count, conductance.begin());
    weigh_branches(conductance);
    report.solve = solve(x);
    std::fill_n(flow.begin(), count, 0.0);
    for (std::int64_t e = 0; e < contact_branches_; ++e) flow[of_contact_[e]] += through_[e];
    if (!film || report.solve.status != ConductionReport::converged) break;
    std::int64_t switched = 0;
    cairn_film_break(count, film->power, film->ratio, radius_.data(), force_.data(), conductance.data(), flow.data(),
                     broken_.data(), &switched);
    if (double(switched) <= switched_share * double(count)) break;
  }
  remember_films(s);
  give_back(potential_, scene.bodies.potential, scene.nodes.potential);
  settle_current(s, h + flown, potential_);
}

// Totals of the step: currents in and out, and dissipation.
void Network::settle_current(const Simulation& s, double h, const std::vector<double>& x) {
  const Candidates& c = s.candidates;
  const std::size_t n = x.size();
  x_.assign(n, 0.0); // net current out of each body [A]
  double dissipated = 0;
  for (std::size_t e = 0; e < a_.size(); ++e) {
    x_[a_[e]] += through_[e];
    x_[b_[e]] -= through_[e];
    if (std::isfinite(value_[e]) && std::abs(value_[e]) > 0) dissipated += through_[e] * through_[e] / value_[e];
  }
  for (std::int64_t i = 0; i < c.count; ++i) power[i] = conductance[i] > 0 ? flow[i] * flow[i] / conductance[i] : 0;
  double in = 0, out = 0, left = 0, largest = 0, supplied = 0;
  for (std::size_t i = 0; i < n; ++i) {
    largest = std::max(largest, std::abs(x_[i]));
    const bool given = held_[i] || std::abs(source_[i]) > 0;
    if (!given || !std::isfinite(x[i])) {
      left = std::max(left, std::abs(x_[i]));
      continue;
    }
    (x_[i] > 0 ? in : out) += std::abs(x_[i]);
    supplied += x_[i] * x[i];
  }
  report.unfit = unfit_;
  report.branches = std::count_if(conductance.begin(), conductance.end(), [](double g) { return g > 0; });
  report.broken = std::int64_t(broken_keys.size());
  report.residual = report.solve.residual;
  report.power = dissipated;
  report.flow = in;
  report.closure = in > 0 ? std::max(std::abs(in - out) / in, left / std::max(in, largest)) : 0;
  report.status = report.solve.status == ConductionReport::converged
                      ? (report.solve.open > 0 ? "open" : "converged")
                      : (report.solve.status == ConductionReport::not_finite ? "not_finite" : "iteration_limit");
  balance.charge_in += in * h;
  balance.charge_out += out * h;
  balance.joule += dissipated * h;
  balance.supplied += supplied * h;
  balance.closure += std::abs(supplied - dissipated) * h;
  balance.in_play += std::max(std::abs(supplied), dissipated) * h;
}

} // namespace cairn
