// Steps of mechanics and heat together, by repetition.
#include <string>

#include "../files/simulation_state.hpp"
#include "../networks/network.hpp"
#include "../networks/unknowns.hpp"
#include "../simulation/simulation.hpp"

namespace cairn {

const StepReport& step_coupled(Simulation& s, double h) {
  Network& heat = *s.networks->thermal;
  heat.expect({});
  const StoredValue begin = state_of(s);
  for (int pass = 1;; ++pass) {
    const StepReport* report = nullptr;
    try {
      report = &s.strategy().step(s, h);
    } catch (...) {
      heat.expect({});
      throw;
    }
    heat.report.passes = pass;
    const bool met = heat.report.coupling <= heat.coupling_tolerance;
    if (met || pass == heat.most_passes) {
      if (!met && std::string(heat.report.status) == "converged") heat.report.status = "coupling_limit";
      heat.expect({});
      return *report;
    }
    std::vector<double> end;
    copy_to(end, s.scene.bodies.temperature, s.scene.nodes.temperature);
    take_state(s, begin);
    heat.expect(std::move(end));
  }
}

} // namespace cairn
