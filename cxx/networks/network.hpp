// Networks of potential and temperature: an unknown on each rigid body and each node of a mesh, a branch over each
// contact, whose conductance is what the kernels of networks.def give together; further branches are given.
#pragma once
#include <memory>
#include <optional>

#include "network_input.hpp"
#include "network_output.hpp"

namespace cairn {

class Scene;
class Simulation;
struct StepReport;

// A network in time: input, results and parts (network_parts.hpp).
class Network : public NetworkInput, public NetworkOutput {
public:
  Network();
  ~Network();
  Network(Network&&) noexcept;
  Network& operator=(Network&&) noexcept;

  // Time of free flight at the begin of the step, before its contacts [s].
  double flown = 0;
  // Heat of impacts before those contacts, from the candidates as they stand, is that of the next advance_temperature.
  void keep_impact_heat(Simulation& s);
  void forget_flight();

  void advance_potential(Simulation& s, double h, const Network* thermal);
  void advance_temperature(Simulation& s, double h, const Network* electrical);
  void load_meshes(Simulation& s);
  void separate_hulls(Scene& scene);
  void remember_shapes(const Scene& scene, const Network* before); // before bodies bend
  // Temperatures that mechanics see in the step: those at its begin, or what the last pass found at its end.
  const double* seen(const double* at_begin) const;
  void expect(std::vector<double> end);
  void changed(); // sources or branches
  // Power that kept the temperature of a body or node in the last step [W]; 0 where nothing holds it.
  double held_power(std::size_t unknown) const;
  std::int64_t bytes() const;

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

// Value of the body or mesh node that carries a contactor; value: per unknown.
double value_at(const Simulation& s, const double* value, std::int32_t contactor);

// Networks of a simulation.
struct Networks {
  std::optional<Network> electrical, thermal;
  void advance(Simulation& s, double h);
  void keep_flight(Simulation& s, double time); // bodies flew for that time; contacts act from now on
  void forget_flight();
  bool repeats() const { return thermal && thermal->coupling_tolerance < std::numeric_limits<double>::infinity(); }
  std::int64_t bytes() const;
};

// A step that is made again from its begin, mechanics and conductances each time at the temperatures that the last pass
// found at its end, until these stay. It keeps the whole state of the begin, as a checkpoint does.
const StepReport& step_coupled(Simulation& s, double h);

} // namespace cairn
