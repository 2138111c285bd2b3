// Networks: graphs of conductances by themselves, and those of a simulation.
#include "networks/balance_terms.hpp"
#include "networks/network.hpp"
#include "networks/unknowns.hpp"

#include "arrays.hpp"
#include "networks.hpp"
#include "simulation/simulation.hpp"

using cairn::Network;
using cairn::Simulation;

namespace {

const char* name_of(cairn::ConductionReport::Status status) {
  switch (status) {
  case cairn::ConductionReport::converged: return "converged";
  case cairn::ConductionReport::iteration_limit: return "iteration_limit";
  case cairn::ConductionReport::indefinite: return "indefinite";
  default: return "not_finite";
  }
}

cairn::ConductionOptions::Method method_of(const std::string& name) {
  using Method = cairn::ConductionOptions::Method;
  if (name == "auto") return Method::automatic;
  if (name == "direct") return Method::direct;
  if (name == "multigrid") return Method::multigrid;
  throw cairn::Error("method is '" + name + "': give auto, direct or multigrid");
}

// x (n) is given where held; returns x, flow of each branch, report.
py::tuple solve(cairn::Conduction& self, const Input<std::int32_t>& a, const Input<std::int32_t>& b,
                const Input<double>& conductance, const Input<double>& leak, const Input<bool>& held,
                const Input<double>& source, const Input<double>& x, const std::string& method, double tolerance,
                int max_iterations) {
  cairn::ConductionGraph g;
  g.n = source.size();
  g.branches = conductance.size();
  if (a.size() != g.branches || b.size() != g.branches || leak.size() != g.n || held.size() != g.n || x.size() != g.n)
    throw cairn::Error("branches and unknowns of a network do not agree in number");
  for (std::int64_t k = 0; k < g.branches; ++k)
    for (const std::int32_t end : {a.data()[k], b.data()[k]})
      if (end < 0 || end >= g.n)
        throw cairn::Error("branch " + std::to_string(k) + " ends at unknown " + std::to_string(end) + ": there are " +
                           std::to_string(g.n) + ", from 0");
  g.a = a.data();
  g.b = b.data();
  g.conductance = conductance.data();
  g.leak = leak.data();
  const std::vector<std::uint8_t> flags(held.data(), held.data() + held.size());
  g.held = flags.data();
  py::array_t<double> value(x.size()), flow(conductance.size());
  std::copy_n(x.data(), x.size(), value.mutable_data());
  double *const to = value.mutable_data(), *const through = flow.mutable_data();
  cairn::ConductionOptions options;
  options.method = method_of(method);
  options.tolerance = tolerance;
  options.max_iterations = max_iterations;
  cairn::ConductionReport r;
  {
    const py::gil_scoped_release release;
    r = self.solve(g, source.data(), to, through, options);
  }
  py::dict report;
  report["status"] = name_of(r.status);
  report["method"] = r.method;
  report["unknowns"] = r.unknowns;
  report["components"] = r.components;
  report["floating"] = r.floating;
  report["open"] = r.open;
  report["iterations"] = r.iterations;
  report["factorisations"] = r.factorisations;
  report["residual"] = r.residual;
  return py::make_tuple(value, flow, report);
}

template <class T>
std::vector<T> vector_of(const py::handle& given) {
  const auto a = py::cast<Input<T>>(given);
  return {a.data(), a.data() + a.size()};
}

// {"temperature": (n), "value": (n)}
cairn::PropertyTable table_of(const py::handle& given) {
  const py::dict d = py::cast<py::dict>(given);
  return {vector_of<double>(d["temperature"]), vector_of<double>(d["value"])};
}

cairn::NetworkMaterial material_of(const py::handle& given) {
  const py::dict d = py::cast<py::dict>(given);
  const auto number = [&](const char* name) { return py::cast<double>(d[name]); };
  cairn::NetworkMaterial m;
  m.conductivity = table_of(d["conductivity"]);
  m.capacity = table_of(d["capacity"]);
  m.latent = number("latent");
  m.melts = number("melts");
  m.molten = number("molten");
  m.density = number("density");
  m.young = number("young");
  m.poisson = number("poisson");
  m.hardness = number("hardness");
  m.expansion = number("expansion");
  m.joint = d.contains("joint");
  return m;
}

Network::Split split_of(const std::string& name) {
  return name == "halves"       ? Network::Split::halves
         : name == "effusivity" ? Network::Split::effusivity
                                : Network::Split::none;
}

cairn::NetworkSource source_of(const py::handle& given) {
  const py::dict d = py::cast<py::dict>(given);
  const auto kind = py::cast<std::string>(d["kind"]);
  cairn::NetworkSource out;
  using Source = cairn::NetworkSource;
  out.kind = kind == "held"         ? Source::held
             : kind == "convection" ? Source::convection
             : kind == "radiation"  ? Source::radiation
             : kind == "gradient"   ? Source::gradient
                                    : Source::flow;
  out.electrode = py::cast<bool>(d["electrode"]);
  if (d.contains("axis")) out.axis = py::cast<int>(d["axis"]);
  out.ids = vector_of<std::int64_t>(d["ids"]);
  out.coefficient = vector_of<double>(d["coefficient"]);
  out.value = vector_of<double>(d["value"]);
  return out;
}

std::optional<Network>& slot(Simulation& s, const std::string& kind) {
  if (!s.networks) s.networks = std::make_unique<cairn::Networks>();
  return kind == "electrical" ? s.networks->electrical : s.networks->thermal;
}

// Sets a network; the memory of the one it replaces is kept.
void set_network(Simulation& s, const std::string& kind, const py::dict& d) {
  Network n;
  n.kind = kind == "electrical" ? Network::Kind::electrical : Network::Kind::thermal;
  for (const py::handle m : d["materials"]) n.materials.push_back(material_of(m));
  for (const py::handle k : d["kernels"]) {
    const auto [row, params] = py::cast<std::pair<std::size_t, std::vector<double>>>(k);
    const cairn::ConductanceInfo& info = cairn::conductance_infos().at(row);
    n.needs_radius |= info.reads.find("radius") != std::string::npos;
    n.needs_bond |= info.reads.find("intact") != std::string::npos || info.reads.find("area") != std::string::npos;
    n.kernels.push_back({info.kernel, params});
  }
  for (const py::handle k : d["plugged"]) {
    const auto [address, params, reads] = py::cast<std::tuple<std::uintptr_t, std::vector<double>, std::string>>(k);
    n.needs_radius |= reads.find("radius") != std::string::npos;
    n.needs_bond |= reads.find("intact") != std::string::npos || reads.find("area") != std::string::npos;
    n.kernels.push_back({reinterpret_cast<cairn_conductance*>(address), params});
  }
  if (d.contains("film")) {
    const auto f = py::cast<std::array<double, 4>>(d["film"]);
    n.film = cairn::OxideFilm{f[0], f[1], f[2], f[3]};
  }
  for (const py::handle source : d["sources"]) n.sources.push_back(source_of(source));
  n.branch_a = vector_of<std::int64_t>(d["branch_a"]);
  n.branch_b = vector_of<std::int64_t>(d["branch_b"]);
  n.branch_conductance = vector_of<double>(d["branch_conductance"]);
  n.branch_capacity = vector_of<double>(d["branch_capacity"]);
  n.node = vector_of<std::int64_t>(d["node"]);
  n.node_capacity = vector_of<double>(d["node_capacity"]);
  n.options.method = method_of(py::cast<std::string>(d["method"]));
  n.options.tolerance = py::cast<double>(d["tol"]);
  n.theta = py::cast<double>(d["theta"]);
  n.depth = py::cast<double>(d["depth"]);
  n.reference = py::cast<double>(d["reference"]);
  for (const py::handle given : d["stresses"]) {
    const py::dict of = py::cast<py::dict>(given);
    n.stresses.push_back({py::cast<std::size_t>(of["mesh"]), py::cast<double>(of["expansion"]),
                          vector_of<std::int64_t>(of["start"]), vector_of<std::int32_t>(of["node"]),
                          vector_of<double>(of["value"])});
  }
  n.steady = py::cast<bool>(d["steady"]);
  n.friction = split_of(py::cast<std::string>(d["friction"]));
  n.joule = split_of(py::cast<std::string>(d["joule"]));
  n.switched_share = py::cast<double>(d["switched_share"]);
  n.coupling_tolerance = py::cast<double>(d["coupling"]);
  std::optional<Network>& at = slot(s, kind);
  s.scene.activate(kind == "electrical" ? cairn::Need::electrical : cairn::Need::thermal);
  if (at) {
    n.balance = at->balance;
    n.broken_keys = at->broken_keys;
  }
  const bool bends = std::any_of(n.sources.begin(), n.sources.end(),
                                 [](const auto& from) { return from.kind == cairn::NetworkSource::gradient; });
  if (bends) {
    s.scene.activate(cairn::Need::growing);
    s.scene.activate(cairn::Need::bending);
    n.separate_hulls(s.scene);
    n.remember_shapes(s.scene, at ? &*at : nullptr);
  }
  at = std::move(n);
  if (py::cast<bool>(d["growing"])) {
    s.scene.activate(cairn::Need::growing);
    at->separate_hulls(s.scene);
  }
}

void set_source(Simulation& s, const std::string& kind, std::size_t which, const Input<double>& value) {
  cairn::NetworkSource& source = slot(s, kind)->sources.at(which);
  if (std::size_t(value.size()) != source.ids.size())
    throw cairn::Error("a source of the " + kind + " network has " + std::to_string(source.ids.size()) +
                       " bodies and " + std::to_string(value.size()) + " values");
  source.value.assign(value.data(), value.data() + value.size());
}

// Powers that kept the temperatures of bodies and nodes in the last step [W], 0 of those that nothing holds.
py::array_t<double> held_power(Simulation& s, const Input<std::int64_t>& ids) {
  py::array_t<double> out(ids.size());
  for (py::ssize_t i = 0; i < ids.size(); ++i) {
    const std::int32_t unknown = cairn::unknown_of_id(s.scene, ids.data()[i]);
    if (unknown < 0) throw cairn::Error("there is no body or node " + std::to_string(ids.data()[i]));
    const double power = slot(s, "thermal")->held_power(std::size_t(unknown));
    if (std::isnan(power))
      throw cairn::Error("the heat that keeps body or node " + std::to_string(ids.data()[i]) +
                         " at its temperature is undetermined: a perfect conductor joins it to another held one; give "
                         "that contact or wire a finite conductance, or hold one of both");
    out.mutable_data()[i] = power;
  }
  return out;
}

py::dict report_of(const Network& n) {
  const cairn::NetworkReport& r = n.report;
  const bool electrical = n.kind == Network::Kind::electrical;
  py::dict out, balance;
  out["status"] = r.status;
  out["method"] = r.solve.method;
  out["branches"] = r.branches;
  out["unknowns"] = r.solve.unknowns;
  out["components"] = r.solve.components;
  out["floating"] = r.solve.floating;
  out["open"] = r.solve.open;
  out["unfit"] = r.unfit;
  out["rounds"] = r.rounds;
  out["factorisations"] = r.factorisations;
  out["iterations"] = r.iterations;
  out["residual"] = r.residual;
  out["closure"] = r.closure;
  out["power"] = r.power;
  if (!electrical) out["coupling"] = r.coupling;
  if (!electrical) out["passes"] = r.passes;
  out[electrical ? "current" : "heat_flow"] = r.flow;
  if (n.film) out["broken"] = r.broken;
  static const char* const of_heat[] = {"stored", "held", "given", "convection", "radiation", "friction"};
  static const char* const of_charge[] = {"charge_in", "charge_out", "supplied"};
  cairn::each_term(n.balance, [&](const char* name, double value) {
    const auto in = [&](const auto& list) {
      return std::any_of(std::begin(list), std::end(list), [&](const char* x) { return std::string(x) == name; });
    };
    if (electrical ? !in(of_heat) : !in(of_charge)) balance[name] = value;
  });
  out["balance"] = balance;
  return out;
}

} // namespace

void add_network_reports(py::dict& out, const Simulation& s) {
  if (!s.networks) return;
  if (s.networks->electrical) out["electrical"] = report_of(*s.networks->electrical);
  if (s.networks->thermal) out["thermal"] = report_of(*s.networks->thermal);
}

void bind_networks(py::module_& m) {
  py::class_<cairn::Conduction>(m, "Conduction").def(py::init<>()).def("solve", &solve);
  m.def("conductances", [] {
    py::list rows;
    for (const cairn::ConductanceInfo& info : cairn::conductance_infos()) {
      cairn::LawInfo words; // parameters are declared as those of laws
      cairn::declare_law(words, info.parameters, "");
      py::list parameters;
      for (const cairn::LawParameter& p : words.parameters)
        parameters.append(py::make_tuple(
            p.name, p.required ? py::object(py::none()) : py::object(py::float_(p.standard)), p.smallest, p.largest));
      py::dict row;
      row["name"] = info.name;
      row["python_name"] = info.python_name;
      row["parameters"] = parameters;
      row["reads"] = info.reads;
      row["meaning"] = info.meaning;
      rows.append(row);
    }
    return rows;
  });
  auto simulation = py::reinterpret_borrow<py::class_<Simulation>>(m.attr("Simulation"));
  simulation.def("set_network", &set_network)
      .def("set_source", &set_source)
      .def("held_power", &held_power)
      .def("forget_networks", [](Simulation& s) { s.networks.reset(); })
      .def("network_reports", [](const Simulation& s) {
        py::dict out;
        add_network_reports(out, s);
        return out;
      });
}
