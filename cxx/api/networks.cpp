// The C API of networks of heat and current (cairn/cairn.h).
#include <algorithm>
#include <cmath>
#include <limits>

#include "../networks/network.hpp"
#include "objects.hpp"

using namespace cairn::api;
using cairn::Network;

namespace {

std::optional<Network>& slot(cairn_simulation* simulation, const char* kind) {
  require(simulation, "simulation");
  require(kind, "kind");
  auto& networks = simulation->simulation.networks;
  if (!networks) networks = std::make_unique<cairn::Networks>();
  const std::string name = kind;
  if (name == "electrical") return networks->electrical;
  if (name == "thermal") return networks->thermal;
  throw cairn::Error("kind is '" + name + "': give electrical or thermal");
}

Network& network(cairn_simulation* simulation, const char* kind) {
  std::optional<Network>& found = slot(simulation, kind);
  if (!found) throw cairn::Error(std::string("there is no ") + kind + " network: add it first");
  return *found;
}

[[noreturn]] void unknown(const char* what, const char* name, const char* known) {
  throw cairn::Error(std::string("there is no ") + what + " '" + name + "'; there are " + known);
}

double positive(const char* name, double value) {
  if (!(value >= 0)) throw cairn::Error(std::string(name) + " is " + std::to_string(value) + "; give a value >= 0");
  return value;
}

void check_body(const cairn_simulation* simulation, std::int64_t id) {
  const cairn::Scene& scene = simulation->simulation.scene;
  if (scene.find_node(id) < 0) (void)scene.internal(id);
}

double report_of(const Network& n, const std::string& name) {
  const cairn::NetworkReport& r = n.report;
  const cairn::NetworkBalance& b = n.balance;
  if (name == "status") {
    const std::string status = r.status;
    return status == "converged"                                       ? 0
           : status == "iteration_limit" || status == "coupling_limit" ? 1
           : status == "open"                                          ? 3
                                                                       : 2;
  }
  const std::pair<const char*, double> known[] = {{"branches", double(r.branches)},
                                                  {"floating", double(r.solve.floating)},
                                                  {"open", double(r.solve.open)},
                                                  {"rounds", double(r.rounds)},
                                                  {"residual", r.residual},
                                                  {"closure", r.closure},
                                                  {"power", r.power},
                                                  {"flow", r.flow},
                                                  {"stored", b.stored},
                                                  {"held", b.held},
                                                  {"given", b.given},
                                                  {"convection", b.convection},
                                                  {"radiation", b.radiation},
                                                  {"friction", b.friction},
                                                  {"joule", b.joule},
                                                  {"charge_in", b.charge_in},
                                                  {"charge_out", b.charge_out},
                                                  {"supplied", b.supplied},
                                                  {"balance", b.closure},
                                                  {"in_play", b.in_play}};
  std::string all = "status";
  for (const auto& [word, value] : known) {
    if (name == word) return value;
    all += std::string(", ") + word;
  }
  unknown("number of a network", name.c_str(), all.c_str());
}

} // namespace

extern "C" {

int32_t cairn_simulation_add_network(cairn_simulation* simulation, const char* kind, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_add_network");
    std::optional<Network>& found = slot(simulation, kind);
    if (found) throw cairn::Error(std::string("there is a ") + kind + " network already");
    cairn::Simulation& s = simulation->simulation;
    Network n;
    const bool electrical = std::string(kind) == "electrical";
    n.kind = electrical ? Network::Kind::electrical : Network::Kind::thermal;
    const cairn_matter& matter = simulation->matter;
    n.materials.resize(matter.materials.size());
    for (std::size_t m = 0; m < n.materials.size(); ++m)
      n.materials[m].joint = std::ranges::find(matter.joints, matter.materials[m]) != matter.joints.end();
    s.scene.activate(electrical ? cairn::Need::electrical : cairn::Need::thermal);
    if (!electrical)
      for (auto* field : {&s.scene.bodies.temperature, &s.scene.nodes.temperature})
        std::fill(field->values.begin(), field->values.end(), 293.15);
    found = std::move(n);
  });
}

int32_t cairn_simulation_set_network(cairn_simulation* simulation, const char* kind, const char* name, double value,
                                     cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_set_network");
    require(name, "name");
    Network& n = network(simulation, kind);
    const std::string word = name;
    const auto split = [&] { return Network::Split(int(value)); };
    if (word == "theta" && value >= 0.5 && value <= 1)
      n.theta = value;
    else if (word == "steady")
      n.steady = value != 0;
    else if (word == "tolerance" && value > 0)
      n.options.tolerance = value;
    else if (word == "depth" && value > 0)
      n.depth = value;
    else if (word == "reference")
      n.reference = value;
    else if (word == "switched_share" && value >= 0)
      n.switched_share = value;
    else if (word == "friction" && value >= 0 && value <= 2)
      n.friction = split();
    else if (word == "joule" && value >= 0 && value <= 2)
      n.joule = split();
    else if (word == "method" && value >= 0 && value <= 2)
      n.options.method = cairn::ConductionOptions::Method(int(value));
    else
      throw cairn::Error(word + " of a network cannot be " + std::to_string(value) +
                         ": there are theta (1/2 to 1), steady, tolerance, depth, reference, switched_share, friction, "
                         "joule and method (0, 1, 2)");
  });
}

int32_t cairn_simulation_set_network_material(cairn_simulation* simulation, const char* kind, int32_t material,
                                              const char* name, double value, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_set_network_material");
    require(name, "name");
    Network& n = network(simulation, kind);
    if (material < 0 || std::size_t(material) >= n.materials.size())
      throw cairn::Error("material is " + std::to_string(material) + ": there are " +
                         std::to_string(n.materials.size()) + ", from 0");
    cairn::NetworkMaterial& m = n.materials[std::size_t(material)];
    const std::string word = name;
    if (word == "conductivity")
      m.conductivity = {{}, {positive(name, value)}};
    else if (word == "capacity")
      m.capacity = {{}, {positive(name, value)}};
    else if (word == "density")
      m.density = positive(name, value);
    else if (word == "young")
      m.young = positive(name, value);
    else if (word == "poisson")
      m.poisson = value;
    else if (word == "hardness")
      m.hardness = positive(name, value);
    else if (word == "expansion") {
      m.expansion = value;
      simulation->simulation.scene.activate(cairn::Need::growing);
      n.separate_hulls(simulation->simulation.scene);
    } else
      unknown("property", name, "conductivity, capacity, density, young, poisson, hardness, expansion");
  });
}

int32_t cairn_simulation_add_conductance(cairn_simulation* simulation, const char* kind, const char* name,
                                         int32_t parameters, const double* parameter, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_add_conductance");
    require(name, "name");
    if (parameters > 0) require(parameter, "parameter");
    Network& n = network(simulation, kind);
    std::string known;
    for (const cairn::ConductanceInfo& row : cairn::conductance_infos()) {
      known += (known.empty() ? "" : ", ") + row.python_name;
      if (row.name != name && row.python_name != name) continue;
      cairn::LawInfo words;
      cairn::declare_law(words, row.parameters, "");
      const std::size_t wanted = words.parameters.size();
      if (row.name != "given_table" && std::size_t(counted(parameters)) != wanted)
        throw cairn::Error(row.python_name + " takes " + std::to_string(wanted) + " parameters, " + row.parameters);
      n.kernels.push_back({row.kernel, {parameter, parameter + parameters}});
      n.needs_radius |= row.reads.find("radius") != std::string::npos;
      n.needs_bond |= row.reads.find("intact") != std::string::npos || row.reads.find("area") != std::string::npos;
      return;
    }
    unknown("conductance", name, known.c_str());
  });
}

int32_t cairn_simulation_set_film(cairn_simulation* simulation, double conductance, double power, double ratio,
                                  double sliding, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_set_film");
    network(simulation, "electrical").film =
        cairn::OxideFilm{positive("conductance", conductance), positive("power", power), positive("ratio", ratio),
                         positive("sliding", sliding)};
  });
}

int32_t cairn_simulation_add_network_source(cairn_simulation* simulation, const char* kind, const char* what, int64_t n,
                                            const int64_t* bodies, const double* value, const double* coefficient,
                                            int32_t electrode, int32_t* source, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_add_network_source");
    require(what, "what");
    Network& to = network(simulation, kind);
    if (counted(n) > 0) {
      require(bodies, "bodies");
      require(value, "value");
    }
    using Source = cairn::NetworkSource;
    Source made;
    const std::string word = what;
    if (word == "held")
      made.kind = Source::held;
    else if (word == "flow")
      made.kind = Source::flow;
    else if (word == "convection")
      made.kind = Source::convection;
    else if (word == "radiation")
      made.kind = Source::radiation;
    else
      unknown("source", what, "held, flow, convection, radiation");
    const bool outside = made.kind == Source::convection || made.kind == Source::radiation;
    if (outside && n > 0) require(coefficient, "coefficient");
    made.electrode = electrode != 0;
    for (std::int64_t i = 0; i < n; ++i) check_body(simulation, bodies[i]);
    made.ids.assign(bodies, bodies + n);
    made.value.assign(value, value + n);
    if (outside) made.coefficient.assign(coefficient, coefficient + n);
    to.sources.push_back(std::move(made));
    to.changed();
    if (source) *source = std::int32_t(to.sources.size()) - 1;
  });
}

int32_t cairn_simulation_set_network_source(cairn_simulation* simulation, const char* kind, int32_t source, int64_t n,
                                            const double* value, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_set_network_source", true);
    Network& to = network(simulation, kind);
    if (source < 0 || std::size_t(source) >= to.sources.size())
      throw cairn::Error("source is " + std::to_string(source) + ": there are " + std::to_string(to.sources.size()) +
                         ", from 0");
    if (std::size_t(counted(n)) != to.sources[std::size_t(source)].ids.size())
      throw cairn::Error("source " + std::to_string(source) + " has " +
                         std::to_string(to.sources[std::size_t(source)].ids.size()) + " bodies, and value " +
                         std::to_string(n) + " numbers");
    if (n > 0) require(value, "value");
    to.sources[std::size_t(source)].value.assign(value, value + n);
  });
}

int32_t cairn_simulation_add_wires(cairn_simulation* simulation, const char* kind, int64_t n, const int64_t* bodies,
                                   const double* conductance, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_add_wires");
    Network& to = network(simulation, kind);
    if (counted(n) > 0) {
      require(bodies, "bodies");
      require(conductance, "conductance");
    }
    for (std::int64_t i = 0; i < 2 * n; ++i) check_body(simulation, bodies[i]);
    for (std::int64_t i = 0; i < n; ++i) positive("conductance", conductance[i]);
    for (std::int64_t i = 0; i < n; ++i) {
      to.branch_a.push_back(bodies[2 * i]);
      to.branch_b.push_back(bodies[2 * i + 1]);
      to.branch_conductance.push_back(conductance[i]);
      to.branch_capacity.push_back(0);
    }
    to.changed();
  });
}

int32_t cairn_simulation_set_temperature(cairn_simulation* simulation, int64_t n, const int64_t* bodies,
                                         const double* temperature, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_set_temperature");
    (void)network(simulation, "thermal");
    if (counted(n) > 0) require(temperature, "temperature");
    cairn::Scene& scene = simulation->simulation.scene;
    const std::int64_t of_bodies = scene.bodies.count, all = of_bodies + scene.nodes.count;
    if (!bodies && n != all)
      throw cairn::Error("temperature has " + std::to_string(n) + " numbers for " + std::to_string(of_bodies) +
                         " bodies" + (all > of_bodies ? " and " + std::to_string(all - of_bodies) + " nodes" : ""));
    for (std::int64_t i = 0; i < n; ++i)
      if (!(temperature[i] > 0) || !std::isfinite(temperature[i]))
        throw cairn::Error("temperature[" + std::to_string(i) + "] is " + std::to_string(temperature[i]) +
                           "; give temperatures above 0 [K]");
    std::vector<double*> to;
    for (std::int64_t i = 0; i < n; ++i)
      if (const std::int32_t node = bodies ? scene.find_node(bodies[i]) : -1; node >= 0)
        to.push_back(scene.nodes.temperature[node]);
      else if (bodies || i < of_bodies)
        to.push_back(
            scene.bodies.temperature[bodies ? scene.internal(bodies[i]) : scene.insertion_order()[std::size_t(i)]]);
      else
        to.push_back(scene.nodes.temperature[scene.node_insertion_order()[std::size_t(i - of_bodies)]]);
    for (std::int64_t i = 0; i < n; ++i) *to[std::size_t(i)] = temperature[i];
  });
}

int32_t cairn_simulation_network_report(const cairn_simulation* simulation, const char* kind, const char* name,
                                        double* value, cairn_error* error) {
  return guarded(error, [&] {
    require(name, "name");
    require(value, "value");
    *value = report_of(network(const_cast<cairn_simulation*>(simulation), kind), name);
  });
}

} // extern "C"
