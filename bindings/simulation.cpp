#include "base/threads.hpp"
#include "laws/plug.hpp"
#include "solvers/sweeps/contact_system.hpp"
#include "strategies/contact_fields.hpp"
#include "strategies/nscd/nscd.hpp"
#include "strategies/options.hpp"

#include "alone.hpp"
#include "arrays.hpp"

using cairn::Simulation;

namespace {

// A strategy with the settings that a dict gives by the names of its options.
std::unique_ptr<cairn::Strategy> strategy_of(const py::dict& d) {
  auto strategy = cairn::make_strategy(py::cast<std::string>(d["strategy"]));
  for (cairn::Option& o : strategy->options()) {
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
    rows.append(py::make_tuple(s.name, s.python_name, s.meaning, laws));
  }
  return rows;
}

void use(Simulation& s, const py::dict& d) { s.use(strategy_of(d)); }

const char* name_of(cairn::SolveStatus status) {
  switch (status) {
  case cairn::SolveStatus::converged: return "converged";
  case cairn::SolveStatus::iteration_limit: return "iteration_limit";
  default: return "diverged";
  }
}

py::dict energy_of(const cairn::Energy& e) {
  py::dict out;
#define CAIRN_ENERGY_TERM(term, meaning) out[#term] = e.term;
#include "strategies/report.def"
  return out;
}

void restore_energy(cairn::Energy& e, const py::dict& in) {
#define CAIRN_ENERGY_TERM(term, meaning) e.term = py::cast<double>(in[#term]);
#include "strategies/report.def"
}

py::dict report_of(const cairn::StepReport& r) {
  py::dict out;
  out["step"] = r.step;
  out["time"] = r.time;
  out["time_detection"] = r.time_detection;
  out["dt"] = r.h;
  out["contacts"] = r.contacts;
  out["unresolved_rotations"] = r.unresolved_rotations;
  out["status"] = name_of(r.solve.status);
  out["solver"] = r.solve.solver;
  out["iterations"] = r.solve.iterations;
  out["error"] = r.solve.error;
  out["worst_error"] = r.solve.worst_error;
  out["worst_contact"] = r.solve.worst_contact;
  out["light_error"] = r.solve.light_error;
  out["light_contact"] = r.solve.light_contact;
  out["penetration"] = r.solve.penetration;
  out["cone_distance"] = r.solve.cone_distance;
  out["energy_created"] = r.solve.energy_created;
  out["hint"] = r.solve.hint;
  out["projection_error"] = r.projection_error;
  if (r.stable_step > 0) {
    out["stable_step"] = r.stable_step;
    out["neighbour_lists"] = r.neighbour_lists;
    out["status"] = "explicit";
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

py::dict memory_of(const cairn::ContactMemory& m) {
  py::dict out;
  py::array_t<std::int64_t> keys({py::ssize_t(m.keys.size()), py::ssize_t(4)});
  std::int64_t* to = keys.mutable_data();
  for (const cairn::ContactKey& k : m.keys) {
    *to++ = k.contactor_a;
    *to++ = k.contactor_b;
    *to++ = k.feature;
    *to++ = k.image;
  }
  out["h"] = m.h;
  out["contactors_seen"] = m.contactors_seen;
  out["impulse_components"] = m.impulse_components;
  out["state_components"] = m.state_components;
  out["keys"] = keys;
  out["impulses"] = array_of(m.impulses);
  out["states"] = array_of(m.states);
  if (!m.forces.empty()) out["forces"] = array_of(m.forces);
  return out;
}

cairn::ContactMemory memory_from(const py::dict& d) {
  cairn::ContactMemory m;
  m.h = py::cast<double>(d["h"]);
  m.contactors_seen = py::cast<std::int64_t>(d["contactors_seen"]);
  m.impulse_components = py::cast<int>(d["impulse_components"]);
  m.state_components = py::cast<int>(d["state_components"]);
  const Input<std::int64_t> keys = py::cast<Input<std::int64_t>>(d["keys"]);
  for (py::ssize_t i = 0; i + 3 < keys.size(); i += 4) {
    const std::int64_t* k = keys.data() + i;
    m.keys.push_back({k[0], k[1], std::int32_t(k[2]), std::int32_t(k[3])});
  }
  const Input<double> impulses = py::cast<Input<double>>(d["impulses"]), states = py::cast<Input<double>>(d["states"]);
  m.impulses.assign(impulses.data(), impulses.data() + impulses.size());
  m.states.assign(states.data(), states.data() + states.size());
  if (d.contains("forces")) {
    const Input<double> forces = py::cast<Input<double>>(d["forces"]);
    m.forces.assign(forces.data(), forces.data() + forces.size());
  }
  return m;
}

py::dict get_state(py::object self) {
  Simulation& s = self.cast<Simulation&>();
  py::dict out;
  out["scene"] = self.attr("scene").attr("get_state")();
  out["memory"] = memory_of(s.strategy().memory(s));
  out["projection_memory"] = memory_of(s.strategy().projection_memory());
  out["energy"] = energy_of(s.energy);
  out["steps"] = s.steps;
  out["time"] = s.time;
  return out;
}

py::dict contact_rows(Simulation& s) {
  stages_of(s);
  if (!s.contacts_known) throw cairn::Error("there is no contact problem at hand: make a step first");
  const cairn::ContactRows rows = s.interactions.rows();
  py::dict out;
  out["axes"] = array_of(rows.axes);
  out["lever"] = array_of(rows.lever);
  out["bias"] = array_of(rows.bias);
  out["mu"] = array_of(rows.mu);
  out["bodies"] = array_of(rows.bodies);
  out["kind"] = array_of(rows.kind);
  out["mesh"] = array_of(rows.mesh);
  out["node"] = array_of(rows.node);
  out["weight"] = array_of(rows.weight);
  return out;
}

// Impulses of all candidates, local, and how they were found.
void give_impulses(Simulation& s, const Input<double>& impulses, const py::dict& found) {
  const std::int64_t n = s.candidates.count;
  stages_of(s);
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
  report.hint = py::cast<std::string>(found["hint"]);
  s.report.solve = report;
}

void set_state(py::object self, const py::dict& state) {
  Simulation& s = self.cast<Simulation&>();
  self.attr("scene").attr("set_state")(state["scene"]);
  s.strategy().restore(s, memory_from(state["memory"]));
  s.strategy().restore_projection(s, memory_from(state["projection_memory"]));
  s.forget_contacts();
  restore_energy(s.energy, state["energy"]);
  s.steps = py::cast<std::int64_t>(state["steps"]);
  s.time = py::cast<double>(state["time"]);
}

// A stage of NSCD by itself: with threads and clock as step() calls it.
template <void (cairn::Nscd::*stage)(Simulation&)>
void bind_stage(py::class_<Simulation>& simulation, const char* name) {
  simulation.def(name, [name](Simulation& s) {
    const cairn::StepAlone alone(s);
    const py::gil_scoped_release release;
    cairn::Nscd& nscd = stages_of(s);
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
  bind_stage<&cairn::Nscd::update_velocity>(simulation, "update_velocity");
  bind_stage<&cairn::Nscd::commit_contacts>(simulation, "commit_contacts");
  bind_stage<&cairn::Nscd::update_configuration>(simulation, "update_configuration");
  bind_stage<&cairn::Nscd::project_positions>(simulation, "project_positions");
}

} // namespace

void bind_simulation(py::module_& m) {
  m.def("strategies", &strategies);
  m.def("strategy_options", &described);
  py::class_<Simulation> simulation(m, "Simulation");
  simulation
      .def(py::init([](const cairn::Scene& scene, const cairn::LawTable& laws, const py::dict& strategy) {
        auto s = std::make_unique<Simulation>(scene, laws, strategy_of(strategy));
        s->strategy().check_laws(*s);
        return s;
      }))
      .def_property_readonly(
          "scene", [](Simulation& s) -> cairn::Scene& { return s.scene; }, py::return_value_policy::reference_internal)
      .def("remove_bodies",
           [](Simulation& s, const Input<std::int64_t>& ids) {
             s.scene.remove_bodies({ids.data(), std::size_t(ids.size())});
             s.forget_contacts();
           })
      .def("set_gravity", [](Simulation& s, const std::array<double, 3>& gravity) { s.scene.gravity = gravity; })
      .def("assign_body",
           [](py::object self, const std::string& name, const py::array& values) {
             self.attr("scene").attr("assign_body")(name, values);
             if (name == "force" || name == "damping") return;
             Simulation& s = self.cast<Simulation&>();
             s.scene.state_assigned();
             s.strategy().changed(s, true);
           })
      .def_property_readonly("order_version", [](Simulation& s) { return s.scene.order_version(); })
      .def("set_laws",
           [](Simulation& s, const cairn::LawTable& laws) {
             s.laws = laws;
             s.strategy().changed(s, false);
           })
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
      .def("check_scene", [](const Simulation& s) { s.strategy().check_scene(s); })
      .def("check_laws", [](const Simulation& s) { s.strategy().check_laws(s); })
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
             return report_of(s.report);
           })
      .def("begin_step", [](Simulation& s, double h) { stages_of(s).begin_step(s, h); })
      .def("give_impulses", &give_impulses)
      .def("undo_step", [](Simulation& s) { stages_of(s).undo_step(s); })
      .def("report", [](Simulation& s) { return report_of(s.report); })
      .def("energy", [](Simulation& s) { return energy_of(s.energy); })
      .def("contact", &contact_field)
      .def("contact_rows", &contact_rows)
      .def_property_readonly("contact_count", [](Simulation& s) { return cairn::contacts_to_read(s); })
      .def_readonly("steps", &Simulation::steps)
      .def_readonly("time", &Simulation::time)
      .def("stage_seconds", &Simulation::stage_seconds)
      .def("bytes", &Simulation::bytes)
      .def("get_state", &get_state)
      .def("set_state", &set_state);
  bind_stages(simulation);
}
