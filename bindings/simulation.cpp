#include <pybind11/functional.h>

#include "laws/plug.hpp"
#include "solvers/sweeps/contact_system.hpp"
#include "strategies/simulation.hpp"
#include "strategies/smooth/smooth_dynamics.hpp"

#include "alone.hpp"
#include "arrays.hpp"

using cairn::Simulation;

namespace {

cairn::Nscd nscd_of(const py::dict& d) {
  cairn::Nscd n;
  n.theta = py::cast<double>(d["theta"]);
  n.margin = py::cast<double>(d["margin"]);
  n.project_positions = py::cast<bool>(d["project_positions"]);
  n.act_on_surfaces = py::cast<bool>(d["act_on_surfaces"]);
  n.warm_start = py::cast<bool>(d["warm_start"]);
  n.renumber_every = py::cast<int>(d["renumber_every"]);
  n.solver.tolerance = py::cast<double>(d["tol"]);
  n.solver.min_iterations = py::cast<int>(d["min_iter"]);
  n.solver.max_iterations = py::cast<int>(d["max_iter"]);
  n.solver.threads = py::cast<int>(d["threads"]);
  n.solver.solver = py::cast<std::string>(d["solver"]);
  n.explicit_bulk = py::cast<bool>(d["explicit_bulk"]);
  n.refuse_unstable = py::cast<bool>(d["refuse_unstable"]);
  n.pose.kernel = cairn::pose_named(py::cast<std::string>(d["pose"]));
  const auto params = py::cast<std::array<double, 2>>(d["pose_params"]);
  std::copy(params.begin(), params.end(), n.pose.params);
  if (d.contains("memory")) n.solver.max_bytes = py::cast<double>(d["memory"]);
  return n;
}

cairn::SmoothDem smooth_dem_of(const py::dict& d) {
  cairn::SmoothDem o;
  o.skin = py::cast<double>(d["skin"]);
  o.overlap = py::cast<double>(d["overlap"]);
  o.refuse_unstable = py::cast<bool>(d["refuse_unstable"]);
  o.energy = py::cast<bool>(d["energy"]);
  o.renumber_every = py::cast<int>(d["renumber_every"]);
  o.threads = py::cast<int>(d["threads"]);
  return o;
}

void use(Simulation& s, const py::dict& d) {
  if (py::cast<std::string>(d["strategy"]) == "smooth_dem")
    s.use(smooth_dem_of(d));
  else
    s.use(nscd_of(d));
}

const char* name_of(cairn::SolveStatus status) {
  switch (status) {
  case cairn::SolveStatus::converged: return "converged";
  case cairn::SolveStatus::iteration_limit: return "iteration_limit";
  default: return "diverged";
  }
}

#define CAIRN_ENERGY_TERMS(X)                                                                                          \
  X(kinetic)                                                                                                           \
  X(potential)                                                                                                         \
  X(work_driven)                                                                                                       \
  X(work_external)                                                                                                     \
  X(dissipated_friction)                                                                                               \
  X(dissipated_normal)                                                                                                 \
  X(dissipated_bulk)                                                                                                   \
  X(dissipated_theta) X(work_projection) X(stored) X(closure) X(in_play) X(largest_kinetic) X(turned_over)

py::dict energy_of(const cairn::Energy& e) {
  py::dict out;
#define X(term) out[#term] = e.term;
  CAIRN_ENERGY_TERMS(X)
#undef X
  return out;
}

void restore_energy(cairn::Energy& e, const py::dict& in) {
#define X(term) e.term = py::cast<double>(in[#term]);
  CAIRN_ENERGY_TERMS(X)
#undef X
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

// Body ids of both sides of every candidate: what a person calls the pair.
py::array_t<std::int64_t> contact_bodies(Simulation& s) {
  py::array_t<std::int64_t> out({py::ssize_t(s.candidates.count), py::ssize_t(2)});
  std::int64_t* to = out.mutable_data();
  for (std::int64_t k = 0; k < s.candidates.count; ++k) {
    *to++ = *s.scene.bodies.id[*s.scene.contactors.body[s.candidates.contactor_a[k]]];
    *to++ = *s.scene.bodies.id[*s.scene.contactors.body[s.candidates.contactor_b[k]]];
  }
  return out;
}

// What tells a contact from all others, from step to step (ContactMemory).
py::array_t<std::int64_t> contact_keys(Simulation& s) {
  const auto& c = s.candidates;
  py::array_t<std::int64_t> out({py::ssize_t(c.count), py::ssize_t(4)});
  std::int64_t* to = out.mutable_data();
  for (std::int64_t k = 0; k < c.count; ++k) {
    *to++ = *s.scene.contactors.id[c.contactor_a[k]];
    *to++ = *s.scene.contactors.id[c.contactor_b[k]];
    *to++ = c.feature[k];
    *to++ = c.image[k];
  }
  return out;
}

template <class T>
py::array_t<T> array_of(const std::vector<T>& v) {
  return py::array_t<T>(py::ssize_t(v.size()), v.data());
}

template <class F>
py::array_t<double> filled(std::int64_t items, int components, F&& fill) {
  py::array_t<double> out(shape_of(items, components));
  fill(out.mutable_data());
  return out;
}

// Forces of smooth contacts count for a step, as impulses do.
py::object smooth_field(Simulation& s, const std::string& name) {
  const std::int64_t n = s.candidates.count;
  const int dim = s.scene.dim;
  const cairn::SmoothDynamics& c = *s.smooth();
  const auto times_step = [&](double* to) {
    for (std::int64_t i = 0; i < n * dim; ++i) to[i] *= s.report.h;
  };
  if (name == "impulse") return filled(n, dim, [&](double* to) { c.force_space(to), times_step(to); });
  if (name == "impulse_local") return filled(n, dim, [&](double* to) { c.force_local(s, to), times_step(to); });
  if (name == "relative_velocity") return filled(n, dim, [&](double* to) { c.relative_velocity(s, to); });
  if (name == "moment") {
    const int components = dim == 2 ? 1 : 3;
    return filled(n, components, [&](double* to) { std::fill_n(to, n * components, 0.0); });
  }
  if (name == "status") {
    py::array_t<std::int32_t> out(n);
    c.status(s, out.mutable_data());
    return out;
  }
  throw py::key_error("smooth contacts have no field " + name + "; the sums are in the energy of the simulation");
}

py::object contact_field(Simulation& s, const std::string& name) {
  if (s.smooth()) s.smooth()->view(s);
  const std::int64_t n = s.candidates.count;
  const int dim = s.scene.dim;
  auto copied = [&](const cairn::Array<double>& from, int components) {
    return filled(n, components, [&](double* to) { std::copy_n(from.data(), n * components, to); });
  };
  if (name == "bodies") return contact_bodies(s);
  if (name == "key") return contact_keys(s);
  if (name == "gap") return copied(s.candidates.gap, 1);
  if (name == "normal") return copied(s.candidates.normal, dim);
  if (name == "point") {
    py::array_t<double> out = copied(s.candidates.point, dim);
    for (std::int64_t i = 0; i < n * dim; ++i) out.mutable_data()[i] += s.scene.origin[i % dim];
    return out;
  }
  if (s.smooth()) return smooth_field(s, name);
  auto& c = s.interactions;
  if (!s.contacts_known()) { // detected, not yet solved
    if (name == "status") return array_of(std::vector<std::int32_t>(n, 0));
    const bool scalar = name == "dissipated" || (name == "moment" && dim == 2);
    return filled(n, scalar ? 1 : dim, [&](double* to) { std::fill_n(to, n * (scalar ? 1 : dim), 0.0); });
  }
  if (name == "impulse") return filled(n, dim, [&](double* to) { c.impulse_space(to); });
  if (name == "impulse_local") return filled(n, dim, [&](double* to) { c.impulse_local(to); });
  if (name == "moment") return filled(n, dim == 2 ? 1 : 3, [&](double* to) { c.moment_space(to); });
  if (name == "relative_velocity") return filled(n, dim, [&](double* to) { c.relative_velocity(to); });
  if (name == "dissipated") return filled(n, 1, [&](double* to) { c.dissipated(to); });
  if (name == "status") {
    py::array_t<std::int32_t> out(n);
    c.status(out.mutable_data());
    return out;
  }
  throw py::key_error("there is no contact field " + name);
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
  out["memory"] = memory_of(s.contact_memory());
  out["projection_memory"] = memory_of(s.projection_memory());
  out["energy"] = energy_of(s.energy);
  out["steps"] = s.steps;
  out["time"] = s.time;
  return out;
}

py::dict contact_rows(Simulation& s) {
  if (s.smooth() || !s.contacts_known()) throw cairn::Error("there is no contact problem at hand: make a step first");
  const cairn::ContactRows rows = s.interactions.rows();
  py::dict out;
  out["axes"] = array_of(rows.axes);
  out["lever"] = array_of(rows.lever);
  out["bias"] = array_of(rows.bias);
  out["mu"] = array_of(rows.mu);
  out["bodies"] = array_of(rows.bodies);
  out["kind"] = array_of(rows.kind);
  return out;
}

// Impulses of all candidates, local, and how they were found.
void give_impulses(Simulation& s, const Input<double>& impulses, const py::dict& found) {
  const std::int64_t n = s.candidates.count;
  if (s.smooth() || !s.contacts_known()) throw cairn::Error("there are no contacts at hand: prepare them first");
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
  s.restore_contacts(memory_from(state["memory"]));
  s.restore_projection(memory_from(state["projection_memory"]));
  s.forget_contacts();
  restore_energy(s.energy, state["energy"]);
  s.steps = py::cast<std::int64_t>(state["steps"]);
  s.time = py::cast<double>(state["time"]);
}

} // namespace

void bind_simulation(py::module_& m) {
  py::class_<Simulation>(m, "Simulation")
      .def(py::init([](const cairn::Scene& scene, const cairn::LawTable& laws, const py::dict& strategy) {
        auto s = std::make_unique<Simulation>(scene, laws, cairn::Nscd{});
        use(*s, strategy);
        s->check_laws();
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
             if (s.smooth()) s.smooth()->invalidate();
           })
      .def_property_readonly("order_version", [](Simulation& s) { return s.scene.order_version(); })
      .def("set_laws",
           [](Simulation& s, const cairn::LawTable& laws) {
             s.laws = laws;
             if (s.smooth()) s.smooth()->invalidate(false);
           })
      .def("plug_force",
           [](Simulation& s, const cairn::PluggedRoutine& r, std::vector<double> params) {
             auto* routine = reinterpret_cast<cairn_plug_body_force*>(r.routine);
             s.forces.push_back({r.name, routine, std::move(params)});
           })
      .def("plug_velocity",
           [](Simulation& s, const cairn::PluggedRoutine& r, std::vector<double> params) {
             auto* routine = reinterpret_cast<cairn_plug_free_velocity*>(r.routine);
             s.free_velocity = {r.name, routine, std::move(params)};
           })
      .def("set_strategy", &use)
      .def("check_laws", &Simulation::check_laws)
      .def("stable_step",
           [](Simulation& s) {
             if (!s.smooth()) return std::numeric_limits<double>::infinity();
             s.smooth()->view(s);
             return s.smooth()->contact_limit(s);
           })
      .def("skin",
           [](Simulation& s) {
             if (!s.smooth()) throw cairn::Error("NSCD has no skin");
             s.smooth()->view(s);
             return s.smooth()->skin();
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
      .def("begin_step", &Simulation::begin_step)
      .def("predict_configuration", &Simulation::predict_configuration)
      .def("compute_free_velocity", &Simulation::compute_free_velocity)
      .def("detect_contacts", &Simulation::detect_contacts)
      .def("prepare_contacts", &Simulation::prepare_contacts)
      .def("solve_contacts", &Simulation::solve_contacts)
      .def("update_velocity", &Simulation::update_velocity, py::arg("correct") = std::function<void()>())
      .def("give_impulses", &give_impulses)
      .def("commit_contacts", &Simulation::commit_contacts)
      .def("update_configuration", &Simulation::update_configuration)
      .def("project_positions", &Simulation::project_positions)
      .def("undo_step", &Simulation::undo_step)
      .def("report", [](Simulation& s) { return report_of(s.report); })
      .def("energy", [](Simulation& s) { return energy_of(s.energy); })
      .def("contact", &contact_field)
      .def("contact_rows", &contact_rows)
      .def_property_readonly("contact_count",
                             [](Simulation& s) {
                               if (s.smooth() && s.steps > 0) s.smooth()->view(s);
                               return s.candidates.count;
                             })
      .def_readonly("steps", &Simulation::steps)
      .def_readonly("time", &Simulation::time)
      .def("stage_seconds", &Simulation::stage_seconds)
      .def("bytes", &Simulation::bytes)
      .def("get_state", &get_state)
      .def("set_state", &set_state);
}
