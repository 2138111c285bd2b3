// Forces of meshes that another code finds: a routine of a library, or a Python object, see
// python/cairn/model/callbacks.py.
#include "arrays.hpp"
#include "fe/called_forces.hpp"
#include "plugs/plug.hpp"
#include "script_error.hpp"

using cairn::CalledForces;

namespace {

// Wraps a Python object that the core calls. Calls acquire the GIL, which a step releases; Python exceptions pass
// through as ScriptError.
struct Caller {
  py::object object;
};

py::object& object_of(void* context) { return static_cast<Caller*>(context)->object; }

void take(const py::object& given, std::int64_t n, double* out, const char* what) {
  const auto values = py::cast<Input<double>>(given);
  if (values.size() != n)
    throw cairn::Error(std::string(what) + " of a mesh has " + std::to_string(values.size()) + " numbers, not " +
                       std::to_string(n));
  std::copy_n(values.data(), n, out);
}

std::int32_t forces_of(void* context, std::int64_t dofs, std::int64_t entries, double time, double step, double rate,
                       const double* u, const double* v, double* force, double* tangent, double* energy,
                       double* dissipated) {
  const py::gil_scoped_acquire lock;
  return by_script([&] {
    const py::object found = object_of(context).attr("forces")(
        py::array_t<double>(dofs, u), py::array_t<double>(dofs, v), time, step, rate, tangent != nullptr);
    if (found.is_none()) return 1;
    const auto parts = py::cast<py::tuple>(found); // force, values of the tangent, energy, dissipated
    take(parts[0], dofs, force, "the force");
    if (tangent) take(parts[1], entries, tangent, "the tangent");
    if (!parts[2].is_none()) *energy = py::cast<double>(parts[2]);
    if (!parts[3].is_none()) *dissipated = py::cast<double>(parts[3]);
    return 0;
  });
}

std::int32_t commit_of(void* context) {
  const py::gil_scoped_acquire lock;
  by_script([&] { object_of(context).attr("commit")(); });
  return 0;
}

std::int32_t rollback_of(void* context) {
  const py::gil_scoped_acquire lock;
  by_script([&] { object_of(context).attr("rollback")(); });
  return 0;
}

std::int64_t size_of(void* context) {
  const py::gil_scoped_acquire lock;
  return by_script([&] { return py::cast<Input<double>>(object_of(context).attr("save")()).size(); });
}

std::int32_t save_of(void* context, std::int64_t size, double* state) {
  const py::gil_scoped_acquire lock;
  by_script([&] { take(object_of(context).attr("save")(), size, state, "the history"); });
  return 0;
}

std::int32_t load_of(void* context, std::int64_t size, const double* state) {
  const py::gil_scoped_acquire lock;
  by_script([&] { object_of(context).attr("load")(py::array_t<double>(size, state)); });
  return 0;
}

void destroy_of(void* context) {
  const py::gil_scoped_acquire lock;
  delete static_cast<Caller*>(context);
}

cairn::SparseMatrix pattern_of(const Input<std::int64_t>& start, const Input<std::int32_t>& row) {
  cairn::SparseMatrix p;
  p.n = start.size() - 1;
  p.start.assign(start.data(), start.data() + start.size());
  p.row.assign(row.data(), row.data() + row.size());
  return p;
}

// keeps: it has commit and rollback; tells: save and load; gives: energy, dissipation.
std::shared_ptr<CalledForces> by_object(int dim, const Input<std::int64_t>& start, const Input<std::int32_t>& row,
                                        const py::object& object, bool keeps, bool tells, bool energy,
                                        bool dissipation) {
  const cairn::SparseMatrix pattern = pattern_of(start, row);
  const auto open = [object, keeps, tells, energy, dissipation, n = pattern.n,
                     entries = std::int64_t(pattern.row.size())] {
    cairn_body_calls calls{};
    calls.abi = CAIRN_BODY_CALLS_ABI;
    calls.size = sizeof calls;
    calls.gives_energy = energy;
    calls.gives_dissipation = dissipation;
    calls.dofs = n;
    calls.entries = entries;
    calls.context = new Caller{object};
    calls.destroy = destroy_of;
    calls.forces = forces_of;
    if (keeps) {
      calls.commit = commit_of;
      calls.rollback = rollback_of;
    }
    if (tells) {
      calls.state_size = size_of;
      calls.save = save_of;
      calls.load = load_of;
    }
    return calls;
  };
  auto made = CalledForces::make(py::cast<std::string>(object.attr("given_by")), dim, pattern, open);
  made->throws_its_own = true;
  return made;
}

std::shared_ptr<CalledForces> by_library(const cairn::PluggedRoutine& routine, const std::vector<double>& params,
                                         int dim, const Input<double>& position, const Input<std::int64_t>& start,
                                         const Input<std::int32_t>& row) {
  return cairn::plug_body(routine, params, dim, {position.data(), position.data() + position.size()},
                          pattern_of(start, row));
}

// Returns forces (dofs), values of the fitted triangle or None, error text or None, energy, dissipation.
py::tuple evaluate(CalledForces& forces, const Input<double>& u, const Input<double>& v, double time, double step,
                   double rate, std::int64_t values) {
  if (u.size() != v.size()) throw cairn::Error("displacement and velocity have different sizes");
  py::array_t<double> force(u.size());
  py::object tangent = py::none();
  double* to = nullptr;
  if (values >= 0) {
    py::array_t<double> made(values);
    std::fill_n(made.mutable_data(), values, 0.0);
    to = made.mutable_data();
    tangent = made;
  }
  cairn::MeshMotion at{u.data(), v.data(), time, step};
  at.rate = rate;
  const cairn::BulkResult found = forces.evaluate(at, force.mutable_data(), to);
  if (!found.ok()) return py::make_tuple(py::none(), py::none(), forces.describe(found), 0.0, 0.0);
  const auto known = [](bool is, double value) { return is ? py::object(py::float_(value)) : py::object(py::none()); };
  return py::make_tuple(force, tangent, py::none(), known(forces.knows_energy(), found.energy),
                        known(forces.knows_dissipation(), found.dissipated));
}

} // namespace

void bind_called(py::module_& m) {
  py::class_<cairn::InternalForces, std::shared_ptr<cairn::InternalForces>>(m, "InternalForces");
  py::class_<CalledForces, cairn::InternalForces, std::shared_ptr<CalledForces>>(m, "CalledForces")
      .def_static("by_object", &by_object)
      .def_static("by_library", &by_library)
      .def("fit", [](CalledForces& f, const Input<std::int64_t>& start,
                     const Input<std::int32_t>& row) { f.fit(pattern_of(start, row)); })
      .def("evaluate", &evaluate)
      .def("commit", &CalledForces::commit)
      .def("rollback", &CalledForces::rollback);
}
