#include "base/threads.hpp"
#include "contacts/law_rows.hpp"
#include "files/older_states.hpp"
#include "files/run_continued.hpp"
#include "files/simulation_state.hpp"
#include "plugs/plug.hpp"
#include "ranks/over_ranks.hpp"
#include "simulation/contact_fields.hpp"
#include "simulation/report.hpp"
#include "solvers/problems/friction_problem.hpp"
#include "solvers/sweeps/contact_system.hpp"
#include "strategies/nscd/nscd.hpp"
#include "strategies/nscd/own_conditions.hpp"
#include "strategies/options.hpp"

#include "alone.hpp"
#include "arrays.hpp"
#include "known.hpp"
#include "networks.hpp"
#include "stored.hpp"

using cairn::Simulation;

void bind_controls(py::class_<Simulation>& simulation); // controls.cpp

namespace {

// A strategy with the settings that a dict gives by the names of its options.
std::unique_ptr<cairn::Strategy> strategy_of(const py::dict& d) {
  auto strategy = cairn::make_strategy(py::cast<std::string>(d["strategy"]));
  if (d.contains("integrator")) cairn::set_option(*strategy, "integrator", py::cast<std::string>(d["integrator"]));
  for (cairn::Option& o : strategy->options()) { // those of the integrator among them
    const py::str name(o.info.name.data(), o.info.name.size());
    if (!d.contains(name)) continue;
    std::visit([&](auto* member) { *member = py::cast<std::decay_t<decltype(*member)>>(d[name]); }, o.member);
  }
  strategy->check_options();
  return strategy;
}

// Names, kinds, ranges and defaults of the settings of a strategy.
py::list described(const std::string& name) {
  py::list rows;
  auto strategy = cairn::make_strategy(name);
  for (const cairn::Option& o : strategy->options()) {
    py::dict row;
    row["name"] = o.info.name;
    row["kind"] = o.info.kind;
    row["ends"] = o.info.ends;
    row["smallest"] = o.info.smallest;
    row["largest"] = o.info.largest;
    row["meaning"] = o.info.meaning;
    row["texts"] = strategy->texts_of(o.info.name);
    std::visit([&](auto* member) { row["default"] = *member; }, o.member);
    rows.append(row);
  }
  return rows;
}

py::list strategies() {
  py::list rows;
  for (const cairn::StrategyInfo& s : cairn::strategy_infos()) {
    const auto made = s.make();
    py::list laws;
    for (const cairn::LawInfo& law : cairn::law_infos())
      if (made->serves(law)) laws.append(law.python_name);
    rows.append(
        py::make_tuple(s.name, s.python_name, s.meaning, laws, dynamic_cast<cairn::Nscd*>(made.get()) != nullptr));
  }
  return rows;
}

py::list integrators() {
  py::list rows;
  for (const cairn::IntegratorInfo& i : cairn::integrator_infos()) {
    py::list parameters;
    for (const cairn::LawParameter& p : i.parameters)
      parameters.append(py::make_tuple(p.name, p.standard, p.smallest, p.largest));
    rows.append(py::make_tuple(i.name, i.python_name, i.meaning, parameters));
  }
  return rows;
}

// A step of h as a linear map, by the names of cairn_scheme.
py::dict scheme_of(const std::string& name, const std::vector<double>& parameters, double h) {
  cairn::Integrator integrator;
  integrator.name = name;
  for (std::size_t k = 0; k < std::min(parameters.size(), integrator.info().parameters.size()); ++k)
    integrator.parameter(name, int(k)) = parameters[k];
  const cairn_scheme s = integrator.scheme(h);
  const auto first = [&](const double* a, int n) { return py::array_t<double>(py::ssize_t(n), a); };
  py::dict out;
  out["h"] = s.h;
  out["impulse"] = s.impulse;
  out["end_share"] = s.end_share;
  out["implicit"] = s.implicit;
  out["damping"] = s.damping;
  out["stiffness"] = s.stiffness;
  out["share"] = s.share;
  out["elastic_velocity"] = s.elastic_velocity;
  out["position"] = first(s.position, s.histories);
  out["velocity"] = first(s.velocity, s.histories);
  out["elastic"] = first(s.elastic, s.histories);
  out["damping_history"] = first(s.damping_history, s.histories);
  out["gain"] = first(s.gain, s.histories);
  py::array_t<double> update({s.histories, s.histories});
  for (int j = 0; j < s.histories; ++j)
    for (int k = 0; k < s.histories; ++k) update.mutable_at(j, k) = s.update[j + cairn_most_history * k];
  out["update"] = update;
  out["largest"] = s.largest;
  out["histories"] = s.histories;
  return out;
}

void use(Simulation& s, const py::dict& d) {
  known(s);
  if (const auto* ranked = dynamic_cast<const cairn::OverRanks*>(&s.strategy()))
    return s.use(cairn::over_ranks(strategy_of(d), ranked->shared_exchange(), ranked->rhythm()));
  s.use(strategy_of(d));
}

const char* name_of(cairn::SolveStatus status) {
  switch (status) {
  case cairn::SolveStatus::converged: return "converged";
  case cairn::SolveStatus::iteration_limit: return "iteration_limit";
  case cairn::SolveStatus::newton_limit: return "newton_limit";
  default: return "diverged";
  }
}

py::dict energy_of(const cairn::Energy& e) {
  py::dict out;
  for (const auto& [name, member] : cairn::energy_terms()) out[name] = e.*member;
  return out;
}

py::dict report_of(const Simulation& s) {
  const cairn::StepReport& r = s.report;
  py::dict out;
  out["step"] = r.step;
  out["time"] = r.time;
  out["time_detection"] = r.time_detection;
  out["dt"] = r.h;
  out["contacts"] = r.contacts;
  out["way"] = r.way;
  out["unresolved_rotations"] = r.unresolved_rotations;
  out["status"] = name_of(r.solve.status);
  out["solver"] = r.solve.solver;
  out["iterations"] = r.solve.iterations;
  out["error"] = r.solve.error;
  out["worst_error"] = r.solve.worst_error;
  out["worst_contact"] = r.solve.worst_contact;
  out["light_error"] = r.solve.light_error;
  out["light_contact"] = r.solve.light_contact;
  if (!std::isnan(r.solve.velocity_error)) out["velocity_error"] = r.solve.velocity_error; // asked for by `accuracy`
  out["penetration"] = r.solve.penetration;
  out["drift"] = r.solve.drift;
  out["cone_distance"] = r.solve.cone_distance;
  out["energy_created"] = r.solve.energy_created;
  if (r.solve.has_joint_error) {
    out["joint_error"] = r.solve.joint_error;
    out["joint_gap"] = r.solve.joint_gap;
    out["joint_contact"] = r.solve.joint_contact;
  }
  if (!r.solve.joint_hint.empty()) out["joint_hint"] = r.solve.joint_hint;
  out["hint"] = r.solve.hint;
  out["mesh_depth"] = r.mesh_depth;
  out["mesh_way"] = r.mesh_way;
  if (!r.mesh_hint.empty()) out["mesh_hint"] = r.mesh_hint;
  if (!r.mesh_within.empty()) out["mesh_within"] = r.mesh_within;
  if (!r.mesh_turned.empty()) out["mesh_turned"] = r.mesh_turned;
  if (!r.unjoined.empty()) out["unjoined"] = r.unjoined;
  out["projection_error"] = r.projection_error;
  out["newton_passes"] = r.newton_passes;
  out["newton_error"] = r.newton_error;
  out["sub_steps"] = r.sub_steps;
  if (r.events >= 0) {
    out["events"] = r.events;
    out["persistent"] = r.persistent;
  }
  if (r.stable_step > 0) {
    out["stable_step"] = r.stable_step;
    out["neighbour_lists"] = r.neighbour_lists;
    if (r.solve.status == cairn::SolveStatus::converged) out["status"] = "explicit";
  }
  return out;
}

template <class T>
py::array_t<T> array_of(const std::vector<T>& v) {
  return py::array_t<T>(py::ssize_t(v.size()), v.data());
}

template <class T>
py::array read_contacts(Simulation& s, const cairn::ContactFieldInfo& field, std::int64_t n) {
  py::array_t<T> out(shape_of(n, field.components(s.scene.dim)));
  cairn::read_contact_field(s, field, out.mutable_data());
  return out;
}

py::array contact_field(Simulation& s, const std::string& name) {
  if (!cairn::has_contact_field(s, name)) throw py::key_error("there is no contact field " + name);
  const cairn::ContactFieldInfo& field = cairn::contact_field_info(name);
  s.strategy().view(s);
  const std::int64_t n = s.candidates.count;
  if (name == "status") return read_contacts<std::int64_t>(s, field, n).attr("astype")("int32");
  return field.whole ? read_contacts<std::int64_t>(s, field, n) : read_contacts<double>(s, field, n);
}

py::dict contact_rows(Simulation& s) {
  stages_of(s, "the problem of a step");
  if (!s.contacts_known) throw cairn::Error("there is no contact problem at hand: make a step first");
  const cairn::ContactRows rows = s.interactions.views().rows();
  py::dict out;
  out["axes"] = array_of(rows.axes);
  out["lever"] = array_of(rows.lever);
  out["bias"] = array_of(rows.bias);
  out["mu"] = array_of(rows.mu);
  out["compliance"] = array_of(rows.compliance);
  out["bodies"] = array_of(rows.bodies);
  out["kind"] = array_of(rows.kind);
  out["mesh"] = array_of(rows.mesh);
  out["node"] = array_of(rows.node);
  out["weight"] = array_of(rows.weight);
  return out;
}

// An array of bodies, in the order of insertion. Over ranks, each has for its own bodies what a step works with.
py::array body_array(Simulation& s, const std::string& name) {
  bool lacks = false;
  s.scene.bodies.for_each_field([&](const auto& f) { lacks = lacks || (f.name == name && !f.active); });
  Simulation& whole = known(s, lacks);
  return get_ordered(whole.scene.bodies, name, whole.scene.insertion_order());
}

// W (blocks, dim, dim) by rows of contacts; None: no joint is in the step.
py::object jointed_problem(Simulation& s) {
  stages_of(s, "the problem of a step");
  if (!s.contacts_known) throw cairn::Error("there is no contact problem at hand: make a step first");
  if (!s.interactions.joints().any()) return py::none();
  const cairn::FrictionProblem p = s.interactions.joints().problem(s.scene.bodies);
  const auto d = std::size_t(p.dim);
  std::vector<double> block(p.block.size());
  for (std::size_t k = 0; k < block.size(); ++k) block[k / (d * d) * (d * d) + k % d * d + k / d % d] = p.block[k];
  py::dict out;
  out["row_start"] = array_of(p.row_start);
  out["column"] = array_of(p.column);
  out["data"] = array_of(block);
  out["q"] = array_of(std::vector<double>(p.q.begin(), p.q.end()));
  out["mu"] = array_of(std::vector<double>(p.mu.begin(), p.mu.end()));
  return out;
}

// Impulses of all candidates, local, and how they were found.
void give_impulses(Simulation& s, const Input<double>& impulses, const py::dict& found) {
  const std::int64_t n = s.candidates.count;
  stages_of(s, "give_impulses");
  if (!s.contacts_known) throw cairn::Error("there are no contacts at hand: prepare them first");
  if (impulses.size() != n * s.scene.dim)
    throw cairn::Error("impulses holds " + std::to_string(impulses.size()) + " numbers: " + std::to_string(n) +
                       " contacts need " + std::to_string(n * s.scene.dim));
  s.interactions.give_impulses(impulses.data());
  cairn::SolveReport report;
  const auto status = py::cast<std::string>(found["status"]);
  report.status = status == "converged"  ? cairn::SolveStatus::converged
                  : status == "diverged" ? cairn::SolveStatus::diverged
                                         : cairn::SolveStatus::iteration_limit;
  report.contacts = n;
  report.iterations = py::cast<int>(found["iterations"]);
  report.error = py::cast<double>(found["error"]);
  report.worst_error = py::cast<double>(found["worst_error"]);
  report.worst_contact = py::cast<std::int64_t>(found["worst_contact"]);
  report.cone_distance = py::cast<double>(found["cone_distance"]);
  report.penetration = s.interactions.system().penetration;
  report.drift = s.interactions.system().drift;
  report.hint = py::cast<std::string>(found["hint"]);
  s.report.solve = report;
}

// True if an assigned field is a state of motion, so that histories of integrators and states of contacts become
// invalid. Loads (forces, and temperatures that strain meshes) are not.
bool moves_bodies(const std::string& name) {
  return name != "force" && name != "damping" && name != "surface_velocity" && name != "temperature" &&
         name != "potential";
}

// Assigns a field of bodies or nodes and tells the strategy.
void assign(const py::object& self, bool nodes, const std::string& name, const py::array& values) {
  Simulation& s = self.cast<Simulation&>();
  if (!moves_bodies(name))
    write_loads(s);
  else
    known(s);
  py::cast(&s.scene, py::return_value_policy::reference_internal, self)
      .attr(nodes ? "assign_node" : "assign_body")(name, values);
  if (!moves_bodies(name)) return;
  if (!nodes) s.scene.state_assigned();
  s.strategy().changed(s, true);
}

// came_by: "steps", "state" or "checkpoint".
void refuse_other_run(Simulation& s, const std::string& path, const std::string& came_by, std::int64_t last_output,
                      std::vector<std::pair<std::string, std::string>> marks) {
  using cairn::RunOrigin;
  const RunOrigin::From from = came_by == "checkpoint" ? RunOrigin::checkpoint
                               : came_by == "state"    ? RunOrigin::state
                                                       : RunOrigin::steps;
  cairn::refuse_other_run(path, known(s), {from, last_output, std::move(marks)});
}

// A stage of NSCD by itself: with threads and clock as step() calls it.
template <void (cairn::Nscd::*stage)(Simulation&)>
void bind_stage(py::class_<Simulation>& simulation, const char* name) {
  simulation.def(name, [name](Simulation& s) {
    const cairn::StepAlone alone(s);
    const py::gil_scoped_release release;
    cairn::Nscd& nscd = stages_of(s, name);
    const cairn::Threads threads(nscd.settings.solver.threads, std::max(s.candidates.count, s.scene.bodies.count));
    s.timed(name, [&] { (nscd.*stage)(s); });
  });
}

void bind_stages(py::class_<Simulation>& simulation) {
  bind_stage<&cairn::Nscd::predict_configuration>(simulation, "predict_configuration");
  bind_stage<&cairn::Nscd::compute_free_velocity>(simulation, "compute_free_velocity");
  bind_stage<&cairn::Nscd::detect_contacts>(simulation, "detect_contacts");
  bind_stage<&cairn::Nscd::prepare_contacts>(simulation, "prepare_contacts");
  bind_stage<&cairn::Nscd::solve_contacts>(simulation, "solve_contacts");
  bind_stage<&cairn::Nscd::newton_passes>(simulation, "newton_passes");
  bind_stage<&cairn::Nscd::update_velocity>(simulation, "update_velocity");
  bind_stage<&cairn::Nscd::commit_contacts>(simulation, "commit_contacts");
  bind_stage<&cairn::Nscd::update_configuration>(simulation, "update_configuration");
  bind_stage<&cairn::Nscd::part_overlaps>(simulation, "part_overlaps");
  bind_stage<&cairn::Nscd::project_positions>(simulation, "project_positions");
}

} // namespace

void bind_simulation(py::module_& m) {
  m.def("strategies", &strategies);
  m.def("integrators", &integrators);
  m.def("integrator_scheme", &scheme_of);
  m.def("strategy_options", &described);
  py::class_<Simulation> simulation(m, "Simulation");
  simulation
      .def(py::init([](cairn::Scene& scene, const cairn::LawTable& laws, const py::dict& strategy) {
             auto s = std::make_unique<Simulation>(std::move(scene), laws, strategy_of(strategy));
             s->strategy().check_laws(*s);
             return s;
           }),
           "Moves the scene into the simulation: the object that was given is empty afterwards.")
      .def_property_readonly(
          "scene", [](Simulation& s) -> cairn::Scene& { return known(s).scene; },
          py::return_value_policy::reference_internal)
      .def_property_readonly("body_count", [](const Simulation& s) { return s.scene.bodies.count; })
      .def_property_readonly("node_count", [](const Simulation& s) { return s.scene.nodes.count; })
      .def("body", &body_array)
      .def("drive",
           [](Simulation& s, const Input<std::int64_t>& ids, int mask, const Input<double>& velocity) {
             write_loads(s);
             s.scene.drive({ids.data(), std::size_t(ids.size())}, std::uint8_t(mask),
                           {velocity.data(), std::size_t(velocity.size())});
           })
      .def("remove_bodies",
           [](Simulation& s, const Input<std::int64_t>& ids) {
             known(s).remove_bodies({ids.data(), std::size_t(ids.size())});
           })
      .def("set_gravity", [](Simulation& s, const std::array<double, 3>& gravity) { s.scene.gravity = gravity; })
      .def("assign_body", [](const py::object& self, const std::string& name,
                             const py::array& values) { assign(self, false, name, values); })
      .def("assign_node", [](const py::object& self, const std::string& name,
                             const py::array& values) { assign(self, true, name, values); })
      .def_property_readonly("order_version", [](Simulation& s) { return s.scene.order_version(); })
      .def("set_laws", [](Simulation& s, const cairn::LawTable& laws) { s.use(laws); })
      .def("stored_between", &cairn::stored_between)
      .def("plug_force",
           [](Simulation& s, const cairn::PluggedRoutine& r, std::vector<double> params) {
             auto* routine = reinterpret_cast<cairn_plug_body_force*>(r.routine);
             s.forces.push_back({r.name, routine, std::move(params)});
             try {
               s.strategy().check_scene(s);
             } catch (...) {
               s.forces.pop_back();
               throw;
             }
           })
      .def("plug_velocity",
           [](Simulation& s, const cairn::PluggedRoutine& r, std::vector<double> params) {
             auto* routine = reinterpret_cast<cairn_plug_free_velocity*>(r.routine);
             const auto before = std::exchange(s.free_velocity, {{r.name, routine, std::move(params)}});
             try {
               s.strategy().check_scene(s);
             } catch (...) {
               s.free_velocity = before;
               throw;
             }
           })
      .def("set_strategy", &use)
      .def("check_scene", [](Simulation& s) { s.strategy().check_scene(known(s)); })
      .def("check_laws", [](const Simulation& s) { s.strategy().check_laws(s); })
      .def("overlaps_by_law", // true if a law yields, shifts its gap, wears or is plugged: contacts overlap by law
           [](const Simulation& s) {
             for (int e = 0; e < s.laws.entries(); ++e)
               if (!cairn::own_overlap(s.laws.entry(e)).empty() ||
                   cairn::law_infos()[std::size_t(s.laws.entry(e).law)].plugged())
                 return true;
             return false;
           })
      .def("stable_step", [](Simulation& s) { return s.strategy().stable_step(s); })
      .def("stages", [](const Simulation& s) { return s.strategy().stages(s); })
      .def("figures",
           [](Simulation& s) {
             py::dict out;
             for (const auto& [name, value] : s.strategy().figures(s)) out[py::str(name.data(), name.size())] = value;
             return out;
           })
      .def("step",
           [](Simulation& s, double h) {
             const cairn::StepAlone alone(s);
             {
               py::gil_scoped_release release;
               s.step(h);
             }
             py::dict report = report_of(s);
             add_network_reports(report, s);
             return report;
           })
      .def("before_parts", // function(h), called before each part of a step that is made in parts
           [](Simulation& s, py::object function) {
             if (function.is_none()) {
               s.before_part = nullptr;
               return;
             }
             auto held = std::make_shared<py::object>(std::move(function));
             s.before_part = [held](double h) {
               const py::gil_scoped_acquire lock;
               (*held)(h);
             };
           })
      .def("begin_step", [](Simulation& s, double h) { stages_of(s, "begin_step").begin_step(s, h); })
      .def("give_impulses", &give_impulses)
      .def("undo_step", [](Simulation& s) { stages_of(s, "undo_step").undo_step(s); })
      .def("report",
           [](Simulation& s) {
             py::dict report = report_of(s);
             add_network_reports(report, s);
             return report;
           })
      .def("energy", [](Simulation& s) { return energy_of(s.energy); })
      .def("contact", &contact_field)
      .def("has_contact", &cairn::has_contact_field)
      .def("contact_rows", &contact_rows)
      .def("jointed_problem", &jointed_problem)
      .def("law_rows", // contacts that obey a law of its own solution
           [](Simulation& s, int law) {
             if (!s.contacts_known) throw cairn::Error("there are no contacts at hand: make a step first");
             return s.interactions.views().law_rows(cairn::Law(law));
           })
      .def_property_readonly("contact_count", [](Simulation& s) { return cairn::contacts_to_read(s); })
      .def_property_readonly("laws_keep", &Simulation::laws_keep)
      .def_readonly("steps", &Simulation::steps)
      .def_readonly("time", &Simulation::time)
      .def("seconds",
           [](const Simulation& s) {
             const cairn::NewtonSeconds t = s.newton_seconds();
             py::dict out, stages, passes;
             for (const auto& [name, spent] : s.stage_seconds()) stages[name.c_str()] = spent;
             passes["assembly"] = t.assembly;
             passes["factorisation"] = t.factorisation;
             passes["contacts"] = t.contacts;
             passes["balance"] = t.balance;
             passes["all"] = t.all;
             out["seconds"] = stages;
             out["newton_seconds"] = passes;
             return out;
           })
      .def("bytes", &Simulation::bytes)
      .def("get_state", [](Simulation& s) { return dict_of(cairn::state_of(s)); })
      .def("set_state", [](Simulation& s, const py::dict& state) { cairn::take_state(s, tree_of(state)); })
      .def("fingerprint", [](Simulation& s) { return cairn::fingerprint(known(s).scene); })
      // what programs in C and Fortran do
      .def("write_checkpoint", &cairn::write_checkpoint)
      .def("restart", &cairn::restart)
      .def("refuse_other_run", &refuse_other_run)
      .def(
          "is_older_state", // of this scene, when parts of meshes were bodies
          [](Simulation& s, const py::dict& state) { return cairn::is_older_state_of(tree_of(state), known(s).scene); })
      .def("check_state", [](Simulation& s, const py::dict& state, std::int64_t species) {
        cairn::check_state(tree_of(state), species, known(s));
      });
  bind_stages(simulation);
  bind_controls(simulation);
}
